"""Topics of a drive, and the times at which its sensors are recorded."""

import math

from cns_drake.recording.recorded_topics import (
    OBJECT_TOPICS,
    camera_topic,
    labels_topic,
    points_topic,
    recording_topics,
)
from cns_drake.recording.rosbag2_metadata import Topic
from cns_drake.recording.schedule import Schedule, make_schedule
from cns_drake.scenarios.scenario import Scenario

# Tolerance, in periods, for a time to count as a multiple of a period.
_TOLERANCE = 1e-6


def point_layouts(scenario: Scenario) -> dict[str, str]:
    """Returns LiDAR name -> name of the layout of its recorded points."""
    return {name: one.layout for name, one in scenario.lidars.items()}


def scenario_topics(scenario: Scenario) -> tuple[Topic, ...]:
    """Returns the topics of a scenario's recording."""
    return recording_topics(
        scenario.lidars,
        layouts=point_layouts(scenario),
        with_objects=not scenario.traffic.is_off,
        further=(*_further_topics(scenario).values(), *_camera_rates(scenario)),
    )


def _further_topics(scenario: Scenario) -> dict[str, Topic]:
    """Returns the topic of each further sensor, by the sensor's name."""
    sensors = scenario.further_sensors.items()
    return {name: sensor.topic(name) for name, sensor in sensors}


def _camera_rates(scenario: Scenario) -> dict[Topic, int]:
    """Returns topic -> images per second, for the topics of a camera."""
    return {
        camera_topic(name, kind): camera.rate
        for name, camera in scenario.cameras.items()
        for kind, is_there in (
            ("image", True),
            ("depth", camera.depth),
            ("label", camera.label),
            ("camera_info", True),
        )
        if is_there
    }


def first_points_topic(scenario: Scenario) -> str:
    """Returns the name of the topic with the scans of the first LiDAR.

    Each message on this topic begins a frame.
    """
    return scenario_topics(scenario)[0].name


def drive_schedule(scenario: Scenario) -> Schedule:
    """Returns the schedule of a scenario's topics.

    If the scenario gives a number of frames, no scan begins after the last
    frame. Samples of the IMU, if it is not ideal, and odometry with a rate of
    its own continue until the last scan is complete. So do the poses on `/tf`
    if scans have motion distortion: such scans can thus be corrected up to
    their last point.

    Raises:
        InputError: Kalibr's file cannot be used.
    """
    fastest = scenario.fastest_rate
    odometry = scenario.odometry.rate or fastest
    rates = {
        "/imu/data": scenario.imu.sample_rate(fastest),
        "/odometry": odometry,
        "/tf": odometry,
    }
    if not scenario.traffic.is_off:
        rates |= {topic.name: fastest for topic in OBJECT_TOPICS}
    for name, topic in _further_topics(scenario).items():
        rates[topic.name] = scenario.further_sensors[name].rate or fastest
    for topic, rate in _camera_rates(scenario).items():
        rates[topic.name] = rate
    for name, lidar in scenario.lidars.items():
        rates[points_topic(name).name] = lidar.rate
        if lidar.layout != "cns":
            rates[labels_topic(name).name] = lidar.rate
    periods = {name: 1.0 / rate for name, rate in rates.items()}
    if scenario.frames is None:
        return make_schedule(periods)
    last_scan = (scenario.frames - 1) * scenario.frame_period
    complete = max(
        (math.floor(last_scan * one.rate + _TOLERANCE) + 1) / one.rate
        for one in scenario.lidars.values()
    )
    until = dict.fromkeys(periods, last_scan)
    if not scenario.imu.is_ideal:
        until["/imu/data"] = complete
    if scenario.odometry.rate is not None:
        until["/odometry"] = until["/tf"] = complete
    elif any(one.motion_distortion for one in scenario.lidars.values()):
        until["/tf"] = complete
    # The number of the first sample at or after the end.
    return make_schedule(
        periods,
        {
            name: math.ceil(time * rates[name] - _TOLERANCE) / rates[name]
            if time == complete
            else time
            for name, time in until.items()
        },
    )
