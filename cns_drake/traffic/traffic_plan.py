"""Plans the motion of all traffic before a drive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cns_drake.traffic.joint_steps import run_steps
from cns_drake.traffic.lane_arrays import LaneArrays, make_lane_arrays
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.overlaps import find_overlaps, whom_to_leave_out
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
# Boxes keep this distance, since they are compared only now and then [m].
_APART = 0.1
# Share of vehicles and walkers that are planned in excess, since some are left
# out; and number of trials.
_SPARE, _TRIES = 0.06, 4

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
    best: TrafficPlan | None = None
    for attempt in range(_TRIES):
        rng = np.random.default_rng([seed, attempt])
        with_spare = int(np.ceil(vehicles * (1 + _SPARE)))
        room = room_for_vehicles(graph)
        number = min(with_spare, max(vehicles, room))
        kinds = [KINDS[k] for k in draw_kinds(number, rng)]
        plan = _try(
            graph,
            lanes,
            walkways,
            presence,
            kinds,
            int(np.ceil(walkers * (1 + _SPARE))),
            rng,
        )
        plan = _without_overlaps(plan, ego_track, ego_box, vehicles, walkers)
        if best is None or plan.left_out < best.left_out:
            best = plan
        if best.left_out == 0:
            break
    assert best is not None
    return best


def _try(
    graph: LaneGraph,
    lanes: LaneArrays,
    walkways: Sequence[Walkway],
    presence: Presence,
    kinds: Sequence[VehicleKind],
    walkers: int,
    rng: np.random.Generator,
) -> TrafficPlan:
    state, found = place_vehicles(kinds, graph, lanes, presence, rng)
    on_foot = place_walkers(walkers, walkways, rng)
    num_steps = len(presence.until)
    vehicle_poses = np.zeros((num_steps, len(found), 5))
    walker_poses = np.zeros((num_steps, len(on_foot.speed), 5))
    run_steps(
        lanes,
        state,
        make_occupants(len(graph.pieces), len(found)),
        presence,
        make_permits(graph),
        make_walkway_arrays(walkways),
        on_foot,
        STEP,
        int(rng.integers(2**31)),
        vehicle_poses,
        walker_poses,
    )
    vehicle_poses[:, :, 3] = np.unwrap(vehicle_poses[:, :, 3], axis=0)
    return TrafficPlan(
        tuple(kinds[k] for k in found),
        Tracks(STEP, vehicle_poses),
        Tracks(STEP, walker_poses),
    )


def _box_track(ego: EgoPath, box: EgoBox, num_steps: int) -> np.ndarray:
    """Returns the middle and heading of the ego car's box at half steps."""
    times = STEP / 2 * np.arange(2 * num_steps - 1)
    xy, yaw = ego(times)
    middle = (box.rear + box.front) / 2
    ahead = np.column_stack([np.cos(yaw), np.sin(yaw)])
    return np.column_stack([xy + middle * ahead, yaw])


def _without_overlaps(
    plan: TrafficPlan,
    ego_track: np.ndarray,
    ego_box: EgoBox,
    vehicles: int,
    walkers: int,
) -> TrafficPlan:
    """Returns a plan without bodies that would collide, or exceed the number.

    Args:
        plan: to thin out.
        ego_track: (2 K - 1, 3) of the ego car, at half steps.
        ego_box: its size.
        vehicles, walkers: wanted numbers.
    """
    num = len(plan.kinds)
    num_walkers = plan.walkers.values.shape[1]
    poses = np.concatenate(
        [
            ego_track[:, None],
            _at_half_steps(plan.vehicles.values)[:, :, [0, 1, 3]],
            _at_half_steps(plan.walkers.values)[:, :, [0, 1, 3]],
        ],
        axis=1,
    )
    half = np.array(
        [
            ((ego_box.front - ego_box.rear) / 2, ego_box.half_width),
            *((k.size[0] / 2, k.size[1] / 2) for k in plan.kinds),
            *([(WALKER_LENGTH / 2, WALKER_WIDTH / 2)] * num_walkers),
        ]
    )
    overlaps = np.zeros((len(half), len(half)), bool)
    find_overlaps(poses, half + _APART / 2, overlaps)
    out = set(whom_to_leave_out(overlaps, 1))
    kept = [k for k in range(num) if k + 1 not in out][:vehicles]
    walking = [k for k in range(num_walkers) if k + 1 + num not in out]
    walking = walking[:walkers]
    return TrafficPlan(
        tuple(plan.kinds[k] for k in kept),
        plan.vehicles.select(np.array(kept, int)),
        plan.walkers.select(np.array(walking, int)),
        vehicles - len(kept) + walkers - len(walking),
    )


def _at_half_steps(values: np.ndarray) -> np.ndarray:
    """Returns the values (2 K - 1, N, D) of tracks at and between K times."""
    result = np.empty((2 * len(values) - 1, *values.shape[1:]))
    result[::2] = values
    result[1::2] = (values[1:] + values[:-1]) / 2
    return result
