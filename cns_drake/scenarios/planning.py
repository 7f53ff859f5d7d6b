"""From a scenario to the drive that it describes."""

from __future__ import annotations

from cns_drake.motion.trajectory import POINT_SPACING, Trajectory
from cns_drake.recording.frame_clock import frames_within
from cns_drake.roads.network import load_road_network
from cns_drake.roads.route import make_lane_path
from cns_drake.roads.waypoints import load_waypoint_path
from cns_drake.scenarios.scenario import Scenario
from evaluation.support.errors import InputError


def plan_drive(scenario: Scenario) -> Trajectory:
    """Plans the drive of a scenario, along its route or its waypoints.

    Raises:
        InputError: the roads or the waypoints cannot be used, or the route
            does not suit the roads.

    Example:
        from cns_drake import load_scenario, plan_drive

        trajectory = plan_drive(load_scenario("downtown_01"))
    """
    if scenario.waypoints is not None:
        path = load_waypoint_path(scenario.waypoints, POINT_SPACING)
    else:
        assert scenario.route is not None  # One of both is there.
        network = load_road_network(scenario.roads_file)
        path = make_lane_path(
            network,
            scenario.route,
            POINT_SPACING,
            scenario.source,
            aside=scenario.aside,
        )
    return Trajectory(path, scenario.speeds)


def count_frames(scenario: Scenario, trajectory: Trajectory) -> int:
    """Returns how many frames a scenario's drive has.

    Raises:
        InputError: it asks for more than the drive takes.
    """
    available = frames_within(trajectory.duration)
    if scenario.frames is not None and scenario.frames > available:
        raise InputError(
            f"{scenario.source}: frames: {scenario.frames} asked for, but the "
            f"route takes only {available}"
        )
    return scenario.frames or available
