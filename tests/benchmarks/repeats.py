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
from scipy.spatial import cKDTree

from cns_drake.motion import pose_at
from cns_drake.scenarios import DrivePlan, RideConfig, Scenario, load_scenario
from evaluation.drives import Drive
from worlds.maps import recordable_drives

# Time between two poses [s].
_PERIOD = 0.1
# Number of pairs of drivers for each shipped route.
_DRIVERS = 2
_COLUMNS = (
    "group", "first", "second", "met", "reverse",
    "offset_50", "offset_90", "offset_99", "over_2m",
    "tilt_50_deg", "tilt_between_50_deg", "tilt_between_95_deg",
)  # fmt: skip
# Distance between two stations along a path [m].
_STATION_SPACING = 5.0
# Two drives meet at a station if they pass within this distance [m].
_MEETING_RADIUS = 12.0
# Distance between two samples of a path, and least distance between two poses
# of it, so that the jitter of a standing receiver does not lengthen it [m].
_PATH_SPACING = 0.25
_LEAST_STEP = 0.2
# Half of the length over which a path's direction is taken [m].
_DIRECTION_REACH = 1.0


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
    offset, reverse = offsets(first.X_WS[:, :3, 3], second.X_WS[:, :3, 3])
    own, lateral, between = _at_stations(first, second)
    up = second.X_WS[:, 2, 2]
    values = {
        "group": group,
        "first": first.name,
        "second": second.name,
        "met": len(offset) + reverse,
        "reverse": reverse / max(len(offset) + reverse, 1),
        "over_2m": np.mean(lateral > 2.0) if own else np.nan,
        "tilt_50_deg": np.degrees(np.median(np.arccos(np.clip(up, -1.0, 1.0)))),
        "tilt_between_50_deg": np.median(between) if own else np.nan,
        "tilt_between_95_deg": np.percentile(between, 95) if own else np.nan,
    }
    for part in (50, 90, 99):
        values[f"offset_{part}"] = (
            np.percentile(offset, part) if len(offset) else np.nan
        )
    return {
        name: f"{value:.3f}" if isinstance(value, float) else value
        for name, value in values.items()
    }


def offsets(p_A: np.ndarray, p_B: np.ndarray) -> tuple[np.ndarray, int]:
    """Compares two paths every 5 m along the first.

    The offset of a station is the distance, across A's direction, of the
    nearest sample of B within 12 m whose direction differs by less than 90 deg.

    Args:
        p_A: (N, 3) positions of the first path.
        p_B: (M, 3) positions of the second path.

    Returns:
        (K,) offsets [m]; number of stations that meet only samples of the
        opposite direction.
    """
    step = round(_STATION_SPACING / _PATH_SPACING)
    stations, tangent = (values[::step] for values in _way(p_A))
    samples, directions = _way(p_B)
    found, reverse = [], 0
    near = cKDTree(samples).query_ball_point(stations, _MEETING_RADIUS)
    for p, ahead, steps in zip(stations, tangent, near, strict=True):
        turns = directions[steps] @ ahead
        same = np.sort(np.array(steps, int)[turns > 0.0])
        if len(same):
            best = np.linalg.norm(samples[same] - p, axis=1).argmin()
            x, y = samples[same[best]] - p
            found.append(abs(ahead[0] * y - ahead[1] * x))
        elif (turns < 0.0).any():
            reverse += 1
    return np.array(found), reverse


def _way(p_W: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns positions (N, 2) along a path, and its directions there."""
    kept = [0]
    for k, p in enumerate(p_W):
        if np.linalg.norm(p - p_W[kept[-1]]) >= _LEAST_STEP:
            kept.append(k)
    corners = p_W[kept]
    step = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    passed = np.concatenate([[0.0], np.cumsum(step)])
    s = np.arange(0.0, passed[-1], _PATH_SPACING)

    def at(s: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(s, passed, c) for c in corners.T[:2]], 1)

    ahead = at(s + _DIRECTION_REACH) - at(s - _DIRECTION_REACH)
    norm = np.linalg.norm(ahead, axis=1, keepdims=True)
    return at(s), ahead / np.maximum(norm, 1e-9)


def _at_stations(
    first: Drive, second: Drive
) -> tuple[int, np.ndarray, np.ndarray]:
    """Compares poses of the second drive with the nearest ones of the first.

    Only pairs within 12 m with the same direction (within 90 deg) count. The
    pose of the first drive is the nearest of its poses, which are up to 3 m
    apart: the offset is measured across the first drive's heading.

    Returns:
        The number of pairs, and for each pair the lateral offset, and the angle
        between the vertical axes of both after the heading is aligned.
    """
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
    return len(X_B), lateral, between


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
    shipped = {name: load_scenario(name) for name in recordable_drives()}
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
