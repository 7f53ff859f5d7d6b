"""Simulated scans for `real_or_simulated.py`, as the notes describe them.

    python tests/benchmarks/scans_to_judge.py OUT [--scans N]
        [--drive NAME ...] [--roadsides VALUE]

Writes N scans of each drive, evenly over its time, into folders of their own:
`hdl-64e` with calibrated returns, 1.73 m above the ground, among 60 vehicles on
ride A, on roads that fall to the right by 3 %. The motion of the car during a
turn is undone, as in KITTI's scans.

With --roadsides, this field of `transient` puts cars, hedges and garages beside
the way. It shows how much of what a classifier sees is what stands in a city,
and not how it is measured.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.base import encode_bin
from cns_drake.motion import Trajectory
from cns_drake.scenarios import (
    DrivePlan,
    Scenario,
    load_scenario,
    make_scenario,
)
from cns_drake.simulation import load_drive, make_station

DRIVES = ("riverside_02", "metropolis_04", "suburbia_02")
# Duration of a turn of the unit [s].
_PERIOD = 0.1
# Number of steps of the poses during a turn.
_STEPS = 10
# As of the road of KITTI's first place.
_CROSSFALL = 0.03


def judged(name: str, roadsides: float) -> Scenario:
    """Returns the scenario of a drive whose scans are judged."""
    own = load_scenario(name).model_dump(mode="json", exclude_none=True)
    key, lidar = next(iter(own["lidars"].items()))
    lidar |= {
        "preset": "hdl-64e",
        "rate": round(1.0 / _PERIOD),
        "returns": "calibrated",
        "columns": 2156,
        "xyz": [0.0, 0.0, 1.73],
        "motion_distortion": True,
    }
    for field in ("min_range", "max_range"):
        lidar.pop(field, None)
    own["lidars"] = {key: lidar}
    own.setdefault("traffic", {})["vehicles"] = 60
    own["ride"] = {"roughness": "A", "crossfall": _CROSSFALL}
    if roadsides > 0.0:
        own["transient"] = {"roadsides": roadsides}
    return make_scenario(own, name)


def undistorted(
    scan: np.ndarray, trajectory: Trajectory, X_BS: RigidTransform, begin: float
) -> np.ndarray:
    """Returns a scan as if it was taken in the middle of its turn.

    The turn begins at a time [s]; between steps, points are interpolated.
    """
    times = begin + np.linspace(0.0, _PERIOD, _STEPS + 1)
    X_SW = (trajectory.pose(begin + _PERIOD / 2) @ X_BS).inverse()
    X_SSs = np.array(
        [(X_SW @ trajectory.pose(t) @ X_BS).GetAsMatrix4() for t in times]
    )
    part = scan["t"] * 1e-9 / _PERIOD * _STEPS
    step = np.clip(part.astype(int), 0, _STEPS - 1)
    part = (part - step)[:, None]
    p = np.stack([scan[axis] for axis in "xyz"], axis=1).astype(float)
    before, after = (
        np.einsum("nij,nj->ni", X_SSs[k, :3, :3], p) + X_SSs[k, :3, 3]
        for k in (step, step + 1)
    )
    result = scan.copy()
    moved = (1.0 - part) * before + part * after
    for axis, values in zip("xyz", moved.T, strict=True):
        result[axis] = values
    return result


def write_scans(name: str, out: Path, number: int, roadsides: float) -> None:
    """Writes scans of a drive, ring by ring as KITTI's."""
    scenario = judged(name, roadsides)
    loaded = load_drive(DrivePlan(scenario))
    trajectory = loaded.trajectory
    diagram = make_station(loaded)
    context = diagram.CreateDefaultContext()
    key, X_BS = next(iter(loaded.X_BSs.items()))
    for part in np.linspace(0.1, 0.9, number):
        frame = round(part * loaded.num_frames)
        print(f"{name}: frame {frame}", file=sys.stderr)
        context.SetTime(frame * _PERIOD)
        scan = diagram.GetOutputPort(f"{key}_scan").Eval(context)
        scan = undistorted(scan, trajectory, X_BS, frame * _PERIOD)
        azimuth = np.arctan2(scan["y"], scan["x"]) % (2.0 * np.pi)
        folder = out / f"{name}_{frame:05d}"
        folder.mkdir(parents=True)
        ordered = scan[np.lexsort((azimuth, scan["ring"]))]
        (folder / "000000.bin").write_bytes(encode_bin(ordered))


def main() -> None:
    """Runs the program."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--scans", type=int, default=7)
    parser.add_argument("--drive", action="append")
    parser.add_argument("--roadsides", type=float, default=0.0)
    options = parser.parse_args()
    for name in options.drive or DRIVES:
        write_scans(name, options.out, options.scans, options.roadsides)


if __name__ == "__main__":
    main()
