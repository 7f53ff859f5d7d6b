from helpers.towns import (
    TownDrive,
    drifted,
    make_scans,
    make_town,
    rigid,
    route,
)
import numpy as np

from evaluation.alignment.submaps import Submaps


def make_drive(X_WS=None, number=50):
    X = route(number)
    scans = make_scans(make_town(), X)
    return Submaps(TownDrive("drive", scans, X if X_WS is None else X_WS))


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
