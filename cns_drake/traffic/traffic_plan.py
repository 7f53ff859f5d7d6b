"""Plans the motion of all traffic before a drive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cns_drake.traffic.joint_steps import run_steps
from cns_drake.traffic.lane_arrays import LaneArrays, make_lane_arrays
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.planning_trial import PlanningTrial, WantedBodies
from cns_drake.traffic.presence import EgoBox, Presence, find_presence
from cns_drake.traffic.starting_places import (
    make_permits,
    make_walkway_arrays,
    place_vehicles,
    place_walkers,
    room_for_vehicles,
)
from cns_drake.traffic.tracks import Tracks
from cns_drake.traffic.vehicle_kinds import KINDS, VehicleKind, draw_kinds
from cns_drake.traffic.vehicle_state import make_occupants
from cns_drake.traffic.walker_steps import WALKER_LENGTH, WALKER_WIDTH
from cns_drake.traffic.walkways import Walkway

# The step of planning [s].
STEP = 0.1
# A walker's box, with limbs that swing [m].
WALKER_SIZE = (WALKER_LENGTH, WALKER_WIDTH, 1.8)
# Share of vehicles and walkers that are planned in excess, since some are left
# out; and number of trials.
_SPARE, _TRIES = 0.06, 4
# Steps after which a trial is given up if it has to leave out too many.
_PART = 200

# The ego car's motion: (K,) times -> (K, 2) places [m], (K,) headings [rad].
EgoPath = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class TrafficPlan:
    """The planned motion of vehicles and walkers.

    Attributes:
        kinds: of the N vehicles.
        vehicles: x, y, z of the middle of each box on the ground [m], yaw and
            pitch [rad].
        walkers: x, y, z on the ground [m], yaw and phase of the gait [rad].
        left_out: number of wanted bodies left out because they would collide.
    """

    kinds: tuple[VehicleKind, ...]
    vehicles: Tracks
    walkers: Tracks
    left_out: int = 0


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
) -> TrafficPlan:
    """Plans traffic for a drive; equal arguments give an equal plan.

    Args:
        graph: lanes of the vehicles.
        walkways: of the walkers.
        vehicles, walkers: wanted numbers.
        seed: of all draws.
        duration: of the drive [s].
        ego: the ego car's motion.
        ego_box: its size.

    Returns:
        The plan, without any collisions. It may have fewer bodies than wanted.
    """
    num_steps = int(np.ceil(duration / STEP)) + 2
    xy, yaw = ego(STEP * np.arange(num_steps))
    presence = find_presence(graph, ego_box, xy, yaw, STEP)
    lanes = make_lane_arrays(graph)
    ego_track = _box_track(ego, ego_box, num_steps)
    wanted = WantedBodies(vehicles, walkers)
    best: TrafficPlan | None = None
    for attempt in range(_TRIES):
        rng = np.random.default_rng([seed, attempt])
        best = _try(
            graph,
            lanes,
            walkways,
            presence,
            ego_track,
            ego_box,
            wanted,
            rng,
            best,
        )
        if best.left_out == 0:
            break
    assert best is not None
    return best


def _try(
    graph: LaneGraph,
    lanes: LaneArrays,
    walkways: Sequence[Walkway],
    presence: Presence,
    ego_track: np.ndarray,
    ego_box: EgoBox,
    wanted: WantedBodies,
    rng: np.random.Generator,
    best: TrafficPlan | None,
) -> TrafficPlan:
    """Returns a new plan, or the best so far as soon as that is no worse."""
    number = min(
        _with_spare(wanted.vehicles),
        max(wanted.vehicles, room_for_vehicles(graph)),
    )
    kinds = [KINDS[k] for k in draw_kinds(number, rng)]
    state, found = place_vehicles(kinds, graph, lanes, presence, rng)
    on_foot = place_walkers(_with_spare(wanted.walkers), walkways, rng)
    trial = PlanningTrial(
        [kinds[k] for k in found],
        len(on_foot.speed),
        ego_track,
        ego_box,
        wanted,
    )
    occupants = make_occupants(len(graph.pieces), len(found))
    permits, ways = make_permits(graph), make_walkway_arrays(walkways)
    seed = int(rng.integers(2**31))
    num_steps = len(presence.until)
    for first in range(0, num_steps, _PART):
        steps = range(first, min(first + _PART, num_steps))
        run_steps(
            lanes,
            state,
            occupants,
            presence,
            permits,
            ways,
            on_foot,
            STEP,
            seed,
            trial.vehicles,
            trial.walkers,
            steps,
        )
        trial.look_for_overlaps(steps)
        if best is not None and trial.left_out() >= best.left_out:
            return best
    trial.vehicles[:, :, 3] = np.unwrap(trial.vehicles[:, :, 3], axis=0)
    kept_vehicles, kept_walkers = trial.kept()
    return TrafficPlan(
        tuple(trial.kinds[k] for k in kept_vehicles),
        Tracks(STEP, trial.vehicles).select(np.array(kept_vehicles, int)),
        Tracks(STEP, trial.walkers).select(np.array(kept_walkers, int)),
        trial.left_out(),
    )


def _with_spare(number: int) -> int:
    return int(np.ceil(number * (1 + _SPARE)))


def _box_track(ego: EgoPath, box: EgoBox, num_steps: int) -> np.ndarray:
    """Returns the middle and heading of the ego car's box at half steps."""
    times = STEP / 2 * np.arange(2 * num_steps - 1)
    xy, yaw = ego(times)
    middle = (box.rear + box.front) / 2
    ahead = np.column_stack([np.cos(yaw), np.sin(yaw)])
    return np.column_stack([xy + middle * ahead, yaw])
