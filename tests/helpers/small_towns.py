"""Recordings of a small town at two stages, on two lanes of one street."""

import numpy as np

from helpers.drive_files import make_scan, write_recording, yaw_pose

ROUTES = {"a": {"lanes": [1]}, "b": {"lanes": [2]}, "c": {"lanes": [2, 1]}}


def make_town(stage):
    """Points on the ground and on six houses; stage 01 has every other."""
    rng = np.random.default_rng(3)
    ground = rng.uniform([-40, -40], [120, 40], (4000, 2))
    parts = [np.c_[ground, np.zeros(4000)]]
    for block in range(6):
        box = rng.uniform(size=(500, 3)) * [12.0, 10.0, 20.0]
        box += np.array([-30.0 + 25.0 * block, 15.0, 0.0])
        if stage != "01" or block % 2:
            parts.append(box)
    return np.concatenate(parts)


def drive(folder, stage, route, *, city="metropolis", scenario=True, more=None):
    """Writes a drive of 80 m along the street.

    Its scenario may have more fields.
    """
    points = make_town(stage)
    scans, X_WBs = [], []
    for i in range(9):
        X_WB = yaw_pose(10.0 * i, 2.0 if route == "a" else -2.0, 0.0, 0.05)
        p = (points - X_WB[:3, 3]) @ X_WB[:3, :3]
        near = p[np.linalg.norm(p, axis=1) < 60.0]
        scans.append(make_scan(near - [0.0, 0.0, 1.6]))
        X_WBs.append(X_WB)
    said = {"map": city, "stage": stage, "route": ROUTES[route]}
    attachments = {"scenario.json": said | (more or {})}
    write_recording(
        folder, scans, X_WBs, attachments=attachments if scenario else None
    )
