from helpers.towns import (
    TownDrive,
    drifted,
    make_scans,
    make_town,
    rigid,
    route,
)
import numpy as np

from cns_drake.base import from_xyz, poses
from evaluation.alignment.loop_search import Loop
from evaluation.alignment.pose_graph import fit_anchor
from evaluation.alignment.submaps import Submaps


def make_drive(X_WS=None, number=50):
    X = route(number)
    scans = make_scans(make_town(), X)
    return Submaps(TownDrive("drive", scans, X if X_WS is None else X_WS))


def test_keyframes_lie_evenly_along_the_path():
    drive = make_drive()
    assert drive.length > 120.0
    # A short drive has its keyframes closer together than 10 m.
    np.testing.assert_allclose(np.diff(drive.path), 6.1, atol=2.5)
    np.testing.assert_array_equal(drive.X_WK, drive.X_WS[drive.frames])


def test_a_submap_is_consistent():
    """The merged scans of a stretch fit the town as well as one scan."""
    drive = make_drive()
    index = len(drive) // 2
    surface = drive.surface(index)
    points = poses.transform(drive.X_WK[index], surface.points)
    ground = points[np.abs(points[:, 2]) < 0.3]
    assert len(ground) > 1000
    assert np.abs(ground[:, 2]).mean() < 0.02
    one = drive.drive.scan(int(drive.frames[index]))
    assert len(surface.points) > len(one)
    assert np.hypot(*surface.points[:, :2].T).max() < 60.5


def test_a_submap_of_nothing():
    X = route(6)
    few = from_xyz(np.ones((20, 3), dtype=np.float32))
    drive = Submaps(TownDrive("drive", [few] * 6, X))
    assert drive.surface(0) is None
    assert drive.ground_height() == 0.0


def test_ground_height():
    lifted = rigid([0.0, 0.0, 48.7], 20.0) @ route()
    assert abs(make_drive(lifted).ground_height() - 48.7) < 0.05


def test_bending_follows_the_keyframes():
    X = route()
    recorded = drifted(X, scale=1.03, turn_deg=8.0)
    drive = make_drive(recorded)
    # All frames move as one piece.
    Y = rigid([10.0, -5.0, 2.0], 77.0)
    np.testing.assert_allclose(
        drive.bend(Y @ drive.X_WK), Y @ recorded, atol=1e-9
    )
    # With true poses at the keyframes, the frames between are nearly right.
    bent = drive.bend(X[drive.frames])
    np.testing.assert_allclose(bent[drive.frames], X[drive.frames], atol=1e-9)
    inside = slice(0, drive.frames[-1])
    off = np.linalg.norm((bent - X)[inside, :3, 3], axis=1)
    assert off.max() < 0.05
    assert np.linalg.norm((recorded - X)[inside, :3, 3], axis=1).max() > 3.0


def test_an_anchor_is_found_among_wrong_loops():
    rng = np.random.default_rng(9)
    X_SK = route(30)
    X_TS = rigid([30_000.0, -20_000.0, 80.0], -140.0)
    X_TL = X_TS @ route(25, lane=2.0)
    loops = []
    for k in range(30):
        place = int(rng.integers(25))
        X_LK = poses.inverse(X_TL[place]) @ X_TS @ X_SK[k]
        error = rigid(rng.normal(scale=0.02, size=3), rng.normal(scale=0.05))
        if k % 3 == 0:
            error = rigid(rng.uniform(-9, 9, 3), rng.uniform(-20, 20))
        covariance = np.diag([1e-5] * 3 + [1e-2] * 3)
        loops.append(Loop(k, place, X_LK @ error, covariance))
    found = fit_anchor(loops, X_TL, X_SK)
    off = (found @ X_SK - X_TS @ X_SK)[:, :3, 3]
    assert np.linalg.norm(off, axis=1).max() < 0.08
