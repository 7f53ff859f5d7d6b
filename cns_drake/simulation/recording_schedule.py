"""Topics of a drive, and the times at which its sensors are recorded."""

from collections.abc import Mapping
from dataclasses import dataclass
import math

from cns_drake.recording import (
    IMU_TOPIC,
    OBJECT_TOPICS,
    ODOMETRY_TOPIC,
    TF_TOPIC,
    Schedule,
    Topic,
    camera_topic,
    labels_topic,
    make_schedule,
    points_topic,
    recording_topics,
)
from cns_drake.scenarios import Scenario

# Tolerance, in periods, for a time to count as a multiple of a period.
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class RecordingPlan:
    """The topics of a drive's recording, and the times of their messages.

    Attributes:
        topics: the topics. The first topic has the scans of the first LiDAR.
        schedule: times of the messages, with a stream for each topic that is
            not latched.
        layouts: LiDAR name -> name of the layout of its recorded points.
    """

    topics: tuple[Topic, ...]
    schedule: Schedule
    layouts: Mapping[str, str]


def plan_recording(scenario: Scenario) -> RecordingPlan:
    """Returns the topics and the schedule of a scenario's recording.

    The scenario's number of frames must be set. No scan begins after the last
    frame. Samples of an IMU that is not ideal, and odometry with a rate of its
    own, continue until the last scan is complete. If scans have motion
    distortion, the poses on `/tf` also continue until then, so that scans can
    be corrected up to their last point.

    Raises:
        InputError: Kalibr's file cannot be used.
    """
    fastest = scenario.fastest_rate
    layouts = {name: lidar.layout for name, lidar in scenario.lidars.items()}
    # Messages per second, for topics of further sensors and of cameras.
    further = {
        sensor.topic(name): sensor.rate or fastest
        for name, sensor in scenario.further_sensors.items()
    }
    for name, camera in scenario.cameras.items():
        for kind in camera.streams:
            further[camera_topic(name, kind)] = camera.rate
    topics = recording_topics(
        scenario.lidars,
        layouts=layouts,
        with_objects=not scenario.traffic.is_off,
        further=further,
    )
    odometry = scenario.odometry.rate or fastest
    rates = {
        IMU_TOPIC.name: scenario.imu.sample_rate(fastest),
        ODOMETRY_TOPIC.name: odometry,
        TF_TOPIC.name: odometry,
    }
    if not scenario.traffic.is_off:
        rates |= {topic.name: fastest for topic in OBJECT_TOPICS}
    rates |= {topic.name: rate for topic, rate in further.items()}
    for name, lidar in scenario.lidars.items():
        rates[points_topic(name).name] = lidar.rate
        if lidar.layout != "cns":
            rates[labels_topic(name).name] = lidar.rate
    return RecordingPlan(topics, _topic_schedule(scenario, rates), layouts)


def _topic_schedule(scenario: Scenario, rates: dict[str, int]) -> Schedule:
    """Returns the schedule of topics, given their messages per second."""
    periods = {name: 1.0 / rate for name, rate in rates.items()}
    assert scenario.frames is not None
    last_scan = (scenario.frames - 1) * scenario.frame_period
    complete = max(
        (math.floor(last_scan * lidar.rate + _TOLERANCE) + 1) / lidar.rate
        for lidar in scenario.lidars.values()
    )
    until = dict.fromkeys(periods, last_scan)
    if not scenario.imu.is_ideal:
        until[IMU_TOPIC.name] = complete
    if scenario.odometry.rate is not None:
        until[ODOMETRY_TOPIC.name] = until[TF_TOPIC.name] = complete
    elif any(lidar.motion_distortion for lidar in scenario.lidars.values()):
        until[TF_TOPIC.name] = complete
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
