"""Recording the sensors of a Diagram as ROS 2 messages."""

from collections.abc import Mapping
import math
from typing import Any
import warnings

from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from cns_drake.base.drives import ros_types
from cns_drake.recording import messages
from cns_drake.recording.background_writer import BackgroundWriter
from cns_drake.recording.bag_writer import BagWriter
from cns_drake.recording.recorded_topics import (
    IMU_TOPIC,
    ODOMETRY_TOPIC,
    TF_STATIC_TOPIC,
    TF_TOPIC,
    recording_topics,
)
from cns_drake.recording.rosbag2_metadata import Topic
from cns_drake.recording.schedule import Schedule, make_schedule
from cns_drake.recording.sensor_ports import (
    CameraPorts,
    ImuPorts,
    ImuSamplesPort,
    MotionPorts,
    RecordedCamera,
    RecordedSensor,
    ValuePort,
    objects_port,
    scan_port,
    sensor_port,
)

# Events of a periodic schedule come at multiples of the period. Their times
# differ from a tick's only by rounding, at most this [ticks].
_TICK_TOLERANCE = 1e-3


class McapRecorder(LeafSystem):
    """Writes each frame's sensor outputs to a BagWriter.

    .. pydrake_system::

        name: McapRecorder
        input_ports:
        - odometry
        - specific_force
        - angular_velocity
        - imu_samples (in place of these two)
        - objects (if it is declared)
        - <lidar>_scan (one for each LiDAR)
        - <lidar>_pose (for each LiDAR without a fixed place)
        - <camera>_color (one for each camera)
        - <camera>_depth
        - <camera>_label
        - <camera>_pose
        - <sensor> (one for each further sensor)

    Frames: map W, vehicle B (`base_link`), imu I, LiDAR S, camera C.

    - `odometry`: abstract, an object with `X_WB` (RigidTransform) and
      `V_WB_B` (SpatialVelocity expressed in B).
    - `specific_force`: of I, expressed in I, vector of size 3 [m/s^2].
    - `angular_velocity`: w_WI_I, vector of size 3 [rad/s].
    - `imu_samples`: abstract, `ImuSamples`, the last ones up to now; without
      this port the orientation of I is that of the odometry.
    - `objects`: abstract, `RecordedObjects`.
    - `<lidar>_scan`: abstract, structured array of points expressed in S.
    - `<lidar>_pose`: abstract, X_WS.
    - `<camera>_color`, `_depth`, `_label`: images as Drake's RgbdSensor gives
      them; `<camera>_pose`: abstract, the pose of that sensor.

    A port that is not connected is not recorded.

    Tick i is at i * period of its schedule. A periodic publish event from time
    zero on, or a forced publish at a tick's time, writes the messages that are
    due from the present inputs. A port `imu_samples` needs no event of its
    own: the next event writes its samples of several ticks. A simulation that
    starts before time zero gives a warning. The inputs must be wired straight
    to continuous outputs: a publish sees the state before any update at the
    same time, and a hold in front would make every message one period old.

    Example:
        from cns_drake import McapRecorder

        recorder = McapRecorder(
            bag, X_BSs={"lidar": X_BS}, X_BI=X_BI, period=0.05, start_ns=0
        )
    """

    def __init__(
        self,
        bag: BagWriter | BackgroundWriter,
        *,
        X_BSs: Mapping[str, RigidTransform | None],
        X_BI: RigidTransform | None = None,
        cameras: Mapping[str, RecordedCamera] | None = None,
        period: float | None = None,
        schedule: Schedule | None = None,
        further: Mapping[str, RecordedSensor] | None = None,
        layouts: Mapping[str, str] | None = None,
        imu_variances: tuple[float, float] = (0.0, 0.0),
        with_imu_samples: bool = False,
        with_objects: bool = False,
        start_ns: int = 0,
    ):
        """Declares the ports and the schedule.

        Args:
            bag: a bag with the topics of `recording_topics`; it must be open at
                the first frame.
            X_BSs: LiDAR name -> pose of its frame S in B, None if it has no
                fixed place there.
            X_BI: pose of the imu frame I in B, None if it has none.
            cameras: camera name -> camera.
            period: time between frames [s], if all sensors share it.
            schedule: the ticks of each topic, by name, if they do not.
            further: name -> further sensor.
            layouts: LiDAR name -> layout of its points (see
                `point_layouts`), `cns` unless given.
            imu_variances: variances of specific force [m^2/s^4] and of
                angular velocity [rad^2/s^2].
            with_imu_samples: whether there is a port `imu_samples`.
            with_objects: whether there is a port `objects`.
            start_ns: the stamp of time zero [ns].

        Raises:
            ValueError: period and schedule are both given, or neither is.
        """
        super().__init__()
        self._bag = bag
        self._X_BCs = {name: X for name, X in X_BSs.items() if X is not None}
        if X_BI is not None:
            self._X_BCs[messages.IMU_FRAME] = X_BI
        self._X_BI = X_BI
        further = further or {}
        self._X_BCs |= {name: sensor.X_BC for name, sensor in further.items()}
        cameras = cameras or {}
        layouts = layouts or {}
        self._start_ns = start_ns
        # The tick of the last event; there was none so far.
        self._last_tick: int | None = None
        if (period is None) == (schedule is None):
            raise ValueError("a recorder needs either a period or a schedule")
        if period is not None:
            topics = recording_topics(
                X_BSs,
                camera_names=cameras,
                layouts=layouts,
                further=[sensor.topic for sensor in further.values()],
            )
            schedule = make_schedule({topic.name: period for topic in topics})
        assert schedule is not None
        self._schedule = schedule
        self._period = schedule.period

        # The order of the ports is that of these lines.
        self._motion = MotionPorts(self)
        self._imu = self._imu_samples = None
        if with_imu_samples:
            self._imu_samples = ImuSamplesPort(self, imu_variances)
        else:
            self._imu = ImuPorts(self, imu_variances)
        self._scenery: list[CameraPorts | ValuePort] = []
        if with_objects:
            self._scenery.append(objects_port(self))
        for name in X_BSs:
            layout = layouts.get(name, "cns")
            self._scenery.append(scan_port(self, name, layout))
        for name, X_BS in X_BSs.items():
            if X_BS is None:
                self._motion.add(self, name, RigidTransform())
        for name, camera in cameras.items():
            self._scenery.append(CameraPorts(self, name, camera))
            self._motion.add(self, name, camera.X_BC)
        for name, sensor in further.items():
            self._scenery.append(sensor_port(self, name, sensor))
        self.DeclareInitializationPublishEvent(publish=_warn_of_early_start)
        self._declare_events()
        self.DeclareForcedPublishEvent(self._publish)

    def _declare_events(self) -> None:
        """Declares an event for each tick that needs one."""
        waits = {IMU_TOPIC.name} if self._imu_samples is not None else set()
        steps = [
            step
            for name, step in self._schedule.steps.items()
            if name not in waits
        ]
        step = math.gcd(*steps)
        self.DeclarePeriodicPublishEvent(
            period_sec=float(self._schedule.tick * step),
            offset_sec=0.0,
            publish=self._publish,
        )
        end = self._schedule.ends.get(IMU_TOPIC.name, 0)
        if waits and end % step:
            # The last samples come after all else.
            self.DeclarePeriodicPublishEvent(
                period_sec=end * self._period,
                offset_sec=end * self._period,
                publish=self._publish,
            )

    def _publish(self, context: Context) -> EventStatus:
        tick = self._tick(context.get_time())
        stamp_ns = self._start_ns + self._schedule.time_ns(tick)
        due = set(self._schedule.due(tick))
        if self._X_BCs and self._last_tick is None:
            # Written at the first frame. A bag takes latched messages once: a
            # resumed one has this already.
            tf = messages.make_tf(messages.BASE_FRAME, self._X_BCs, stamp_ns)
            self._write(TF_STATIC_TOPIC, tf, stamp_ns, 0)
        outgoing: dict[Topic, Any] = {}
        if TF_TOPIC.name in due or ODOMETRY_TOPIC.name in due:
            outgoing |= self._motion.messages(context, stamp_ns)
        if IMU_TOPIC.name in due or self._imu_samples is not None:
            outgoing |= self._imu_messages(context, tick, stamp_ns)
        self._last_tick = tick
        for ports in self._scenery:
            if ports.due_topic.name in due:
                outgoing |= ports.messages(context, stamp_ns)
        for topic, message in outgoing.items():
            if topic.name in due:
                number = tick // self._schedule.steps[topic.name]
                self._write(topic, message, stamp_ns, number)
        return EventStatus.Succeeded()

    def _imu_messages(
        self, context: Context, tick: int, stamp_ns: int
    ) -> dict[Topic, Any]:
        """Writes samples of earlier ticks; returns the message of this one."""
        if self._imu is not None:
            R_WB = self._motion.orientation(context)
            R_WI = None
            if R_WB is not None and self._X_BI is not None:
                R_WI = R_WB @ self._X_BI.rotation()
            message = self._imu.message(context, R_WI, stamp_ns)
            return {} if message is None else {IMU_TOPIC: message}
        assert self._imu_samples is not None
        since = tick - 1 if self._last_tick is None else self._last_tick
        outgoing = {}
        for number, sample_ns, message in self._imu_samples.messages(
            context, self._schedule, since, tick, self._start_ns
        ):
            if number * self._schedule.steps[IMU_TOPIC.name] == tick:
                outgoing[IMU_TOPIC] = message
            else:
                self._write(IMU_TOPIC, message, sample_ns, number)
        return outgoing

    def _write(
        self, topic: Topic, message: Any, stamp_ns: int, sequence: int
    ) -> None:
        data = message
        if not isinstance(message, bytes):
            data = ros_types.serialize(message)
        self._bag.write(topic.name, stamp_ns, data, sequence)

    def _tick(self, time: float) -> int:
        ticks = time / self._period
        if abs(ticks - round(ticks)) > _TICK_TOLERANCE:
            raise ValueError(
                f"time {time} s is no multiple of the period {self._period} s"
            )
        if round(ticks) < 0:
            raise ValueError(f"time {time} s: a recording starts at time zero")
        return round(ticks)


def _warn_of_early_start(context: Context) -> EventStatus:
    time = context.get_time()
    if time < 0.0:
        warnings.warn(
            f"the simulation starts at {time:g} s: nothing is recorded before "
            "time zero",
            stacklevel=2,
        )
    return EventStatus.Succeeded()
