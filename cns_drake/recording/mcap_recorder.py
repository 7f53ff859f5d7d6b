"""Recording the sensors of a Diagram as ROS 2 messages."""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import Any, NamedTuple
import warnings

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    Context,
    EventStatus,
    InputPort,
    LeafSystem,
)
from pydrake.systems.sensors import (
    CameraInfo,
    ImageDepth32F,
    ImageLabel16I,
    ImageRgba8U,
)

from cns_drake.base.recordings import ros_types
from cns_drake.base.recordings.point_layouts import to_labels, to_layout
from cns_drake.recording import messages
from cns_drake.recording.background_writer import BackgroundWriter
from cns_drake.recording.bag_writer import BagWriter
from cns_drake.recording.image_messages import (
    ENCODINGS,
    make_camera_info,
    make_image,
)
from cns_drake.recording.imu_messages import ImuMessages
from cns_drake.recording.object_messages import (
    BoxMessages,
    marked_boxes,
    marked_detections,
    motion_table,
)
from cns_drake.recording.recorded_topics import (
    BOXES_TOPIC,
    IMU_TOPIC,
    MOTION_TOPIC,
    OBJECTS_TOPIC,
    ODOMETRY_TOPIC,
    TF_STATIC_TOPIC,
    TF_TOPIC,
    camera_info_topic,
    image_topic,
    labels_topic,
    points_topic,
    recording_topics,
)
from cns_drake.recording.rosbag2_metadata import Topic
from cns_drake.recording.schedule import Schedule, make_schedule

# Events of a periodic schedule come at multiples of the period. Their times
# differ from a tick's only by rounding, at most this [ticks].
_TICK_TOLERANCE = 1e-3

_IMAGES = {
    "color": ImageRgba8U,
    "depth": ImageDepth32F,
    "label": ImageLabel16I,
}


