"""A scenario with all that its simulation needs: path, stage, traffic."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import functools
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base.elementary import arctan2
from cns_drake.base.errors import InputError
from cns_drake.base.files import user_errors
from cns_drake.base.progress import doing
from cns_drake.motion.trajectory import Trajectory
from cns_drake.recording.schedule import FRAME_PERIOD
from cns_drake.roads.network import load_road_network
from cns_drake.scenarios.planning import DrivePlan, count_frames
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import check_files
from cns_drake.scenarios.sections import TrafficConfig
from cns_drake.scenarios.shipped import vehicle_file
from cns_drake.scene.map_folder import MapFolder
from cns_drake.scene.world import World, load_world
from cns_drake.sensors.carriers import sensor_pose
from cns_drake.simulation.recording_schedule import (
    RecordingPlan,
    plan_recording,
)
from cns_drake.traffic import lane_graph, queues, traffic_plan
from cns_drake.traffic.fcd_traffic import play_trace, read_fcd
from cns_drake.traffic.lane_file import LaneFile, read_lanes
from cns_drake.traffic.road_lanes import make_lane_graph, make_walkways
from cns_drake.traffic.streets import EgoBox
from cns_drake.traffic.traffic_motion import traffic_structures
from cns_drake.traffic.unmarked_crossings import with_unmarked_crossings
from cns_drake.traffic.vehicles import room_for_vehicles
from cns_drake.traffic.walkers import room_for_walkers
from cns_drake.traffic.walkway_clearing import kept_clear
from cns_drake.transient.changing import change_world
from cns_drake.transient.ground_surface import GROUND_CLASSES
from cns_drake.transient.loaded_structures import read_structures

# Size of the car in worlds/vehicle.sdf, with mirrors and wheels [m].
EGO_BOX = EgoBox(rear=-1.05, front=3.75, half_width=1.05)
# A car that follows others takes at most this multiple of the time that it
# would need alone, plus a wait.
_SLOWEST_RATIO = 6.0
# This wait [s].
_LONGEST_WAIT = 600.0
# Distance from the car's middle line to its sides, with a margin [m].
_HALF_WIDTH = 1.3


@dataclass(frozen=True)
class LoadedDrive:
    """A scenario with all that its simulation needs, loaded.

    Attributes:
        scenario: the scenario; its field `frames` is never None.
        trajectory: motion of the vehicle.
        world: world of the stage, with the vehicle and the objects of the
            traffic. The first Diagram that is built takes over the world's
            SceneGraph.
        traffic: motion of all other vehicles and of pedestrians; None without
            traffic.
    """

    scenario: Scenario
    trajectory: Trajectory
    world: World
    traffic: traffic_plan.TrafficPlan | None = None

    @functools.cached_property
    def recording(self) -> RecordingPlan:
        """The topics of the recording, and the times of their messages."""
        return plan_recording(self.scenario)

    @property
    def num_frames(self) -> int:
        """Number of frames to record."""
        assert self.scenario.frames is not None
        return self.scenario.frames

    @property
    def X_BSs(self) -> dict[str, RigidTransform]:
        """LiDAR name -> pose of the LiDAR in base_link."""
        lidars = self.scenario.lidars
        return {name: sensor_pose(lidar) for name, lidar in lidars.items()}


def load_drive(scenario: Scenario) -> LoadedDrive:
    """Plans the drive of a scenario and its traffic, and loads its stage.

    If the vehicle keeps its distance to the vehicle ahead (field
    `driver.follows`), the drive is slower than planned without traffic.

    Raises:
        InputError: the scenario cannot be run.
    """
    check_files(scenario)
    doing("planning the drive")
    plan = DrivePlan(scenario)
    trajectory = plan.trajectory
    if not scenario.driver.follows:
        count_frames(scenario, trajectory)  # An error comes at once.
    world = load_stage(plan)
    traffic = None
    if not scenario.traffic.is_off:
        doing("planning the traffic")
        traffic = plan_scenario_traffic(scenario, trajectory, world)
        world = with_traffic(world, traffic)
        if traffic.positions is not None:
            trajectory = plan.trajectory_at(traffic.positions)
    return LoadedDrive(
        scenario.replaced(frames=count_frames(scenario, trajectory)),
        trajectory,
        world,
        traffic,
    )


def load_stage(plan: DrivePlan, *, with_vehicle: bool = True) -> World:
    """Loads the world of a drive's stage, with its temporary changes.

    Args:
        plan: the plan of the drive, near which the temporary changes (field
            `transient`) are made.
        with_vehicle: whether the world contains the vehicle.

    Raises:
        InputError: the scenario's files cannot be used.
    """
    scenario = plan.scenario
    doing("reading the stage")
    in_the_way = _in_the_way(scenario)
    world = load_world(
        scenario.world_file,
        vehicle=vehicle_file() if with_vehicle else None,
        without=(*scenario.without, *in_the_way),
    )
    if in_the_way:
        note = f"traffic: {len(in_the_way)} things in its lanes left out"
        world = replace(world, notes=(*world.notes, note))
    if scenario.transient.is_off:
        return world
    trajectory = plan.trajectory
    doing("making the temporary changes")
    times = np.arange(0.0, trajectory.duration, 0.1)
    drive = shapely.LineString(trajectory.poses(times)[1][:, :2])
    driven: BaseGeometry = drive.buffer(_HALF_WIDTH)
    if plan.network is not None:
        driven = driven.union(plan.network.areas.lane_area)
    return change_world(world, scenario.transient, drive, driven)


def _in_the_way(scenario: Scenario) -> Sequence[str]:
    """Returns the names of structures that stand where traffic drives."""
    if scenario.traffic.is_off or scenario.map is None:
        return ()
    folder = scenario.folder
    if folder.roads.is_file() or not folder.lanes.is_file():
        return ()
    return read_lanes(folder.lanes).in_the_way


def plan_scenario_traffic(
    scenario: Scenario, trajectory: Trajectory, world: World | None = None
) -> traffic_plan.TrafficPlan:
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
    wanted = scenario.traffic
    where = f"{scenario.source}: traffic"
    if world is None:
        check_files(scenario)
    graph, walkways, _ = load_ways(scenario.folder)

    def ego(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        R_WB, p_WB = trajectory.poses(np.minimum(t, trajectory.duration))
        return p_WB[:, :2], np.unwrap(arctan2(R_WB[:, 1, 0], R_WB[:, 0, 0]))

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
        return queues.plan_queues(
            graph,
            seed=wanted.seed,
            duration=trajectory.duration,
            ego=ego,
            ego_box=EGO_BOX,
        )
    _check_room(wanted, where, graph, walkways)
    if wanted.walkers:
        world = world or load_stage(DrivePlan(scenario), with_vehicle=False)
        things = _sidewalk_obstacles(world)
        walkways = kept_clear(walkways, things)
        graph, walkways = with_unmarked_crossings(graph, walkways, things)
    follows = scenario.driver.follows
    plan = traffic_plan.plan_traffic(
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
        raise InputError(f"{where}: the car leaves no room for vehicles")
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
    things = read_structures(
        world, lambda name: world.structures[name].semantic_class not in passed
    )
    return [thing.footprint for thing in things.values()]


def load_ways(folder: MapFolder) -> LaneFile:
    """Returns the lanes and walkways that traffic follows on a map.

    Raises:
        InputError: the map has neither roads nor lanes.
    """
    if not folder.roads.is_file():
        return read_lanes(folder.lanes)
    with user_errors(folder.roads):
        content = folder.roads.read_bytes()
    return _ways_along(folder.roads, content)


@functools.lru_cache(maxsize=1)
def _ways_along(roads: Path, content: bytes) -> LaneFile:
    """Returns lanes and walkways along roads; cached for repeated use."""
    network = load_road_network(roads)
    graph = make_lane_graph(network)
    return LaneFile(graph, make_walkways(network, graph))


def _check_room(
    wanted: TrafficConfig,
    where: str,
    graph: lane_graph.LaneGraph,
    walkways: Sequence[lane_graph.Walkway],
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


def with_traffic(world: World, plan: traffic_plan.TrafficPlan) -> World:
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


def structure_list(world: World) -> list[dict]:
    """Returns a description of each structure of a world, ready for JSON."""
    return [
        {
            "instance": entry.instance,
            "name": entry.name,
            "class": entry.semantic_class,
            "label": entry.label,
            **({"causes": list(entry.causes)} if entry.causes else {}),
        }
        for entry in world.structures
    ]
