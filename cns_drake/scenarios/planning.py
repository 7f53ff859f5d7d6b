"""Plans the drive of a scenario."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform

from cns_drake.motion import (
    Suspension,
    Trajectory,
    load_car_masses,
    load_suspension_rates,
    ride_on_springs,
    suspension_file,
    vehicle_file,
)
from cns_drake.ray_casting import RayCastingScene
from cns_drake.recording import frames_within
from cns_drake.scenarios.missing_structures import lost_structures
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import check_files
from cns_drake.scene import InSight, World, load_world, read_perception_geometry
from evaluation.base import InputError, errors_at_option
from worlds.shapes import (
    FINE_SPACING,
    POINT_SPACING,
    TIGHTEST_RADIUS,
    LanePath,
    driven_path,
    kerbs,
    load_waypoint_path,
    obstacle_points,
    read_waypoints,
)

if TYPE_CHECKING:
    # A drive through a world without roads needs nothing that reads them.
    from worlds.roads import RoadNetwork

# Heights above the path at which rays look for obstacles, from below the top of
# a kerb up to the car's roof [m].
_HEIGHTS = np.array([(0.0, 0.0, z) for z in (0.1, 0.3, 0.7, 1.2, 1.6)])
# Directions of these rays.
_AROUND = np.array(
    [
        (math.cos(angle), math.sin(angle), 0.0)
        for angle in np.radians(np.arange(0, 360, 10)).tolist()
    ]
)
# Range of these rays [m].
_SIGHT = 5.0
# Height of the start of rays that look for the ground, from above everything
# and from above a path [m].
_SKY = 2000.0
_ABOVE_PATH = 2.0
# Number of points of a path that are compared with the ground.
_CHECKED = 500
# Range of the latter rays [m].
_DEEPEST = 1000.0
# Rays go on this far below a surface [m], through at most so many surfaces.
_STEP_BELOW = 0.01
_MOST_SURFACES = 64
# A car has room where this height above the ground is free [m].
_CLEARANCE = 2.0
# A car is off the ground at a greater height above or below it [m].
_OFF_GROUND = 0.5
# The ground rises and falls by less between two places of a path, which are 2 m
# apart [m].
_STEEPEST = 1.0
# Greatest z component of the normal of an obstacle.
_STEEP = 0.7


@dataclass(frozen=True)
class DrivePlan:
    """The plan of a scenario's drive: its roads and its trajectory.

    The roads are read, and the trajectory is planned, only once: when they are
    first used.

    Attributes:
        scenario: the scenario.

    Raises:
        InputError: a file of the scenario does not exist.
    """

    scenario: Scenario

    def __post_init__(self) -> None:
        check_files(self.scenario)

    @cached_property
    def network(self) -> RoadNetwork | None:
        """The road network of the map; None for a map without roads.

        Raises:
            InputError: the roads cannot be used.
        """
        scenario = self.scenario
        if scenario.map is None:
            return None
        roads = scenario.folder.roads
        if scenario.route is None and not roads.is_file():
            return None
        from worlds.roads import load_road_network

        return load_road_network(roads)

    @cached_property
    def trajectory(self) -> Trajectory:
        """The vehicle's motion, as fast as the limits allow.

        Raises:
            InputError: the roads, the waypoints or the vehicle's springs cannot
                be used, the route does not fit the roads, or a bend is too
                tight for the car.
        """
        return self._on_springs(self._rigid_motion)

    @cached_property
    def _rigid_motion(self) -> Trajectory:
        """The motion of a car without springs."""
        scenario = self.scenario
        spacing = FINE_SPACING if scenario.driver.departs else POINT_SPACING
        if scenario.waypoints is not None:
            path = load_waypoint_path(
                scenario.waypoints,
                spacing,
                u_turns=scenario.u_turns,
                ground=lambda xy: _ground_heights(scenario, xy),
            )
            source = scenario.waypoints
            cure = "place waypoints farther apart, or leave some out"
        else:
            from worlds.roads import make_lane_path

            # There is a route or waypoints, and a route is along roads.
            assert scenario.route is not None
            assert self.network is not None
            path = make_lane_path(
                self.network,
                scenario.route,
                spacing,
                scenario.source,
                aside=scenario.aside,
            )
            source = f"{scenario.source}: route"
            cure = "give the junction a greater kerb_radius"
        if scenario.driver.departs:
            path = self._driven_path(path, source)
        trajectory = Trajectory(path, scenario.speeds)
        radius, (x, y, _) = trajectory.path.tightest_bend()
        if radius < TIGHTEST_RADIUS:
            raise InputError(
                f"{source}: a bend of {radius:.2f} m radius at {x:.1f}, {y:.1f}"
                f" is too tight: the car needs {TIGHTEST_RADIUS:.2f} m; {cure}"
            )
        return trajectory

    def _driven_path(self, path: LanePath, source: str) -> LanePath:
        """Returns the path of a driver who leaves the middle of the lane.

        `source` is the file or field of the path, for error messages.
        """
        driver = self.scenario.driver
        return driven_path(
            path,
            POINT_SPACING,
            obstacle_points(_obstacles_beside(self.scenario, path.points))
            if self.scenario.waypoints is not None or self.network is None
            else kerbs(self.network.areas.lane_area),
            source,
            wander=driver.wander,
            wander_length=driver.wander_length,
            lane_changes=driver.lane_changes,
            rng=driver.rng(self.scenario.name),
        )

    def _on_springs(self, trajectory: Trajectory) -> Trajectory:
        ride = self.scenario.ride
        profile = ride.profile()
        if profile is None:
            return trajectory
        springs = Suspension(
            load_car_masses(vehicle_file()),
            load_suspension_rates(suspension_file()),
        )
        return ride_on_springs(
            trajectory, springs, profile, crossfall=ride.crossfall
        )


def plan_drive(scenario: Scenario) -> Trajectory:
    """Returns the trajectory of a scenario's vehicle along its route.

    The route is a list of lanes or of waypoints. The car drives as fast as the
    limits allow.

    Raises:
        InputError: as `DrivePlan.trajectory`.

    Example:
        from cns_drake import load_scenario, plan_drive

        trajectory = plan_drive(load_scenario("downtown_01"))
    """
    return DrivePlan(scenario).trajectory


def count_frames(scenario: Scenario, trajectory: Trajectory) -> int:
    """Returns the number of frames that a scenario's drive records.

    Raises:
        InputError: the field `frames` exceeds the number of frames of the whole
            drive.
    """
    available = frames_within(trajectory.duration, scenario.frame_period)
    if scenario.frames is not None and scenario.frames > available:
        raise InputError(
            f"{scenario.source}: frames: {scenario.frames} is too many: the "
            f"drive has {available}"
        )
    return scenario.frames or available


def _obstacles_beside(scenario: Scenario, points: np.ndarray) -> np.ndarray:
    """Returns the points (N, 2) of obstacles beside a path in the world [m].

    Rays in all directions, from near the ground to the height of the car, find
    kerbs and walls. An edge at which the ground only falls is not found.

    Args:
        scenario: the scenario, whose world is loaded.
        points: (N, 3) points of the path, which must be close together [m].

    Raises:
        InputError: the world cannot be loaded.
    """
    scene = _scene_of(scenario)
    p_WR = (points + _HEIGHTS[:, None]).reshape(-1, 3)
    d_W = np.repeat(_AROUND, len(p_WR), axis=0)
    hits = scene.cast_rays(p_WR, d_W, _SIGHT, with_normals=True)
    # The ground is no obstacle.
    steep = np.isfinite(hits.ranges) & (np.abs(hits.normals_W[:, 2]) < _STEEP)
    p_WQ = np.tile(p_WR, (len(_AROUND), 1))[steep]
    p_WQ += hits.ranges[steep, None] * d_W[steep]
    # One point per centimetre is enough.
    return np.unique(np.round(p_WQ[:, :2], 2), axis=0)


def ground_notes(scenario: Scenario, trajectory: Trajectory) -> tuple[str, ...]:
    """Returns notes if the car does not drive on the ground of a world.

    Maps have roads, or waypoints with the heights of their ground. Only worlds
    are therefore checked.

    Raises:
        InputError: the world cannot be loaded.
    """
    named = _unused_columns(scenario)
    if scenario.world is None:
        return named
    times = np.linspace(0.0, trajectory.duration, _CHECKED)
    path = trajectory.poses(times)[1]
    start = path + np.array([0.0, 0.0, _ABOVE_PATH])
    down = np.tile([0.0, 0.0, -1.0], (len(path), 1))
    ranges = _scene_of(scenario).cast_rays(start, down, _DEEPEST).ranges
    above = ranges - _ABOVE_PATH
    is_there = np.isfinite(above)
    notes = [*named]
    if not is_there.all():
        notes.append(
            f"{scenario.waypoints}: no ground is below"
            f" {(~is_there).mean():.0%} of the path"
        )
    if is_there.any() and np.abs(above[is_there]).max() > _OFF_GROUND:
        worst = int(np.argmax(np.where(is_there, np.abs(above), 0.0)))
        x, y, z = path[worst]
        side = "above" if above[worst] > 0.0 else "below"
        notes.append(
            f"{scenario.waypoints}: at {x:.1f}, {y:.1f} the car drives"
            f" {abs(above[worst]):.2f} m {side} the ground, at z = {z:.2f} m"
        )
    return tuple(notes)


def _unused_columns(scenario: Scenario) -> tuple[str, ...]:
    """Returns a note on columns of the waypoints that are not used."""
    if scenario.waypoints is None:
        return ()
    unused = read_waypoints(scenario.waypoints).unused
    if not unused:
        return ()
    return (f"{scenario.waypoints}: not used: the columns {', '.join(unused)}",)


def _ground_heights(scenario: Scenario, xy: np.ndarray) -> np.ndarray:
    """Returns the heights (N,) of the ground along a path in a world [m].

    The ground is the surface on which a car has room. If there are several, it
    is the one that continues the ground before or behind. If there are several
    along the whole path, it begins at z = 0. Where there is no surface, the
    heights beside are interpolated; without any, they are 0.

    Args:
        scenario: the scenario.
        xy: (N, 2) places along the path, 2 m apart.

    Raises:
        InputError: the world cannot be loaded, or it is open which of several
            surfaces is the ground.
    """
    levels = _usable_levels(_scene_of(scenario), xy)
    heights = np.full(len(xy), np.nan)
    for number, found in enumerate(levels):
        if len(found) == 1:
            heights[number] = found[0]
    if np.isnan(heights).all():
        for number, found in enumerate(levels):
            level = [z for z in found if abs(z) < _OFF_GROUND]
            if len(level) == 1:
                heights[number] = level[0]
    for order in (range(1, len(xy)), range(len(xy) - 2, -1, -1)):
        step = order.step
        for number in order:
            before = heights[number - step]
            near = [z for z in levels[number] if abs(z - before) < _STEEPEST]
            if np.isnan(heights[number]) and near:
                heights[number] = min(near, key=lambda z: abs(z - before))
    open_ = np.isnan(heights)
    for number in np.flatnonzero(open_).tolist():
        if levels[number]:
            x, y = xy[number]
            some = " and ".join(f"{z:.2f}" for z in levels[number][:3])
            raise InputError(
                f"{scenario.waypoints}: has no column z, and at {x:.1f},"
                f" {y:.1f} the ground can be at {some} m; add the column z"
            )
    if open_.all():
        return np.zeros(len(xy))
    stations = np.arange(len(xy))
    return np.interp(stations, stations[~open_], heights[~open_])


def _usable_levels(scene: RayCastingScene, xy: np.ndarray) -> list[list[float]]:
    """Returns for each place the heights on which a car has room [m]."""
    down = np.tile([0.0, 0.0, -1.0], (len(xy), 1))
    start = np.column_stack([xy, np.full(len(xy), _SKY)])
    levels: list[list[float]] = [[] for _ in xy]
    for _ in range(_MOST_SURFACES):
        ranges = scene.cast_rays(start, down, 2.0 * _SKY).ranges
        if not np.isfinite(ranges).any():
            break
        for number in np.flatnonzero(np.isfinite(ranges)).tolist():
            start[number, 2] -= ranges[number]
            levels[number].append(float(start[number, 2]))
        start[:, 2] -= _STEP_BELOW
    usable = []
    for found in levels:
        room = np.diff([_SKY, *found]) < -_CLEARANCE
        # Rays are exact to a tenth of a millimetre here.
        usable.append(
            [
                round(z, 3) + 0.0
                for z, free in zip(found, room, strict=True)
                if free
            ]
        )
    return usable


def load_scenario_world(
    scenario: Scenario,
    without: Collection[str] = (),
    vehicle: Path | None = None,
    in_sight: InSight | None = None,
) -> World:
    """Loads the world of a scenario's stage, without its temporary changes.

    What the field `city` removes is left out.

    Args:
        scenario: the scenario.
        without: names of structures that are left out, besides those of the
            scenario.
        vehicle: see `cns_drake.scene.load_world`.
        in_sight: see `cns_drake.scene.load_world`.

    Raises:
        InputError: the world cannot be loaded.
    """
    if scenario.lacks_city:
        raise InputError(
            f"{scenario.source}: city: its map has not been made; record the"
            " drive (cns-drake simulate)"
        )
    lost = lost_structures(scenario)
    with errors_at_option(f"{scenario.source}: without", "without"):
        return load_world(
            scenario.world_file,
            vehicle=vehicle,
            without=(*scenario.without, *lost, *without),
            model_paths=scenario.model_paths,
            in_sight=in_sight,
        )


def _scene_of(scenario: Scenario) -> RayCastingScene:
    """Returns the geometry of a scenario's world, for rays.

    Raises:
        InputError: the world cannot be loaded.
    """
    world = load_scenario_world(scenario)
    context = world.plant.CreateDefaultContext()
    inspector = world.scene_graph.model_inspector()
    bodies = {
        frame: world.plant.GetBodyFromFrameId(frame)
        for frame in inspector.GetAllFrameIds()
        if frame != world.scene_graph.world_frame_id()
    }

    def X_WF(frame: FrameId) -> RigidTransform:
        if frame not in bodies:
            return RigidTransform()
        return bodies[frame].EvalPoseInWorld(context)

    return RayCastingScene(
        read_perception_geometry(inspector), world.anchored_frames(), X_WF
    )