class RecordedCamera(NamedTuple):
    """A camera of a recording.

    Attributes:
        info: its intrinsics.
        X_BC: pose of its optical frame C (z ahead, y down) in the sensor's
            frame B, whose pose is on the port `<camera>_pose`.
    """

    info: CameraInfo
    X_BC: RigidTransform


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
            layouts: LiDAR name -> layout of its points (see
                `point_layouts`), `cns` unless given.
            imu_variances: of specific force [m^2/s^4] and angular velocity
                [rad^2/s^2].
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
        self._cameras = dict(cameras or {})
        self._layouts = dict(layouts or {})
        self._imu_messages = ImuMessages(imu_variances)
        self._start_ns = start_ns
        # The tick of the last event; there was none so far.
        self._last_tick: int | None = None
        if (period is None) == (schedule is None):
            raise ValueError("a recorder needs either a period or a schedule")
        if period is not None:
            topics = recording_topics(
                X_BSs, camera_names=self._cameras, layouts=self._layouts
            )
            schedule = make_schedule({topic.name: period for topic in topics})
        assert schedule is not None
        self._schedule = schedule
        self._period = schedule.period

        self._odometry = self.DeclareAbstractInputPort(
            "odometry", Value(object())
        )
        self._samples = self._specific_force = self._angular_velocity = None
        if with_imu_samples:
            self._samples = self.DeclareAbstractInputPort(
                "imu_samples", Value(object())
            )
        else:
            self._specific_force = self.DeclareVectorInputPort(
                "specific_force", 3
            )
            self._angular_velocity = self.DeclareVectorInputPort(
                "angular_velocity", 3
            )
        self._objects = None
        if with_objects:
            self._objects = self.DeclareAbstractInputPort(
                "objects", Value(object())
            )
        self._detections = BoxMessages(marked_detections)
        self._boxes = BoxMessages(marked_boxes)
        self._scans = {
            name: self.DeclareAbstractInputPort(f"{name}_scan", Value(object()))
            for name in X_BSs
        }
        # Frame on the map -> the port with its pose, and the pose from there.
        self._poses = {
            name: (self._declare_pose(name), RigidTransform())
            for name, X_BS in X_BSs.items()
            if X_BS is None
        }
        self._images: dict[str, dict[str, InputPort]] = {}
        for name, camera in self._cameras.items():
            self._images[name] = {
                kind: self.DeclareAbstractInputPort(
                    f"{name}_{kind}", Value(image())
                )
                for kind, image in _IMAGES.items()
            }
            self._poses[name] = (self._declare_pose(name), camera.X_BC)
        self.DeclareInitializationPublishEvent(publish=_warn_of_early_start)
        self._declare_events()
        self.DeclareForcedPublishEvent(self._publish)

    def _declare_events(self) -> None:
        """Declares an event for each tick that needs one."""
        waits = {IMU_TOPIC.name} if self._samples is not None else set()
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

    def _declare_pose(self, name: str) -> InputPort:
        return self.DeclareAbstractInputPort(
            f"{name}_pose", Value(RigidTransform())
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
            outgoing |= self._locate(context, stamp_ns)
        if self._samples is not None:
            since = tick - 1 if self._last_tick is None else self._last_tick
            outgoing |= self._take_samples(context, since, tick)
        elif IMU_TOPIC.name in due:
            outgoing |= self._feel(context, stamp_ns)
        self._last_tick = tick
        if OBJECTS_TOPIC.name in due:
            outgoing |= self._list_objects(context, stamp_ns)
        for name in self._scans:
            if points_topic(name).name in due:
                outgoing |= self._scan(context, name, stamp_ns)
        for name in self._cameras:
            if camera_info_topic(name).name in due:
                outgoing |= self._photograph(context, name, stamp_ns)
        for topic, message in outgoing.items():
            if topic.name in due:
                number = tick // self._schedule.steps[topic.name]
                self._write(topic, message, stamp_ns, number)
        return EventStatus.Succeeded()

    def _locate(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the messages of poses: odometry and transforms."""
        outgoing = {}
        odometry = _eval(self._odometry, context)
        X_WCs = {
            name: port.Eval(context) @ X_PC
            for name, (port, X_PC) in self._poses.items()
            if port.HasValue(context)
        }
        if odometry is not None:
            X_WCs = {messages.BASE_FRAME: odometry.X_WB, **X_WCs}
        if X_WCs:
            outgoing[TF_TOPIC] = messages.make_tf(
                messages.MAP_FRAME, X_WCs, stamp_ns
            )
        if odometry is not None:
            outgoing[ODOMETRY_TOPIC] = messages.make_odometry(
                odometry.X_WB, odometry.V_WB_B, stamp_ns
            )
        return outgoing

    def _feel(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the message of the IMU, serialised."""
        angular_velocity = _eval(self._angular_velocity, context)
        specific_force = _eval(self._specific_force, context)
        if angular_velocity is None and specific_force is None:
            return {}
        quat_xyzw = None
        odometry = _eval(self._odometry, context)
        if odometry is not None and self._X_BI is not None:
            R_WI = odometry.X_WB.rotation() @ self._X_BI.rotation()
            quat_xyzw = messages.to_quat_xyzw(R_WI)
        values = (quat_xyzw, angular_velocity, specific_force)
        quats, turns, forces = (
            None if value is None else np.array([value]) for value in values
        )
        (message,) = self._imu_messages.encode(quats, turns, forces, [stamp_ns])
        return {IMU_TOPIC: message}

    def _take_samples(
        self, context: Context, since: int, tick: int
    ) -> dict[Topic, Any]:
        """Writes the IMU's samples of earlier ticks.

        Args:
            context: of the event.
            since: the last tick whose sample is written.
            tick: that of the event.

        Returns:
            The message of this tick, if it has one.

        Raises:
            ValueError: the port shows too few samples.
        """
        step = self._schedule.steps[IMU_TOPIC.name]
        last = min(tick, self._schedule.ends.get(IMU_TOPIC.name, tick))
        numbers = range(since // step + 1, last // step + 1)
        samples = _eval(self._samples, context)
        if samples is None or not numbers:
            return {}
        first = numbers[0] - samples.first
        if first < 0:
            raise ValueError("imu_samples: the oldest samples are missing")
        rows = slice(first, first + len(numbers))
        stamps_ns = [
            self._start_ns + self._schedule.time_ns(number * step)
            for number in numbers
        ]
        packed = self._imu_messages.encode(
            samples.quat_xyzw[rows],
            samples.angular_velocity[rows],
            samples.specific_force[rows],
            stamps_ns,
        )
        outgoing = {}
        for number, stamp_ns, message in zip(
            numbers, stamps_ns, packed, strict=True
        ):
            if number * step == tick:
                outgoing[IMU_TOPIC] = message
            else:
                self._write(IMU_TOPIC, message, stamp_ns, number)
        return outgoing

    def _list_objects(
        self, context: Context, stamp_ns: int
    ) -> dict[Topic, Any]:
        """Returns the messages of moving objects."""
        objects = _eval(self._objects, context)
        if objects is None:
            return {}
        return {
            OBJECTS_TOPIC: self._detections.encode(objects, stamp_ns),
            BOXES_TOPIC: self._boxes.encode(objects, stamp_ns),
            MOTION_TOPIC: messages.make_point_cloud(
                motion_table(objects), messages.MAP_FRAME, stamp_ns
            ),
        }

    def _scan(
        self, context: Context, name: str, stamp_ns: int
    ) -> dict[Topic, Any]:
        """Returns the messages of a LiDAR."""
        scan = _eval(self._scans[name], context)
        if scan is None:
            return {}
        layout = self._layouts.get(name, "cns")
        outgoing = {
            points_topic(name): messages.make_point_cloud(
                to_layout(scan, layout), name, stamp_ns
            )
        }
        if layout != "cns":
            outgoing[labels_topic(name)] = messages.make_point_cloud(
                to_labels(scan), name, stamp_ns
            )
        return outgoing

    def _photograph(
        self, context: Context, name: str, stamp_ns: int
    ) -> dict[Topic, Any]:
        """Returns the messages of a camera."""
        outgoing = {}
        for kind, port in self._images[name].items():
            image = _eval(port, context)
            if image is not None:
                outgoing[image_topic(name, kind)] = make_image(
                    image.data, ENCODINGS[kind], name, stamp_ns
                )
        if outgoing:
            outgoing[camera_info_topic(name)] = make_camera_info(
                self._cameras[name].info, name, stamp_ns
            )
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


def _eval(port: InputPort | None, context: Context) -> Any:
    """Returns the value of an input; None if it is not connected."""
    if port is None or not port.HasValue(context):
        return None
    return port.Eval(context)
