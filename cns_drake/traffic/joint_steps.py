"""The loop over time in which vehicles and walkers are planned together."""

from __future__ import annotations

import numpy as np

from cns_drake.traffic.lane_arrays import LaneArrays
from cns_drake.traffic.lane_changing import change_lanes
from cns_drake.traffic.presence import Presence
from cns_drake.traffic.right_of_way import Permits, grant_ways
from cns_drake.traffic.vehicle_state import (
    Occupants,
    Vehicles,
    find_occupants,
)
from cns_drake.traffic.vehicle_steps import (
    accelerations,
    advance,
    write_poses,
)
from cns_drake.traffic.walker_steps import step_walkers, write_walkers
from cns_drake.traffic.walker_ways import Walkers, WalkwayArrays

# A driver considers a change of lane only at every such step.
_THINKS = 10


def run_steps(
    lanes: LaneArrays,
    vehicles: Vehicles,
    occupants: Occupants,
    presence: Presence,
    permits: Permits,
    ways: WalkwayArrays,
    walkers: Walkers,
    dt: float,
    seed: int,
    vehicle_poses: np.ndarray,
    walker_poses: np.ndarray,
    steps: range,
) -> None:
    """Moves all road users for some of K steps, and stores their poses.

    Args:
        lanes: of the vehicles.
        vehicles: all of them, before the first of the steps.
        occupants: room for their entries.
        presence: of the ego car at K times.
        permits: the users of ways and crossings; none before step 0.
        ways: of the walkers.
        walkers: all of them, before the first of the steps.
        dt: the step [s].
        seed: of draws during the motion.
        vehicle_poses: (K, N, 5) takes x, y, z [m], yaw, pitch [rad].
        walker_poses: (K, M, 5) takes x, y, z [m], yaw, phase [rad].
        steps: numbers of the steps, which follow those made so far.
    """
    for k in steps:
        write_poses(lanes, vehicles, vehicle_poses[k])
        write_walkers(ways, walkers, walker_poses[k])
        find_occupants(occupants, lanes, vehicles, presence, k)
        grant_ways(lanes, vehicles, occupants, presence, permits, k, dt, seed)
        wanted, gaps = accelerations(lanes, vehicles, occupants)
        change_lanes(lanes, vehicles, occupants, presence, k, _THINKS)
        advance(lanes, vehicles, permits, wanted, gaps, dt, seed)
        step_walkers(
            ways, walkers, permits, len(lanes.first), k * dt, dt, seed + 1
        )
