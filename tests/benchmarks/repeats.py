"""How far apart the drives of one route are: ours, and those of Boreas.

    python tests/benchmarks/repeats.py [--poses FOLDER] [--output FILE]

Compares the shipped drives of each city with each other, drives with
`driver: real`, and drives with `ride`, and writes a table. With --poses, the
table begins with sessions of a data set: text files with a time [us] and a
pose (4x4, row by row) in each line, such as the six `lidar_frames.txt` of
Boreas in the public repository Weixin-Ma/PR_Evaluation_Project, each saved
under the name of its session. Only planned motions are compared; no scan is
simulated.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import csv
from itertools import combinations
from pathlib import Path
import sys

import numpy as np

from cns_drake.drives import Drive
from cns_drake.motion import pose_at
from cns_drake.scenarios import (
    DrivePlan,
    RideConfig,
    Scenario,
    load_scenario,
    shipped_drives,
)
from evaluation import compare_drives

# Time between two poses [s].
_PERIOD = 0.1
# Number of pairs of drivers for each shipped route.
_DRIVERS = 2
_COLUMNS = (
    "group", "first", "second", "stations", "met", "reverse",
    "offset_50", "offset_90", "offset_99", "over_2m", "other_lane",
    "heading_spread_deg", "height_50", "height_5", "height_95",
    "tilt_50_deg", "tilt_95_deg", "tilt_spread_deg", "tilt_between_50_deg",
    "tilt_between_95_deg", "speed_10", "speed_50", "speed_90", "standing",
)  # fmt: skip


class _Poses(Drive):
    """A drive without scans."""

    def __init__(self, name: str, stamps_ns: np.ndarray, X_WS: np.ndarray):
        self.name = name
        self.world_frame = "map"
        self._stamps_ns = stamps_ns
        self._X_WS = X_WS

    def __len__(self) -> int:
        return len(self._stamps_ns)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._stamps_ns

    @property
    def X_WS(self) -> np.ndarray:
        return self._X_WS

    def scan(self, index: int) -> np.ndarray:
        raise NotImplementedError


def read_poses(file: Path) -> _Poses:
    """Returns the drive of a file of times [us] and poses."""
    rows = [line.split() for line in file.read_text().splitlines()]
    stamps_ns = np.array([int(row[0]) * 1000 for row in rows])
    X_WS = np.array([row[1:17] for row in rows], float).reshape(-1, 4, 4)
    return _Poses(file.stem, stamps_ns, X_WS)


def planned(scenario: Scenario, name: str) -> _Poses:
    """Returns the motion of base_link, at the height of the LiDAR."""
    trajectory = DrivePlan(scenario).trajectory
    times = np.arange(0.0, trajectory.duration, _PERIOD)
    moments = trajectory.at(times)
    X_WB = np.array(
        [pose_at(moments, k).GetAsMatrix4() for k in range(len(times))]
    )
    X_BS = np.eye(4)
    X_BS[2, 3] = 1.8
    return _Poses(name, np.int64(times * 1e9), X_WB @ X_BS)


def compared(group: str, first: Drive, second: Drive) -> dict:
    """Returns a row of the table: how the second differs from the first."""
    found = compare_drives(first, second)
    own, lateral, height, between = _at_stations(first, second)
    up = second.X_WS[:, 2, :3]
    tilt = np.degrees(np.arccos(np.clip(up[:, 2], -1.0, 1.0)))
    spread = np.hypot(
        found.second.roll_spread_deg, found.second.pitch_spread_deg
    )
    values = {
        "group": group,
        "first": first.name,
        "second": second.name,
        "stations": found.num_stops,
        "met": found.num_met,
        "reverse": found.reverse,
        "offset_50": found.offset_50,
        "offset_90": found.offset_90,
        "offset_99": found.offset_99,
        "over_2m": np.mean(lateral > 2.0) if own else np.nan,
        "other_lane": found.other_lane,
        "heading_spread_deg": found.heading_spread_deg,
        "height_50": np.median(height) if own else np.nan,
        "height_5": found.height_5,
        "height_95": found.height_95,
        "tilt_50_deg": np.median(tilt),
        "tilt_95_deg": np.percentile(tilt, 95),
        "tilt_spread_deg": spread,
        "tilt_between_50_deg": np.median(between) if own else np.nan,
        "tilt_between_95_deg": np.percentile(between, 95) if own else np.nan,
        "speed_10": found.second.speed_10,
        "speed_50": found.second.speed_50,
        "speed_90": found.second.speed_90,
        "standing": found.second.standing,
    }
    return {
        name: f"{value:.3f}" if isinstance(value, float) else value
        for name, value in values.items()
    }


def _at_stations(
    first: Drive, second: Drive
) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
    """Compares poses of the second drive with the nearest ones of the first.

    Only pairs within 12 m with the same direction (within 90 deg) count. The
    pose of the first drive is the nearest of its poses, which are up to 3 m
    apart: the offset is measured across the first drive's heading.

    Returns:
        The number of pairs, and for each pair the lateral offset, the height
        of the second over the first, and the angle between the vertical axes
        of both after the heading is aligned.
    """
    from scipy.spatial import cKDTree

    X_A, X_B = first.X_WS, second.X_WS
    step = np.linalg.norm(np.diff(X_B[:, :3, 3], axis=0), axis=1)
    passed = np.concatenate([[0.0], np.cumsum(step)])
    kept = np.searchsorted(passed, np.arange(0.0, passed[-1], 5.0))
    X_B = X_B[kept]
    distance, index = cKDTree(X_A[:, :2, 3]).query(X_B[:, :2, 3], 20)
    ahead_A = _ahead(first.X_WS)[index]
    ahead_B = _ahead(second.X_WS)[kept]
    same = np.einsum("ijk,ik->ij", ahead_A, ahead_B) > 0.0
    distance = np.where(same, distance, np.inf)
    best = np.argmin(distance, axis=1)
    rows = np.arange(len(kept))
    met = distance[rows, best] < 12.0
    index, X_B = index[rows, best][met], X_B[met]
    X_A = X_A[index]
    delta = X_B[:, :3, 3] - X_A[:, :3, 3]
    ahead = _ahead(first.X_WS)[index]
    lateral = np.abs(ahead[:, 0] * delta[:, 1] - ahead[:, 1] * delta[:, 0])
    # The vertical of W in each sensor frame, which the heading leaves alone
    # as long as both sensors are mounted alike.
    cosine = np.einsum("ij,ij->i", X_A[:, 2, :3], X_B[:, 2, :3])
    between = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return len(X_B), lateral, delta[:, 2], between


def _ahead(X_WS: np.ndarray) -> np.ndarray:
    """Returns the horizontal direction of travel at each pose, (N, 2)."""
    p = X_WS[:, :2, 3]
    ahead = np.gradient(p, axis=0)
    moving = np.linalg.norm(ahead, axis=1) > 0.05
    # A standing car keeps its last direction.
    last = np.maximum.accumulate(np.where(moving, np.arange(len(p)), 0))
    ahead = ahead[last]
    return ahead / np.maximum(
        np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9
    )


def rows(poses: Path | None) -> Iterator[dict]:
    """Yields all rows of the table."""
    if poses is not None:
        sessions = [read_poses(file) for file in sorted(poses.glob("*.txt"))]
        for later in sessions[1:]:
            yield compared("Boreas", sessions[0], later)
    shipped = {name: load_scenario(name) for name in shipped_drives()}
    ways = {name: planned(own, name) for name, own in shipped.items()}
    for first, second in combinations(ways, 2):
        if shipped[first].map == shipped[second].map:
            yield compared("shipped", ways[first], ways[second])
    for name, own in shipped.items():
        for seed in range(_DRIVERS):
            # The car in the middle of its lane as well: `aside` would be an
            # offset of the route.
            real = own.with_driver("real").replaced(aside=0.0)
            drives = [
                planned(
                    real.replaced(driver=real.driver.replaced(seed=s)),
                    f"{name}_driver_{s}",
                )
                for s in (2 * seed, 2 * seed + 1)
            ]
            yield compared("driver real", *drives)
    own = shipped["suburbia_02"]
    for kind in "ABCDE":
        drives = [
            planned(
                own.replaced(
                    driver=own.driver.replaced(wander=0.35, seed=seed),
                    ride=RideConfig(roughness=kind),
                ),
                f"suburbia_02_ride_{kind}_{seed}",
            )
            for seed in (1, 2)
        ]
        yield compared(f"ride {kind}", *drives)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=Path)
    parser.add_argument("--output", type=Path)
    given = parser.parse_args()
    file = sys.stdout if given.output is None else given.output.open("w")
    writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    for row in rows(given.poses):
        writer.writerow(row)
        file.flush()


if __name__ == "__main__":
    main()
