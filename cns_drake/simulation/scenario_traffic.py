"""The traffic of a scenario: its plan, and its structures in the world."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from shapely.geometry.base import BaseGeometry

from cns_drake.base import InputError, arctan2
from cns_drake.motion import Trajectory
from cns_drake.recording import FRAME_PERIOD
from cns_drake.roads import RoadNetwork, load_road_network
from cns_drake.scenarios import DrivePlan, Scenario, TrafficConfig, count_frames
from cns_drake.scene import GROUND_CLASSES, MapFolder, World
from cns_drake.simulation.stage_loading import load_stage
from cns_drake.traffic import (
    EgoBox,
    EgoPath,
    LaneFile,
    LaneGraph,
    TrafficPlan,
    Walkway,
    kept_clear,
    make_lane_graph,
    make_walkways,
    plan_queues,
    plan_traffic,
    play_trace,
    read_fcd,
    read_lanes,
    room_for_vehicles,
    room_for_walkers,
    traffic_structures,
    with_unmarked_crossings,
)
from cns_drake.transient import geometry_by_structure

# Size of the car in worlds/vehicle.sdf, with mirrors and wheels [m].
EGO_BOX = EgoBox(rear=-1.05, front=3.75, half_width=1.05)
# A car that follows others takes at most this multiple of the time that it
# would need alone, plus a wait.
_SLOWEST_RATIO = 6.0
# This wait [s].
_LONGEST_WAIT = 600.0


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
        InputError: the map has no roads or sidewalks, or no room for that many
            vehicles or pedestrians, or a SUMO trace cannot be replayed on this
            map.

    Example:
        from cns_drake import load_scenario, plan_drive, plan_scenario_traffic

        scenario = load_scenario("metropolis_04").with_traffic(60)
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
    graph, walkways, _ = load_ways(scenario.folder, drive.network)
    ego = _ego_path(trajectory)
    if wanted.fcd is not None:
        trace = Path(wanted.fcd)
        num_frames = count_frames(scenario, trajectory)
        return play_trace(
            read_fcd(trace),
            trace,
            graph,
            walkways,
            seed=wanted.seed,
            duration=(num_frames - 1) * scenario.frame_period,
            end=trajectory.duration,
            ego=ego,
            ego_box=EGO_BOX,
        )
    if wanted.queues:
        return plan_queues(
            graph,
            seed=wanted.seed,
            duration=trajectory.duration,
            ego=ego,
            ego_box=EGO_BOX,
        )
    _check_room(wanted, _error_source(scenario), graph, walkways)
    if wanted.walkers:
        world = world or load_stage(drive, with_vehicle=False)
        obstacles = _sidewalk_obstacles(world)
        walkways = kept_clear(walkways, obstacles)
        graph, walkways = with_unmarked_crossings(graph, walkways, obstacles)
    return _plan_moving_traffic(scenario, trajectory, ego, graph, walkways)


def _ego_path(trajectory: Trajectory) -> EgoPath:
    """Returns a function that computes the car's poses at times (N,) [s].

    The poses are positions (N, 2) [m] and yaws (N,) [rad] in the world. After
    the end of the trajectory, the car stays where it is.
    """

    def ego(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        R_WB, p_WB = trajectory.poses(np.minimum(t, trajectory.duration))
        return p_WB[:, :2], np.unwrap(arctan2(R_WB[:, 1, 0], R_WB[:, 0, 0]))

    return ego


def _error_source(scenario: Scenario) -> str:
    """Returns the start of the message of an error in the traffic's fields."""
    return f"{scenario.source}: traffic"


def _plan_moving_traffic(
    scenario: Scenario,
    trajectory: Trajectory,
    ego: EgoPath,
    graph: LaneGraph,
    walkways: Sequence[Walkway],
) -> TrafficPlan:
    """Plans vehicles and pedestrians that move by their own rules.

    Raises:
        InputError: there is no room for a vehicle, or the car that follows
            other vehicles never arrives.
    """
    wanted = scenario.traffic
    follows = scenario.driver.follows
    plan = plan_traffic(
        graph,
        walkways,
        vehicles=wanted.vehicles,
        walkers=wanted.walkers,
        seed=wanted.seed,
        # Traffic is planned for the whole drive, not only for its frames.
        duration=_SLOWEST_RATIO * trajectory.duration + _LONGEST_WAIT
        if follows
        else trajectory.duration + FRAME_PERIOD,
        ego=(lambda t: ego(0.0 * t)) if follows else ego,
        ego_box=EGO_BOX,
        drive=trajectory if follows else None,
    )
    if wanted.vehicles and not plan.kinds:
        raise InputError(
            f"{_error_source(scenario)}: the car leaves no room for vehicles"
        )
    if follows and plan.positions is None:
        raise InputError(
            f"{scenario.source}: driver: follows: the car is held up for ever; "
            "take fewer vehicles"
        )
    return plan


def _sidewalk_obstacles(world: World) -> list[BaseGeometry]:
    """Returns footprints of objects that can stand on sidewalks [m].

    Buildings are left out, because walkways lead along them.
    """
    passed = GROUND_CLASSES | {"building"}
    structures = geometry_by_structure(
        world, lambda name: world.structures[name].semantic_class not in passed
    )
    return [structure.footprint for structure in structures.values()]


def load_ways(
    folder: MapFolder, network: RoadNetwork | None = None
) -> LaneFile:
    """Returns the lanes and walkways that traffic follows on a map.

    Args:
        folder: the map.
        network: the map's road network, if already loaded.

    Raises:
        InputError: the map has neither roads nor lanes.
    """
    if not folder.roads.is_file():
        return read_lanes(folder.lanes)
    network = network or load_road_network(folder.roads)
    graph = make_lane_graph(network)
    return LaneFile(graph, make_walkways(network, graph))


def _check_room(
    wanted: TrafficConfig,
    where: str,
    graph: LaneGraph,
    walkways: Sequence[Walkway],
) -> None:
    """Checks that roads and sidewalks have room for the traffic."""
    room = room_for_vehicles(graph)
    if wanted.vehicles > room:
        raise InputError(
            f"{where}: vehicles: {wanted.vehicles} are too many; the roads "
            f"hold {room}"
        )
    room = room_for_walkers(walkways)
    if wanted.walkers and not room:
        raise InputError(
            f"{where}: walkers: the map has no sidewalks; leave walkers out"
        )
    if wanted.walkers > room:
        raise InputError(
            f"{where}: walkers: {wanted.walkers} are too many; the sidewalks "
            f"hold {room}"
        )


def with_traffic(world: World, plan: TrafficPlan) -> World:
    """Returns a world whose structure table and notes include the traffic.

    Raises:
        InputError: there are more structures than ids.
    """
    table = world.structures
    entries = traffic_structures(plan, table.last_instance + 1)
    notes = world.notes + plan.notes
    if plan.left_out:
        notes += (
            f"traffic: {plan.left_out} left out: they would have met others "
            "or the car",
        )
    return replace(world, structures=table.joined(entries), notes=notes)
