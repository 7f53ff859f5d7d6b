"""The traffic of a scenario."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.map_folder import MapFolder
from cns_drake.motion.trajectory import Trajectory
from cns_drake.recording.schedule import FRAME_PERIOD
from cns_drake.roads.network import load_road_network
from cns_drake.scenarios.planning import count_frames
from cns_drake.scenarios.rates import frame_period
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import check_files, map_folder
from cns_drake.scenarios.traffic_config import TrafficConfig
from cns_drake.scene.world import World
from cns_drake.traffic.fcd_traffic import play_trace, read_fcd
from cns_drake.traffic.lane_file import LaneFile, read_lanes
from cns_drake.traffic.lane_graph import LaneGraph, Walkway
from cns_drake.traffic.road_lanes import make_lane_graph, make_walkways
from cns_drake.traffic.streets import EgoBox
from cns_drake.traffic.traffic_adding import traffic_structures
from cns_drake.traffic.traffic_plan import TrafficPlan, plan_traffic
from cns_drake.traffic.vehicles import room_for_vehicles
from cns_drake.traffic.walkers import room_for_walkers

# Size of the car in worlds/vehicle.sdf, with mirrors and wheels [m].
EGO_BOX = EgoBox(rear=-1.05, front=3.75, half_width=1.05)


def plan_scenario_traffic(
    scenario: Scenario, trajectory: Trajectory
) -> TrafficPlan:
    """Plans the traffic of a scenario.

    Args:
        scenario: with traffic.
        trajectory: of its vehicle.

    Raises:
        InputError: the map has no roads or sidewalks, or no room for that many;
            or the trace cannot be played here.

    Example:
        from cns_drake import load_scenario, plan_drive, plan_scenario_traffic

        scenario = load_scenario("metropolis_04").with_traffic(60)
        plan = plan_scenario_traffic(scenario, plan_drive(scenario))
    """
    wanted = scenario.traffic
    where = f"{scenario.source}: traffic"
    check_files(scenario)
    graph, walkways, _ = load_ways(map_folder(scenario))

    def ego(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        R_WB, p_WB = trajectory.poses(np.minimum(t, trajectory.duration))
        return p_WB[:, :2], np.unwrap(np.arctan2(R_WB[:, 1, 0], R_WB[:, 0, 0]))

    if wanted.fcd is not None:
        trace = Path(wanted.fcd)
        num_frames = count_frames(scenario, trajectory)
        return play_trace(
            read_fcd(trace),
            trace,
            graph,
            walkways,
            seed=wanted.seed,
            duration=(num_frames - 1) * frame_period(scenario.lidars),
            ego=ego,
            ego_box=EGO_BOX,
        )
    _check_room(wanted, where, graph, walkways)
    plan = plan_traffic(
        graph,
        walkways,
        vehicles=wanted.vehicles,
        walkers=wanted.walkers,
        seed=wanted.seed,
        # Traffic is planned for the whole drive, not only for its frames.
        duration=trajectory.duration + FRAME_PERIOD,
        ego=ego,
        ego_box=EGO_BOX,
    )
    if wanted.vehicles and not plan.kinds:
        raise InputError(f"{where}: the car leaves no room for vehicles")
    return plan


def load_ways(folder: MapFolder) -> LaneFile:
    """Returns what vehicles and walkers follow on a map.

    Raises:
        InputError: the map has neither roads nor lanes.
    """
    if not folder.roads.is_file():
        return read_lanes(folder.lanes)
    network = load_road_network(folder.roads)
    graph = make_lane_graph(network)
    return LaneFile(graph, make_walkways(network, graph))


def _check_room(
    wanted: TrafficConfig,
    where: str,
    graph: LaneGraph,
    walkways: Sequence[Walkway],
) -> None:
    """Checks that roads and sidewalks have room for the traffic.

    Raises:
        InputError: they do not.
    """
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
    """Returns a world with the traffic in its table and notes.

    Raises:
        InputError: there are more structures than ids.
    """
    table = world.structures
    entries = traffic_structures(plan, table.last_instance + 1)
    notes = world.notes
    if plan.left_out:
        notes += (
            f"traffic: {plan.left_out} left out: they would have met others "
            "or the car",
        )
    return replace(world, structures=table.joined(entries), notes=notes)
