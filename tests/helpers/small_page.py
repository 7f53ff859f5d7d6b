"""A small report for tests of pages: two drives, two methods."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from evaluation.maps.thumbnails import thumbnail
from evaluation.methods import make_method
from evaluation.recognition.costs import Cost
from evaluation.recognition.fault_names import PairEvidence
from evaluation.recognition.place_metrics import place_numbers, pose_numbers
from evaluation.recognition.place_outcome import PlaceOutcome, QueryDrive
from evaluation.recognition.pose_errors import PoseErrors
from evaluation.recognition.protocol import PAPER_PROTOCOL
from evaluation.recognition.retrieval import Retrieval
from evaluation.report.contents import Report
from evaluation.report.illustrations import Illustration
from evaluation.report.map_figures import top_view
from evaluation.report.page_data import make_page_drive
from evaluation.report.reference import Finding, Judgement, Reference
from evaluation.report.tables.queries import DriveTrack
from evaluation.results.keys import LAST, OWN, STAGE, made_by
from evaluation.results.table import Results, Row

PLACES = 5.0 * np.arange(10)
QUERIES = np.array([0.0, 10.0, 20.0, 30.0, 100.0])
MAP = "metropolis"


def _judge(results, changes):
    return [
        Judgement(heading, [finding])
        for heading, finding in (
            ("Claims", Finding("A < B & C.", "does not hold", "1 of 2.")),
            ("Aims", Finding("C > D.", "is missed", "3 of 4.")),
        )
    ]


def make_content(folder, **changed):
    """Returns the content of a page, and writes its figures to a folder."""
    svg = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="900" height="300">'
        "</svg>"
    )
    for name in ("pr", "change", "survival"):
        (folder / f"{name}.svg").write_text(svg)
    results = [
        make_result("scan-context++", [0, 9, None, 6, 3]),
        make_result("ring++", [1, 2, 4, 0, 3]),
        make_result("ring++", [0, 0, 1, 1, 1, 2, 2, 3, 3, 4], back=True),
    ]
    nothing = np.full(5, np.nan)
    # Scan Context++ takes a twin for the second query; no other query has a
    # wrong candidate.
    fits = {"scan-context++": np.array([np.nan, 0.9, *nothing[2:]])}
    fits["ring++"] = nothing
    evidence = {
        (f"{MAP}_01", f"{MAP}_04"): PairEvidence(
            nothing, nothing, nothing, [""] * 5, np.full(5, 0.5), fits
        )
    }
    without_change = make_result("scan-context++", [0, 1, 4, 6, 3])
    values = {
        "reference": Reference(judge=_judge),
        "evidence": evidence,
        "costs": [Cost("ring++", 1, 2000.0, 1.5, 20.25, 10, 12345.0)],
        "illustrations": [
            Illustration(folder / "pr", 'curves "P" < R', "svg"),
            Illustration(
                folder / "change",
                "before and after",
                "svg",
                section="change",
                num_panels=2,
                legend=(
                    ((200, 0, 0), "gone < new"),
                    ((0, 0, 0), "A meaning that is wider than a phone. " * 3),
                ),
            ),
            Illustration(folder / "none", "not for the page", "svg", "print"),
            Illustration(folder / "survival", "kept", "svg", "survival"),
        ],
        "recognitions": results,
        "pairs": [
            (results[0], without_change),
            *((result, None) for result in results[1:]),
        ],
        "tracks": {
            name: DriveTrack(np.arange(len(xs)), _poses(xs, 0.0, 0.0))
            for name, xs in ((f"{MAP}_01", PLACES), (f"{MAP}_04", QUERIES))
        },
        "drives": {
            "metropolis_01": _drive("metropolis_01", PLACES, 0, 0.0),
            "metropolis_04": _drive("metropolis_04", QUERIES, 2, 0.5 * np.pi),
        },
    }
    values |= changed
    return Report(**{"results": make_results(values["pairs"]), **values})


def make_results(pairs, evidence=MappingProxyType({})):
    """Returns the table of pairs of results and of those of their controls."""
    rows = []
    for changed, unchanged in pairs:
        known = evidence.get((changed.database, changed.query))
        after = _outcome(changed, getattr(known, "overlaps", None))
        before = _outcome(unchanged, getattr(known, "unchanged", None))
        for stage, now in ((LAST, before), (OWN, after)):
            if now is None:
                continue
            key = {
                "experiment": "stages",
                "map": changed.pair[0],
                "database": changed.database,
                "query": changed.query,
                "seed": 1,
                "factors": {STAGE: stage},
                **made_by(PAPER_PROTOCOL),
            }
            rows += [
                Row.of(number, **key, task=task)
                for task, numbers in (
                    ("place", place_numbers),
                    ("pose", pose_numbers),
                )
                for number in numbers(now, before)
            ]
    return Results.of(rows)


def _outcome(result, overlaps):
    if result is None:
        return None
    if overlaps is None:
        return result
    shown = {"overlap": overlaps, "visible_change": 1.0 - overlaps}
    return replace(result, columns={**result.columns, **shown})


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
    view = top_view(ground, X_WS[:, :3, 3])
    return make_page_drive(name, view, X_WS, range(len(xs)), scans)


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
    outcome = PlaceOutcome.of(
        method,
        make_method(method, {}),
        PAPER_PROTOCOL,
        retrieval,
        QueryDrive(query, np.arange(number), np.zeros((number, 3))),
        [database] * len(places),
    )
    return replace(outcome, pair=(MAP, *stages))
