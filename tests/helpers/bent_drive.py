"""A small recording with distinct places and numbers."""

import numpy as np

from helpers.drive_files import make_scan, write_recording, yaw_pose

# Poses in the world and on the vehicle without equal or trivial numbers.
P_BS = (0.3, -0.2, 1.7)
QUAT_BS = (0.0, np.sin(0.1), 0.0, np.cos(0.1))
NUM_SCANS = 5


def write_drive(folder, **options):
    """Records a few random scans along a bend; returns the folder."""
    rng = np.random.default_rng(7)
    scans = []
    for i in range(NUM_SCANS):
        # A scan may have no point.
        scan = make_scan(rng.uniform(-90.0, 90.0, (0 if i == 3 else 60, 3)))
        scan["intensity"] = rng.uniform(0.0, 1.0, len(scan))
        scan["label"] = rng.integers(0, 256, len(scan))
        scan["instance"] = rng.integers(0, 65536, len(scan))
        scans.append(scan)
    X_WBs = [
        yaw_pose(150.0 + 3.0 * i, -40.0 + i * i, 0.5, 2.0 + 0.3 * i)
        for i in range(NUM_SCANS)
    ]
    attachments = {
        "scenario.json": {"map": "town", "stage": "02", "name": folder.name},
        "structures.json": [
            {"instance": 3, "name": "tower", "class": "building", "label": 50}
        ],
    }
    write_recording(
        folder,
        scans,
        X_WBs,
        **{
            "p_BS": P_BS,
            "quat_xyzw_BS": QUAT_BS,
            "attachments": attachments,
            **options,
        },
    )
    return folder
