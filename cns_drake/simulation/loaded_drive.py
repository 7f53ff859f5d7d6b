"""A scenario with all that its simulation needs: path, stage, traffic."""

from collections.abc import Mapping
from dataclasses import dataclass
import functools
import math

from pydrake.math import RigidTransform
from pydrake.multibody.tree import RigidBody

from cns_drake.motion import Trajectory
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
from cns_drake.scenarios import DrivePlan, Scenario, count_frames
from cns_drake.scene import InSight, World
from cns_drake.sensors import sensor_pose
from cns_drake.simulation.scenario_traffic import (
    plan_traffic_of_drive,
    things_in_the_way,
    with_traffic,
)
from cns_drake.simulation.stage_loading import load_stage
from cns_drake.traffic import TrafficPlan
from evaluation.base import doing
from evaluation.drives import BASE_FRAME, LayoutName

# Tolerance, in periods, for a time to count as a multiple of a period.
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class _RecordingPlan:
    """The topics of a drive's recording, and the times of their messages.

    Attributes:
        topics: the topics. The first topic has the scans of the first LiDAR.
        schedule: times of the messages, with a stream for each topic that is
            not latched.
        layouts: LiDAR name -> name of the layout of its recorded points.
    """

    topics: tuple[Topic, ...]
    schedule: Schedule
    layouts: Mapping[str, LayoutName]


def _plan_recording(scenario: Scenario) -> _RecordingPlan:
    """Returns the topics and the schedule of a scenario's recording.

    The scenario's number of frames must be set. No scan begins after the last
    frame. Samples of an IMU that is not ideal, and odometry with a rate of its
    own, continue until the last scan is complete. If scans have motion
    distortion, the poses on `/tf` also continue until then, so that scans can
    be corrected up to their last point.
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
    return _RecordingPlan(topics, _topic_schedule(scenario, rates), layouts)


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
    traffic: TrafficPlan | None = None

    @functools.cached_property
    def recording(self) -> _RecordingPlan:
        """The topics of the recording, and the times of their messages."""
        return _plan_recording(self.scenario)

    @property
    def num_frames(self) -> int:
        """Number of frames to record."""
        assert self.scenario.frames is not None
        return self.scenario.frames

    @property
    def structures(self) -> list[dict]:
        """A description of each structure of the world, ready for JSON."""
        return [
            {
                "instance": entry.instance,
                "name": entry.name,
                "class": entry.semantic_class,
                "label": entry.label,
                **({"causes": list(entry.causes)} if entry.causes else {}),
            }
            for entry in self.world.structures
        ]

    @property
    def base_link(self) -> RigidBody:
        """The vehicle's body B."""
        return self.world.plant.GetBodyByName(BASE_FRAME, self.world.vehicle)

    @property
    def X_BSs(self) -> dict[str, RigidTransform]:
        """LiDAR name -> pose of the LiDAR in base_link."""
        lidars = self.scenario.mounted_lidars
        return {name: sensor_pose(lidar) for name, lidar in lidars.items()}


def load_drive(plan: DrivePlan, in_sight: InSight | None = None) -> LoadedDrive:
    """Plans the traffic of a drive, and loads its stage.

    Args:
        plan: the plan of the drive.
        in_sight: tells what of the stage is in sight, see `load_world`; None to
            load the whole stage.

    Raises:
        InputError: the scenario cannot be run.
    """
    scenario = plan.scenario
    doing("planning the drive")
    trajectory = plan.trajectory
    frames = count_frames(scenario, trajectory)  # An error comes at once.
    world = load_stage(plan, in_sight=in_sight)
    traffic = None
    if not scenario.traffic.is_off:
        doing("reading the traffic")
        traffic = plan_traffic_of_drive(plan, trajectory, world)
        if in_the_way := things_in_the_way(scenario, world, traffic):
            world = load_stage(plan, without=in_the_way)
        world = with_traffic(world, traffic, in_the_way)
    return LoadedDrive(
        scenario.replaced(frames=frames), trajectory, world, traffic
    )
