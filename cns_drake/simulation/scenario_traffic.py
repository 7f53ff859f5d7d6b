"""The traffic of a scenario: its plan, and its structures in the world."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cns_drake.motion import Trajectory
from cns_drake.scenarios import (
    SUMO_INSTEAD,
    DrivePlan,
    Scenario,
    check_files,
    count_frames,
)
from cns_drake.scene import World, geometry_by_structure
from cns_drake.simulation.stage_loading import load_stage
from cns_drake.traffic import (
    EgoBox,
    EgoPath,
    FcdTrace,
    TrafficPlan,
    play_recorded,
    play_trace,
    read_fcd,
    read_recorded,
    traffic_structures,
)
from evaluation.base import InputError, arctan2
from worlds.shapes import (
    GROUND_CLASSES,
    MOVING_IDS,
    GroundSurface,
    Obstacles,
    Way,
)

# Size of the car in `vehicle.sdf`, with mirrors and wheels [m].
_EGO_BOX = EgoBox(rear=-1.05, front=3.75, half_width=1.05)
# The ground is read this far around the places of a trace [m].
_AROUND_TRACE = 20.0


def plan_scenario_traffic(
    scenario: Scenario, trajectory: Trajectory, world: World | None = None
) -> TrafficPlan:
    """Returns the motion of all vehicles and pedestrians of a scenario.

    Args:
        scenario: scenario with traffic.
        trajectory: motion of the scenario's vehicle.
        world: world of the scenario's stage, if already loaded. The world must
            not be part of a diagram yet.

    Raises:
        InputError: the map has no recorded traffic or not so much, or a SUMO
            trace cannot be replayed on this map.

    Example:
        from cns_drake import load_scenario, plan_drive, plan_scenario_traffic

        scenario = load_scenario("metropolis_04").with_traffic(40)
        plan = plan_scenario_traffic(scenario, plan_drive(scenario))
    """
    return plan_traffic_of_drive(DrivePlan(scenario), trajectory, world)


def plan_traffic_of_drive(
    drive: DrivePlan, trajectory: Trajectory, world: World | None = None
) -> TrafficPlan:
    """Returns the motion of all vehicles and pedestrians of a planned drive.

    The other arguments, and the errors, are those of `plan_scenario_traffic`.
    """
    scenario = drive.scenario
    wanted = scenario.traffic
    check_files(scenario)
    ego = _ego_path(trajectory)
    last_frame = (
        count_frames(scenario, trajectory) - 1
    ) * scenario.frame_period
    if wanted.queues:
        from cns_drake.traffic import plan_queues

        assert drive.network is not None
        return plan_queues(
            drive.network,
            seed=wanted.seed,
            duration=trajectory.duration,
            ego=ego,
            ego_box=_EGO_BOX,
        )
    if wanted.fcd is not None:
        from worlds.maps import metres_on_map

        path = Path(wanted.fcd)
        trace = read_fcd(path, lambda: metres_on_map(scenario.folder))
        world = world or load_stage(drive, with_vehicle=False)
        return play_trace(
            trace,
            path,
            _ground_around(world, trace).levels,
            seed=wanted.seed,
            duration=last_frame,
            end=trajectory.duration,
            ego=ego,
            ego_box=_EGO_BOX,
        )
    recorded = recorded_traffic(scenario)
    if last_frame > recorded.vehicles.duration:
        raise InputError(
            f"{scenario.source}: traffic: the recorded traffic of the map takes"
            f" {recorded.vehicles.duration:g} s, but the drive takes"
            f" {last_frame:.2f} s: lower frames, or {SUMO_INSTEAD}"
        )
    return play_recorded(
        recorded,
        vehicles=wanted.vehicles,
        walkers=wanted.walkers,
        seed=wanted.seed,
        duration=trajectory.duration,
        ego=ego,
        ego_box=_EGO_BOX,
    )


def recorded_traffic(scenario: Scenario) -> TrafficPlan:
    """Returns the recorded traffic of a scenario's map.

    Raises:
        InputError: the file cannot be used, or has too little traffic for the
            scenario.
    """
    recorded = read_recorded(scenario.folder.traffic)
    there = len(recorded.kinds), recorded.walkers.values.shape[1]
    for who, most in zip(("vehicles", "walkers"), there, strict=True):
        wanted = getattr(scenario.traffic, who)
        if wanted > most:
            raise InputError(
                f"{scenario.source}: traffic: {who}: {wanted} are too many; the"
                f" recorded traffic of the map has {most}: {SUMO_INSTEAD}"
            )
    return recorded


def _ego_path(trajectory: Trajectory) -> EgoPath:
    """Returns a function that computes the car's poses at times (N,) [s].

    The poses are positions (N, 2) [m] and yaws (N,) [rad] in the world. After
    the end of the trajectory, the car stays where it is.
    """

    def ego(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        R_WB, p_WB = trajectory.poses(np.minimum(t, trajectory.duration))
        return p_WB[:, :2], np.unwrap(arctan2(R_WB[:, 1, 0], R_WB[:, 0, 0]))

    return ego


def _ground_around(world: World, trace: FcdTrace) -> GroundSurface:
    """Returns the ground of a world around the places of a trace."""
    places = np.concatenate(
        [one.xy for one in (*trace.vehicles, *trace.persons)]
    )
    ground = geometry_by_structure(
        world,
        lambda name: world.structures[name].semantic_class in GROUND_CLASSES,
    )
    return GroundSurface.around(ground, places, _AROUND_TRACE)


def things_in_the_way(
    scenario: Scenario, world: World, plan: TrafficPlan
) -> list[str]:
    """Returns the parked vehicles through which the traffic of a trace drives.

    They stand in lanes of narrow streets of imported cities. Those that the
    scenario's temporary changes have put there are left out.

    Args:
        scenario: the scenario.
        world: the world of its stage, which is not part of a diagram yet.
        plan: the traffic.
    """
    if scenario.traffic.fcd is None:
        return []
    parked = geometry_by_structure(
        world,
        lambda name: (
            world.structures[name].semantic_class in MOVING_IDS
            and not world.structures[name].causes
        ),
    )
    feet = Obstacles((name, one.footprint) for name, one in parked.items())
    met = set()
    for kind, rows in zip(
        plan.kinds, np.moveaxis(plan.vehicles.values, 1, 0), strict=True
    ):
        met |= feet.touched_by(Way(rows[:, :2]).area(kind.size[1] / 2))
    return sorted(met)


def with_traffic(
    world: World, plan: TrafficPlan, in_the_way: Sequence[str] = ()
) -> World:
    """Returns a world whose structure table and notes include the traffic.

    Args:
        world: the world.
        plan: the traffic.
        in_the_way: names of structures that are left out for it.

    Raises:
        InputError: there are more structures than ids.
    """
    table = world.structures
    entries = traffic_structures(plan, table.last_instance + 1)
    notes = world.notes + plan.notes
    if plan.left_out:
        notes += (
            f"traffic: {plan.left_out} left out: they would have met the car",
        )
    if in_the_way:
        notes += (f"traffic: {len(in_the_way)} things in its way left out",)
    return replace(world, structures=table.joined(entries), notes=notes)
