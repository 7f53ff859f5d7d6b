"""Overlap of scans: closed forms, and rooms that are wholly visible."""

import csv
import json

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import assert_refused
from helpers.internal.eval_program import run as run_program
from helpers.measured_pairs import place_outcome
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive
from evaluation.methods import make_method
from evaluation.recognition import (
    TOLERANCE,
    RetrievalProtocol,
    SeenSurfaces,
    overlap_matrix,
    overlaps_with_best_match,
    retrieve,
)

# Beams are a degree apart and miss the borders of cells.
AZIMUTH, ELEVATION = np.radians(
    np.meshgrid(np.arange(-179.7, 180.0), np.arange(-44.7, 45.0))
)
BEAMS = np.stack(
    [
        np.cos(ELEVATION) * np.cos(AZIMUTH),
        np.cos(ELEVATION) * np.sin(AZIMUTH),
        np.sin(ELEVATION),
    ],
    axis=-1,
).reshape(-1, 3)


def test_a_scan_shows_itself():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(5000, 3)) * [20.0, 20.0, 2.0]
    points = np.vstack([points, [[0, 0, 5], [0, 0, -5], [-3, 0, 0]]])
    assert SeenSurfaces.of(points).share_of(points) == 1.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("off", "share"), [(-1e-9, 1.0), (1e-9, 0.0)])
def test_the_tolerance_is_a_limit(side, off, share):
    seen = SeenSurfaces.of(10.0 * BEAMS)
    other = (10.0 + side * (TOLERANCE + off)) * BEAMS
    assert seen.share_of(other) == share


def test_what_is_hidden_or_not_there_is_not_shown():
    seen = SeenSurfaces.of(10.0 * BEAMS)
    assert seen.share_of(np.vstack([10.0 * BEAMS, 20.0 * BEAMS])) == 0.5
    few = BEAMS[: len(BEAMS) // 3]
    assert seen.share_of(np.vstack([10.0 * BEAMS, 5.0 * few])) == pytest.approx(
        0.75, abs=1e-3
    )
    # Surfaces above the field of view are unknown.
    assert seen.share_of(np.array([[0.5, 0.0, 10.0]])) == 0.0


def test_the_best_match_by_each_radius():
    few, half = BEAMS[:8000], BEAMS[:4000]
    places = [20.0 * few, 10.0 * half, 10.0 * few]
    queries = [10.0 * few, np.zeros((0, 3)), 20.0 * few]
    still = np.tile(np.eye(4), (3, 1, 1))
    matches = np.zeros((3, 3, 3), bool)
    matches[0, 0, 0] = matches[1, 0, :2] = matches[2] = True
    found = overlaps_with_best_match(places, still, queries, still, matches)
    np.testing.assert_allclose(
        found,
        [[0.0, np.nan, np.nan], [0.5, np.nan, np.nan], [1.0, np.nan, 1.0]],
        atol=0.03,
    )


def test_nothing():
    seen = SeenSurfaces.of(np.zeros((0, 3)))
    assert seen.share_of(BEAMS) == 0.0
    assert np.isnan(SeenSurfaces.of(BEAMS).share_of(np.zeros((0, 3))))


def walls_scan(p_WS, yaw, screens):
    """Returns a sensor's points on walls at y = 10 and y = -10, |x| < 10.

    Screens at y = 5 and y = -5 hide all beyond x = 2.
    """
    turn = np.array(
        [
            [np.cos(yaw), -np.sin(yaw), 0.0],
            [np.sin(yaw), np.cos(yaw), 0.0],
            [0.0, 0.0, 1.0],
        ]
    )
    d_W = BEAMS @ turn.T
    with np.errstate(divide="ignore"):
        times = (np.sign(d_W[:, 1]) * 10.0 - p_WS[1]) / d_W[:, 1]
        on_screen = (np.sign(d_W[:, 1]) * 5.0 - p_WS[1]) / d_W[:, 1]
    hidden = p_WS[0] + on_screen * d_W[:, 0] > 2.0
    times = np.where(screens & hidden, on_screen, times)
    x = p_WS[0] + times * d_W[:, 0]
    kept = (np.abs(x) < 10.0) & (np.abs(d_W[:, 2]) < np.sin(np.radians(20.0)))
    return (BEAMS * times[:, None])[kept & np.isfinite(times)]


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0])
def test_two_walls_of_which_half_is_seen(yaw):
    # The query sees both walls from the origin, in 90 deg of azimuth each. The
    # place is 2 m farther on, and sees of both the part before x = 2.
    query = walls_scan(np.zeros(3), 0.0, False)
    place = np.array([2.0, 0.0, 0.0])
    seen = SeenSurfaces.of(walls_scan(place, yaw, True))
    c, s = np.cos(yaw), np.sin(yaw)
    X = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    there = (query - place) @ X.T
    share = (45.0 + np.degrees(np.arctan(2.0 / 10.0))) / 90.0
    # Beams are a degree apart.
    assert seen.share_of(there) == pytest.approx(share, abs=1.0 / 90.0)
    assert seen.shares_of(there).hidden == pytest.approx(
        1.0 - share, abs=1.5 / 90.0
    )


