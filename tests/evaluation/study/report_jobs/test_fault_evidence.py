"""Why best places are wrong: walls that hide, come, go and repeat."""

import csv
from dataclasses import replace

from helpers.drive_files import make_scan, write_recording, yaw_pose
import numpy as np
import pytest

from evaluation.drives import open_drive
from evaluation.methods import make_method
from evaluation.recognition.fault_names import (
    FAULT_KINDS,
    PairEvidence,
    fault_kinds,
)
from evaluation.recognition.place_outcome import PlaceOutcome, QueryDrive
from evaluation.recognition.pose_errors import PoseErrors
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import Retrieval
from evaluation.report.tables.faults import fault_numbers, fault_table
from evaluation.study.report_jobs.fault_evidence import find_evidence

HEIGHT = 1.6
TABLE = {
    1: ("ground", "road"),
    2: ("house", "building"),
    3: ("screen", "fence"),
    4: ("old tree", "vegetation"),
}


def block(low, high, step=0.25):
    """Points of the surfaces of a box."""
    axes = [
        np.arange(a, b + 1e-9, step) for a, b in zip(low, high, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    on_surface = np.isclose(points, low) | np.isclose(points, high)
    return points[on_surface.any(axis=1)]


def court(x):
    """A court of four walls about (x, 0); no turn maps it onto itself."""
    return np.concatenate(
        [
            block((x - 12, 14, 0), (x + 14, 14, 6)),
            block((x - 12, -9, 0), (x + 2, -9, 6)),
            block((x + 14, -9, 0), (x + 14, 4, 6)),
            block((x - 12, -9, 0), (x - 12, 6, 6)),
            block((x + 5, 7, 0), (x + 7, 8, 4)),
        ]
    )


def write(folder, scans, table, places):
    """Writes a drive; a scan is a dict of instance -> points in the world."""
    made, X_WBs = [], []
    for parts, (x, y, yaw) in zip(scans, places, strict=True):
        X_WB = yaw_pose(x, y, 0.0, yaw)
        points = np.concatenate(list(parts.values()))
        scan = make_scan(
            (points - X_WB[:3, 3]) @ X_WB[:3, :3] - [0.0, 0.0, HEIGHT]
        )
        scan["instance"] = np.repeat(
            list(parts), [len(one) for one in parts.values()]
        )
        made.append(scan)
        X_WBs.append(X_WB)
    attachments = {}
    if table is not None:
        attachments["structures.json"] = [
            {"instance": k, "name": TABLE[k][0], "class": TABLE[k][1]}
            for k in table
        ]
    return open_drive(
        write_recording(folder, made, X_WBs, attachments=attachments)
    )


def result_of(best, distances, protocol, method="solid"):
    """The result of a method with these best places; None is no candidate."""
    scores = np.full(distances.shape, np.nan)
    for row, place in zip(scores, best, strict=True):
        if place is not None:
            row[:] = 0.1
            row[place] = 0.9
    rows, places = distances.shape
    retrieval = Retrieval(
        np.arange(rows),
        np.arange(places),
        scores,
        distances,
        distances <= protocol.radius,
        PoseErrors.unknown(rows),
        np.ones(distances.shape, dtype=bool),
    )
    outcome = PlaceOutcome.of(
        method,
        make_method(method, {}),
        protocol,
        retrieval,
        QueryDrive("b", np.arange(rows), np.zeros((rows, 3))),
        ["a"] * places,
    )
    return replace(outcome, pair=("town", "a", "b"))


def test_what_scans_say(tmp_path):
    """Twins are 200 m apart; a screen hides a wall; a tree is new."""
    far = court(200.0)
    # 4 m before the wall in the north; it hides what is behind it.
    screen = block((-12, 4, 0), (14, 4, 6), step=0.06)
    points = court(0.0)
    plain = {2: points}
    before = points[points[:, 1] < 4.0]
    wood = np.random.default_rng(2).uniform(
        [390, -20, 0], [420, 20, 8], (3000, 3)
    )
    database = write(
        tmp_path / "a",
        [{2: before, 3: screen}, {2: far}, {2: wood}],
        (1, 2, 3),
        [(0.0, 0.0, 0.0), (200.0, 0.0, 0.4), (400.0, 0.0, 0.0)],
    )
    tree = block((-3, -6, 0), (-1, -4, 6))
    query = write(
        tmp_path / "b",
        [plain | {4: tree}, {2: far}],
        (1, 2, 4),
        [(1.0, 0.5, 2.0), (201.0, 1.0, -1.0)],
    )
    protocol = RetrievalProtocol()
    distances = np.abs(
        query.X_WS[:, None, :3, 3] - database.X_WS[None, :, :3, 3]
    ).max(axis=2)
    twin = result_of([1, 0], distances, protocol)
    other = result_of([2, 1], distances, protocol, "ring++")
    found = find_evidence(database, query, [twin, other], protocol)
    # The screen hides points behind it up to the height at which the sensor
    # looks over it. The tree hides nothing, and is missing in the other scan.
    total = len(points) + len(tree)
    behind = points[points[:, 1] > 4.5]
    height = HEIGHT + (6.0 - HEIGHT) * behind[:, 1] / 4.0
    is_hidden = behind[:, 2] < height
    assert found.hidden_shares[0] == pytest.approx(
        is_hidden.sum() / total, abs=0.03
    )
    assert found.overlaps[0] == pytest.approx(len(before) / total, abs=0.03)
    assert found.hidden_shares[1] < 0.02
    assert found.overlaps[1] > 0.95
    # Only standing points count, at most 8192 of each scan, drawn at random.
    # (0.51: no point of the grids lies on the limit.)
    came = standing = 0.0
    for changed, kept in ((screen, before), (tree, points)):
        weight = min(1.0, 8192 / (len(changed) + len(kept)))
        stand = [weight * (one[:, 2] > 0.51).sum() for one in (changed, kept)]
        came += stand[0]
        standing += sum(stand)
    assert found.changed[0] == pytest.approx(came / standing, abs=0.01)
    assert found.changed_classes == ["fence", ""]
    assert found.changed[1] == 0.0
    # The twin fits at any turn, the wood does not; right places have no value.
    assert found.fits["solid"][0] > 0.8
    assert found.right_fits[0] < found.fits["solid"][0]
    assert found.fits["ring++"][0] < 0.5
    assert np.isnan(found.fits["ring++"][1])


def test_without_names_nothing_is_said_of_change(tmp_path):
    scans = [{2: court(0.0)}]
    drives = [
        write(tmp_path / name, scans, None, [(x, 0.0, 0.0)])
        for name, x in (("a", 0.0), ("b", 2.0))
    ]
    protocol = RetrievalProtocol()
    result = result_of([0], np.array([[2.0]]), protocol)
    found = find_evidence(*drives, [result], protocol)
    assert np.isnan(found.changed).all()
    assert found.changed_classes == [""]
    assert found.overlaps[0] > 0.95


NAN = float("nan")
# Best place, fit, overlap, hidden, changed, and the fault. The places are 0, 10
# and 100 m away from each query.
CASES = [
    (0, NAN, 0.1, 0.9, 0.9, ""),
    (None, NAN, 0.9, 0.0, 0.9, "no_candidate"),
    (1, NAN, 0.1, 0.9, 0.9, "too_far"),
    (2, 0.9, 0.49, 0.26, 0.9, "occluded"),
    (2, 0.9, 0.49, 0.25, 0.9, "no_overlap"),
    (2, 0.9, 0.5, 0.5, 0.25, "changed"),
    (2, 0.6, 0.5, 0.5, 0.24, "twin"),
    (2, 0.59, 0.5, 0.5, 0.24, "unexplained"),
    (2, 0.1, 0.9, 0.0, NAN, "unexplained"),
]


@pytest.fixture(scope="module")
def judged():
    best, fits, overlaps, hidden, changed, expected = zip(*CASES, strict=True)
    distances = np.tile([0.0, 10.0, 100.0], (len(best) + 1, 1))
    distances[-1, 0] = 20.0
    result = result_of([*best, 2], distances, RetrievalProtocol())
    known = [np.array([*one, NAN]) for one in (overlaps, hidden, changed)]
    classes = ["car"] * (len(best) + 1)
    fit = {"solid": np.array([*fits, NAN])}
    evidence = PairEvidence(*known, classes, np.full(len(best) + 1, 0.6), fit)
    return result, evidence, [*expected, "no_place"]


def test_each_wrong_answer_has_one_reason(judged):
    result, evidence, expected = judged
    assert fault_kinds(result, evidence) == expected
    assert set(FAULT_KINDS) == set(expected) - {""}


def test_reasons_are_counted(judged):
    result, evidence, _ = judged
    known = {("a", "b"): evidence}
    (row,) = csv.DictReader(
        fault_numbers([result], known).to_csv().splitlines()
    )
    assert (row["queries"], row["wrong"]) == ("10", "8")
    assert [row[kind] for kind in FAULT_KINDS] == ["1"] * 7 + ["2"]
    assert row["changed_by"] == "car:1"
    # The same number as in the table of results.
    reasons = result.columns["why"]
    assert int(row["elsewhere"]) == np.sum(reasons == "elsewhere") == 6
    table = fault_table([result], known)
    (shown,) = table.rows
    assert shown[3:5] == (8, "12 %")
    assert shown[-2:] == ("25 %", "car (1)")
    assert fault_table([result], {}).rows == ()
