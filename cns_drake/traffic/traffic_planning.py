"""Plans the motion of all traffic before a drive.

This includes the ego car, if it follows other vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cns_drake.motion import Trajectory
from cns_drake.traffic.ego_car import STEP, EgoBox, EgoPath
from cns_drake.traffic.lane_graph import LaneGraph, Walkway
from cns_drake.traffic.streets import make_streets
from cns_drake.traffic.traffic_plan import TrafficPlan
from cns_drake.traffic.traffic_trial import FIRST_STEP, TrafficTask, begin_trial

# Greatest number of plans that are tried.
_TRIES = 4
# After every so many steps, a trial is given up if it has to leave out too many
# bodies.
_PART = 200


def plan_traffic(
    graph: LaneGraph,
    walkways: Sequence[Walkway],
    *,
    vehicles: int,
    walkers: int,
    seed: int,
    duration: float,
    ego: EgoPath,
    ego_box: EgoBox,
    drive: Trajectory | None = None,
) -> TrafficPlan:
    """Plans the traffic of a drive, with the requested numbers if possible.

    Equal arguments give an equal plan. The plan has no collisions, but may have
    fewer vehicles and pedestrians than requested.

    Args:
        graph: lanes and crossings.
        walkways: sidewalks on which pedestrians walk, and crossings.
        vehicles, walkers: requested numbers of vehicles and pedestrians.
        seed: seed of all random choices: kinds, places and routes.
        duration: duration of the drive [s]. If the ego car follows other
            vehicles, this is the longest time that the drive may take.
        ego: function that takes times (K,) [s], and returns positions (K, 2)
            [m] and headings (K,) [rad] of the ego car. If the ego car follows
            other vehicles, only its first position counts.
        ego_box: size of the ego car.
        drive: path and speeds of the ego car if it follows other vehicles;
            otherwise None.
    """
    # Traffic continues after the drive, for a LiDAR that is still turning.
    num_steps = FIRST_STEP + int(np.ceil(duration / STEP)) + 4
    # The ego car stands until its drive begins.
    half_steps = np.arange(2 * num_steps - 1) - 2 * FIRST_STEP
    times = STEP / 2 * np.maximum(half_steps, 0)
    task = TrafficTask(
        graph,
        walkways,
        make_streets(graph, ego_box, *ego(times[::2])),
        ego_box.middles(*ego(times)),
        ego_box,
        vehicles,
        walkers,
        drive,
    )
    if drive is not None:
        # The car blocks its first place at first; after that it is one of the
        # vehicles.
        task.streets.until[1:] = np.inf
    best: TrafficPlan | None = None
    for attempt in range(_TRIES):
        if best is not None and drive is not None and best.positions is None:
            best = None
        best = _better_plan(task, np.random.default_rng([seed, attempt]), best)
        has_arrived = drive is None or best.positions is not None
        if has_arrived and best.left_out == 0:
            break
    assert best is not None
    return best


def _better_plan(
    task: TrafficTask, rng: np.random.Generator, best: TrafficPlan | None
) -> TrafficPlan:
    """Returns the plan of a new trial if better than `best`, or else `best`."""
    trial = begin_trial(task, rng)
    num_steps = len(task.streets.until)
    for first in range(0, num_steps, _PART):
        trial.run(range(first, min(first + _PART, num_steps)))
        if best is not None and trial.left_out() >= best.left_out:
            return best
        if trial.is_over(first + _PART):
            return trial.plan()
    # An ego car that follows others has not arrived in this trial.
    return best if best is not None and task.drive is not None else trial.plan()
