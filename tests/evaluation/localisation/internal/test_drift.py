"""Tracking of a drive through a map, against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evaluation.base import from_xyz, poses
from evaluation.drives import travelled
from evaluation.localisation import (
    Localiser,
    Settings,
    Starts,
    localised,
    map_of,
    track_drive,
)
from evaluation.localisation.estimators import Estimate
from evaluation.localisation.tracking import drifting_steps
from evaluation.recognition import numbers_of

MOUNT = Rotation.from_euler("ZYX", [130.0, 20.0, -8.0], degrees=True)
CLOUD = np.random.default_rng(1).uniform(-20.0, 20.0, (400, 3))


class Line:
    """A drive of N scans, 2 m apart, along a curve, with a tilted LiDAR."""

    name = "line"

    def __init__(self, number):
        heading = 0.002 * np.arange(number)
        steps = 2.001 * np.stack(
            [np.cos(heading), np.sin(heading), np.zeros(number)], axis=1
        )
        p_WS = np.cumsum(steps, axis=0)
        yaw = Rotation.from_euler("z", heading[:, None])
        self.X_WS = poses.make_pose((yaw * MOUNT).as_matrix(), p_WS)
        self.stamps_ns = np.arange(number)

    def __len__(self):
        return len(self.X_WS)

    def scan(self, index):
        return from_xyz(CLOUD)


def follow(line, estimator, drift=0.0, mapped=None, starts=None):
    place = map_of(CLOUD, "map", Settings.neighbours)
    found = Localiser(place, estimator, Settings())
    mapped = np.ones(len(line), bool) if mapped is None else mapped
    starts = Starts(0.5, 0.0) if starts is None else starts
    return track_drive(found, line, mapped, starts, drift)


def values_of(rows):
    numbers = numbers_of("localise", localised(rows))
    return {one.metric: one.value for one in numbers}


def test_drift_in_closed_form():
    # Over one stretch of 100 m: all lengths wrong by a, a turn of b deg/m.
    X_WS = np.tile(np.eye(4), (49, 1, 1))
    X_WS[:, :3, :3] = MOUNT.as_matrix()
    X_WS[:, 0, 3] = 2.0 * np.arange(49)
    way = travelled(X_WS[:, :3, 3])
    a, b = 0.01 * np.random.default_rng([4, 5]).normal(size=2)
    pose = X_WS[0]
    for step in drifting_steps(X_WS, way, 0.01, 4):
        pose = pose @ step
    headings = np.radians(b * 2.0 * np.arange(1, 49))
    expected = 2.0 * (1.0 + a) * np.stack([np.cos(headings), np.sin(headings)])
    assert pose[:2, 3] == pytest.approx(expected.sum(axis=1))
    assert pose[2, 3] == pytest.approx(0.0, abs=1e-9)
    turned = Rotation.from_matrix(pose[:3, :3] @ MOUNT.inv().as_matrix())
    assert turned.as_euler("ZYX") == pytest.approx([headings[-1], 0, 0])
    exact = drifting_steps(X_WS, way, 0.0, 4)
    assert np.allclose(exact, poses.inverse(X_WS[:-1]) @ X_WS[1:])


def test_losses_and_returns():
    line = Line(100)
    # Far off at scans 20 to 24 and from 90 on; no pose at 50.
    calls = iter(range(100))

    def wavering(place, scan, measured, start):
        k = next(calls)
        X_WS = line.X_WS[k].copy()
        if 20 <= k < 25 or k >= 90:
            X_WS[2, 3] += 2.1
        return Estimate(None if k == 50 else X_WS, 1.0)

    rows = follow(line, wavering)
    # The odometry's error is none of a result.
    assert rows["track_error"][50] == pytest.approx(0.0, abs=1e-9)
    assert np.flatnonzero(np.isnan(rows["translation_error"])).tolist() == [50]
    (one, two), values = localised(rows).lost, values_of(rows)
    assert values["without_pose"] == 1
    assert one == (pytest.approx(10.0, abs=0.02), True)
    assert two == (pytest.approx(18.0, abs=0.02), False)
    assert values["losses"] == 2
    assert values["lost_for_good"] == 1
    assert values["lost_per_km"] == pytest.approx(2.0 / 0.198, rel=1e-3)
    assert values["back_after_median"] == pytest.approx(10.0, abs=0.02)
    assert values["within_03m"] == pytest.approx(84.0 / 99.0, rel=1e-3)
