"""Vehicles that stand in queues in all lanes between junctions."""

from collections.abc import Sequence

import numpy as np

from cns_drake.traffic.ego_car import STEP, EgoBox, EgoPath
from cns_drake.traffic.traffic_plan import (
    KINDS,
    Tracks,
    TrafficPlan,
    VehicleKind,
)
from evaluation.base import arcsin, arctan2
from worlds.roads import RoadNetwork, lanes_between_stop_lines
from worlds.shapes import Way, close_pairs

# Least and greatest gap between vehicles in a queue [m].
_GAPS = (1.5, 3.5)
# Least distance of a vehicle from the ego car that passes it [m].
_LETS_PASS = 0.4


def plan_queues(
    network: RoadNetwork,
    *,
    seed: int,
    duration: float,
    ego: EgoPath,
    ego_box: EgoBox,
) -> TrafficPlan:
    """Plans vehicles that stand in queues in all lanes between junctions.

    A vehicle is absent while the ego car is at the vehicle's place.

    Args:
        network: the roads.
        seed: seed by which kinds of vehicles, and gaps between them, are
            sampled.
        duration: duration of the drive [s].
        ego: function that takes times (K,) [s], and returns positions (K, 2)
            [m] and headings (K,) [rad] of the ego car.
        ego_box: the rectangle on the ground that the ego car covers.
    """
    rng = np.random.default_rng(seed)
    shares = np.array([kind.share for kind in KINDS])
    shares /= shares.sum()
    kinds, rows = [], []
    for lane in map(Way, lanes_between_stop_lines(network)):
        end = lane.length - float(rng.uniform(*_GAPS))
        while True:
            kind = KINDS[int(rng.choice(len(KINDS), size=1, p=shares)[0])]
            begin = end - kind.size[0]
            if begin < 0.0:
                break
            # Both axles stand on the lane; slopes are assumed to be small.
            rear, front = (
                lane.at(begin + kind.size[0] / 2 + axle) for axle in kind.axles
            )
            middle = rear + (front - rear) * (
                -kind.axles[0] / (kind.axles[1] - kind.axles[0])
            )
            x, y, z = (front - rear) / np.linalg.norm(front - rear)
            kinds.append(kind)
            rows.append([*middle, float(arctan2(y, x)), -float(arcsin(z))])
            end = begin - float(rng.uniform(*_GAPS))
    places = np.array(rows).reshape(-1, 5)
    times = np.arange(0.0, duration + 2 * STEP, STEP)
    present = ~_passed(kinds, places, ego_box.corners(*ego(times)))
    tracks = Tracks(STEP, np.tile(places, (len(times), 1, 1)), present)
    walkers = Tracks(STEP, np.zeros((len(times), 0, 5)))
    return TrafficPlan(tuple(kinds), tracks, walkers)


def _passed(
    kinds: Sequence[VehicleKind], places: np.ndarray, corners: np.ndarray
) -> np.ndarray:
    """Returns which vehicles the ego car passes at each step, (K, N) bool.

    Args:
        kinds: kinds of the N vehicles.
        places: (N, 5) places of the vehicles, as in `TrafficPlan.vehicles`.
        corners: (K, 4, 2) corners of the ego car's box at each step [m].
    """
    boxes = [
        EgoBox(-kind.size[0] / 2, kind.size[0] / 2, kind.size[1] / 2).corners(
            row[None, :2], row[3:4]
        )[0]
        for kind, row in zip(kinds, places, strict=True)
    ]
    step, near = close_pairs(
        corners, np.array(boxes).reshape(-1, 4, 2), _LETS_PASS
    )
    passed = np.zeros((len(corners), len(kinds)), bool)
    # A vehicle does not disappear during a revolution of a LiDAR. The margin of
    # one step keeps the vehicle absent in revolutions that begin before the
    # pass, or end after it.
    for shift in (-1, 0, 1):
        passed[np.clip(step + shift, 0, len(corners) - 1), near] = True
    return passed