def room_scan(X_WS, half):
    """Returns a sensor's points on the walls of a room about the origin."""
    d_W = BEAMS @ X_WS[:3, :3].T
    with np.errstate(divide="ignore"):
        times = (np.sign(d_W) * half - X_WS[:3, 3]) / d_W
    return BEAMS * np.where(d_W == 0.0, np.inf, times).min(axis=1)[:, None]


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    """Two drives; the last frame of either is in a larger room."""
    folder = tmp_path_factory.mktemp("rooms")
    drives = []
    for name, places in (
        ("a", [(0.0, 0.0, 0.3), (8.0, 1.0, 2.0), (16.0, 1.0, -1.0)]),
        ("b", [(1.0, -2.0, 1.5), (9.0, 3.0, -2.5), (18.0, 0.0, 0.0)]),
    ):
        X_WBs = [yaw_pose(x, y, 0.0, yaw) for x, y, yaw in places]
        scans = []
        for number, X_WB in enumerate(X_WBs):
            X_WS = X_WB.copy()
            X_WS[2, 3] += 1.6
            half = [40.0, 40.0, 9.0] if number == 2 else [30.0, 20.0, 6.0]
            scans.append(make_scan(room_scan(X_WS, np.array(half))))
        path = write_recording(folder / name, scans, X_WBs)
        drives.append(path)
    return drives


def test_one_room_is_seen_as_a_whole_from_anywhere(rooms):
    protocol = RetrievalProtocol(query_spacing=5.0)
    found = overlap_matrix(*map(open_drive, rooms), protocol)
    assert found.shape == (3, 3)
    # Only parts above or below the other's field of view are missing.
    assert found[:2, :2].min() > 0.85
    assert found[2, 2] > 0.85
    # Its walls are 10 or 20 m behind those of the smaller room.
    assert found[2, :2].max() < 0.05
    assert found[:2, 2].max() < 0.05


def test_a_match_is_what_shows_the_same(rooms, capsys, tmp_path):
    database, query = map(open_drive, rooms)
    method = make_method("solid", {})
    protocol = RetrievalProtocol(overlap=0.5, query_spacing=5.0)
    result = retrieve(database, query, method, protocol)
    expected = [[True, True, False], [True, True, False], [False, False, True]]
    assert result.matches.tolist() == expected
    assert "a match shows 50% of" in protocol.to_text()
    # The limit is itself enough.
    overlaps = result.overlaps
    protocol = RetrievalProtocol(
        overlap=float(overlaps[2, 2]), query_spacing=5.0
    )
    limit = place_outcome(database, query, method, protocol, overlaps=overlaps)
    assert [2, 2] in limit.matches.tolist()
    with pytest.raises(InputError, match="no place of a shows 100% of"):
        place_outcome(
            database,
            query,
            method,
            protocol=RetrievalProtocol(overlap=1.0, query_spacing=5.0),
        )
    output = tmp_path / "overlaps.csv"
    pr = ("pr", *rooms, "--method", "solid", "--query-spacing", "5")
    status, out, _ = run_program(
        capsys, *pr, "--truth", "overlap:0.5", "--overlaps", output, "--json"
    )
    assert status == 0
    assert json.loads(out)["protocol"]["overlap"] == 0.5
    with output.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    np.testing.assert_allclose(
        [float(row["overlap"]) for row in rows],
        result.overlaps.ravel(),
        atol=1e-6,
    )
    for truth in ("overlap", "overlap:0", "overlap:1.01", "overlap:x", "near"):
        assert_refused(capsys, [*pr, "--truth", truth], "--truth", truth)
    assert_refused(capsys, [*pr, "--overlaps", output], "add --truth")
