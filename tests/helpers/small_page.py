"""A small page of recordings: two drives, two methods."""

from dataclasses import dataclass, field

import numpy as np

from evaluation.maps import thumbnail
from evaluation.methods import make_method
from evaluation.recognition import (
    PAPER_PROTOCOL,
    Number,
    PlaceOutcome,
    PoseErrors,
    QueryDrive,
    Retrieval,
)
from evaluation.results import (
    OWN,
    STAGE,
    Answers,
    ChangePicture,
    PageDrive,
    QueryRows,
    Results,
    Row,
    browser_section,
    change_section,
    made_by,
    make_page_drive,
    routes_section,
    write_page,
)

PLACES = 5.0 * np.arange(10)
QUERIES = np.array([0.0, 10.0, 20.0, 30.0, 100.0])
MAP = "metropolis"


@dataclass
class SmallPage:
    """What a page shows.

    Attributes:
        outcomes: for each pair of drives, the outcome of each method.
        drives: name of a drive -> its data.
        pages: name of a drive -> address of its page.
        stages: names of the two stages of the pictures of the change.
    """

    outcomes: list[list[PlaceOutcome]]
    drives: dict[str, PageDrive]
    pages: dict[str, str] = field(default_factory=dict)
    stages: tuple[str, str] = ("01", "04")

    def write(self, folder):
        """Writes the page, and returns its path."""
        results, queries = tables(self.outcomes)
        picture = ChangePicture(MAP, self.stages, folder)
        for path in picture.files:
            path.write_bytes(b"a picture")
        return write_page(
            results,
            queries,
            folder,
            title="stages",
            sections=[
                browser_section(self.outcomes, self.drives, self.pages),
                routes_section({MAP: self.drives.values()}, self.pages),
                change_section(results, [picture]),
            ],
        )


def make_content(**changed):
    """Returns the content of a page."""
    values = {
        "outcomes": [
            [
                make_result("scan-context++", [0, 9, None, 6, 3]),
                make_result("ring++", [1, 2, 4, 0, 3]),
            ],
            [make_result("ring++", [0, 0, 1, 1, 1, 2, 2, 3, 3, 4], back=True)],
        ],
        "drives": {
            "metropolis_01": _drive("metropolis_01", PLACES, 0, 0.0),
            "metropolis_04": _drive("metropolis_04", QUERIES, 2, 0.5 * np.pi),
        },
    }
    return SmallPage(**{**values, **changed})


def tables(outcomes):
    """Returns the tables of outcomes, and of a change between their drives."""
    rows, answers = [], []
    for one in (one for of_pair in outcomes for one in of_pair):
        key = {
            "experiment": "stages",
            "map": MAP,
            "database": one.database,
            "query": one.query,
            "seed": 1,
            "factors": {STAGE: OWN},
            **made_by(PAPER_PROTOCOL),
        }
        rows += [
            Row.of(number, **key, task="place") for number in one.numbers()
        ]
        change = Number("", False, "tcr_sym", 0.25, n=9)
        rows.append(Row.of(change, **key, task="change"))
        answers.append(
            Answers(
                **key,
                task="place",
                method=one.method,
                verified=False,
                columns=one.outcomes.columns,
            )
        )
    return Results.of(rows), QueryRows.of(answers)


def _poses(xs, y, yaw):
    X = np.tile(np.eye(4), (len(xs), 1, 1))
    X[:, :2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    X[:, 0, 3], X[:, 1, 3], X[:, 2, 3] = xs, y, 1.6
    return X


def _drive(name, xs, y, yaw):
    rng = np.random.default_rng(5)
    ground = np.c_[rng.uniform(-60, 160, (4000, 2)), np.zeros(4000)]
    # A wall that is 20 m ahead.
    wall = np.c_[np.full(200, 20.25), np.linspace(-9, 9, 200), np.ones(200)]
    scans = [thumbnail(wall, 1.6, i) for i in range(len(xs))]
    X_WS = _poses(xs, y, yaw)
    return make_page_drive(name, ground, X_WS, range(len(xs)), scans)


def make_result(method, best, back=False):
    """Scores 0.9 for the best place of each query, 0.2 for its neighbours.

    A query whose best place is None has no candidate.
    """
    queries, places = (PLACES, QUERIES) if back else (QUERIES, PLACES)
    scores = np.full((len(queries), len(places)), np.nan)
    for row, place in zip(scores, best, strict=True):
        if place is not None:
            row[:] = 0.2 - 0.001 * np.arange(len(places))
            row[place] = 0.9
    distances = np.hypot(queries[:, None] - places, 2.0)
    retrieval = Retrieval(
        np.arange(len(queries)),
        np.arange(len(places)),
        scores,
        distances,
        distances <= PAPER_PROTOCOL.radius,
        PoseErrors.unknown(len(queries)),
        np.ones(distances.shape, dtype=bool),
    )
    stages = ("04", "01") if back else ("01", "04")
    database, query = (f"{MAP}_{stage}" for stage in stages)
    number = len(queries)
    return PlaceOutcome.of(
        method,
        make_method(method, {}),
        PAPER_PROTOCOL,
        retrieval,
        QueryDrive(query, np.arange(number), np.zeros((number, 3))),
        [database] * len(places),
    )
