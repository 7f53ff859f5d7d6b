"""Plans the drive of a scenario."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.motion import suspension, suspension_data
from cns_drake.motion.trajectory import Trajectory
from cns_drake.recording.schedule import frames_within
from cns_drake.roads.driver_offsets import FINE_SPACING, driven_path, kerbs
from cns_drake.roads.lane_path import POINT_SPACING, LanePath
from cns_drake.roads.network import RoadNetwork, load_road_network
from cns_drake.roads.route import make_lane_path
from cns_drake.roads.u_turn import TIGHTEST_RADIUS
from cns_drake.roads.waypoints import load_waypoint_path
from cns_drake.scenarios.path_obstacles import obstacles_beside
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import check_files
from cns_drake.scenarios.shipped import suspension_file, vehicle_file


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
        roads = scenario.folder.roads
        if scenario.route is None and (
            scenario.map is None or not roads.is_file()
        ):
            return None
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

    def trajectory_at(self, positions: np.ndarray) -> Trajectory:
        """Returns the motion of a car that keeps its distance to other cars.

        Args:
            positions: (N,) distances along the path at evenly spaced times [m],
                see `cns_drake.traffic.traffic_plan.TrafficPlan`.
        """
        return self._on_springs(self._rigid_motion.with_positions(positions))

    @cached_property
    def _rigid_motion(self) -> Trajectory:
        """The motion of a car without springs."""
        scenario = self.scenario
        spacing = FINE_SPACING if scenario.driver.departs else POINT_SPACING
        if scenario.waypoints is not None:
            path = load_waypoint_path(
                scenario.waypoints, spacing, u_turns=scenario.u_turns
            )
            source = scenario.waypoints
            cure = "place waypoints farther apart, or leave some out"
        else:
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
            obstacles_beside(self.scenario, path.points)
            if self.scenario.waypoints is not None or self.network is None
            else kerbs(self.network),
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
        springs = suspension.Suspension(
            suspension_data.load_car_masses(vehicle_file()),
            suspension_data.load_suspension_rates(suspension_file()),
        )
        return suspension.ride_on_springs(
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
