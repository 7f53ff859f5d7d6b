"""Recording the sensors of a Diagram as ROS 2 messages."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
import functools
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

from cns_drake.recording import messages, object_messages, recorded_topics
from cns_drake.recording.bag_writer import BagWriter
from cns_drake.recording.messages import encode_point_cloud
from cns_drake.recording.recorded_topics import (
    IMU_TOPIC,
    ODOMETRY_TOPIC,
    TF_STATIC_TOPIC,
    TF_TOPIC,
)
from cns_drake.recording.rosbag2_metadata import Topic
from cns_drake.recording.schedule import Schedule, make_schedule
from cns_drake.scene import (
    nearest_ns,
    optional_value,
    shortly_before,
    starts_late,
)
from evaluation.drives import (
    BASE_FRAME,
    IMU_FRAME,
    MAP_FRAME,
    LayoutName,
    check_sensor_names,
    serialize,
    to_labels,
    to_layout,
)

_IMAGES = {"color": ImageRgba8U, "depth": ImageDepth32F, "label": ImageLabel16I}


class RecordedCamera(NamedTuple):
    """A camera of a recording, with its intrinsics.

    X_BC is the pose of the camera's optical frame C (z ahead, y down) in the
    frame B of Drake's RgbdSensor. The pose of B is on the port `<camera>_pose`.

    Attributes:
        info: intrinsics as Drake describes them.
        X_BC: pose of C in B.
        depth: camera of the depth images, if its intrinsics or pose differ from
            the colour camera's. Depth images then have the frame
            `<camera>_depth`, and intrinsics on the topic
            `/<camera>/depth/camera_info`.
    """

    info: CameraInfo
    X_BC: RigidTransform
    depth: RecordedCamera | None = None


class RecordedSensor(NamedTuple):
    """A sensor of a user-defined kind, whose name is also its port's name.

    Attributes:
        topic: topic of the sensor's messages.
        X_BC: pose of the sensor's frame C in the vehicle's frame B.
        make_message: function that returns a message, given the value of the
            port, the name of the frame C and the time [ns].
        frame: name of the frame C; by default the name of the sensor.
        example: a value of the port's type, needed if this type is not a Python
            object.
    """

    topic: Topic
    X_BC: RigidTransform
    make_message: Callable[[Any, str, int], Any]
    frame: str | None = None
    example: Any = None


def depth_frame(camera_name: str) -> str:
    """Returns the frame's name for depth images that have their own pose."""
    return f"{camera_name}_depth"


# Number of batches that may wait to be written: about two frames with one LiDAR
# and traffic, so that a frame does not wait for the frame before. A batch is a
# large message with the small messages before it.
_MOST_WAITING = 8
# Messages with fewer bytes wait for the next large message: handing a small
# message over takes longer than making it.
_SMALL_BYTES = 1024
# At most this many small messages wait.
_MOST_HELD = 64


class BackgroundWriter:
    """A context manager that writes messages to a BagWriter in a thread.

    Messages are written in order. Leaving the context waits until all messages
    are written; leaving the context by an exception drops the messages that are
    still waiting. If writing fails, nothing more is written, and the error is
    raised by a later `write` or on leaving.
    """

    def __init__(self, write: Callable[..., None]):
        """Prepares the writer.

        Args:
            write: function that writes a message, such as `BagWriter.write`. It
                is called in a second thread.
        """
        self._write = write
        self._thread = ThreadPoolExecutor(1)
        self._batches: deque[Future] = deque()
        self._held: list[tuple[Any, ...]] = []

    def __enter__(self) -> BackgroundWriter:
        return self

    def __exit__(self, exception_type: type | None, *_: object) -> None:
        try:
            if exception_type is None:
                self._submit_held(0)
        finally:
            self._thread.shutdown(cancel_futures=True)

    def write(self, *message: Any) -> None:
        """Queues a message for writing; waits while too many are queued.

        Args:
            message: arguments for the function `write` that was given to the
                constructor, such as the arguments of `BagWriter.write`.

        Raises:
            Exception: the error that occurred while an earlier message was
                written.
        """
        self._held.append(message)
        size = sum([len(part) for part in message if isinstance(part, bytes)])
        if not 0 < size < _SMALL_BYTES or len(self._held) >= _MOST_HELD:
            self._submit_held(_MOST_WAITING)

    def _submit_held(self, waiting: int) -> None:
        """Queues held messages, and waits until `waiting` batches are left."""
        before = self._batches[-1] if self._batches else None
        self._batches.append(
            self._thread.submit(self._write_batch, self._held, before)
        )
        self._held = []
        while len(self._batches) > waiting:
            self._batches.popleft().result()

    def _write_batch(self, batch: list[tuple], before: Future | None) -> None:
        if before is not None:
            before.result()  # If the batch before failed, this one fails, too.
        for message in batch:
            self._write(*message)


class McapRecorder(LeafSystem):
    """Writes each frame's sensor outputs to a BagWriter.

    .. pydrake_system::

        name: McapRecorder
        input_ports:
        - odometry
        - specific_force
        - angular_velocity
        - imu_samples (instead of specific_force and angular_velocity)
        - objects (if it is declared)
        - <lidar>_scan (one for each LiDAR)
        - <lidar>_pose (for each LiDAR that is not fixed on B)
        - <lidar>_time (for each discrete LiDAR)
        - <camera>_color (one for each camera)
        - <camera>_depth
        - <camera>_label
        - <camera>_pose
        - <sensor> (one for each sensor of another kind)

    Frames: map W, vehicle B (`base_link`), imu I, LiDAR S, camera C.

    - `odometry`: abstract, an object with `X_WB` (RigidTransform) and
      `V_WB_B` (SpatialVelocity expressed in B).
    - `specific_force`: of I, expressed in I, vector of size 3 [m/s^2].
    - `angular_velocity`: w_WI_I, vector of size 3 [rad/s].
    - `imu_samples`: abstract, `ImuSamples`, the latest samples up to the
      current time. Without this port, the orientation of I comes from the
      odometry.
    - `objects`: abstract, `RecordedObjects`.
    - `<lidar>_scan`: abstract, structured array of points expressed in S.
    - `<lidar>_pose`: abstract, X_WS.
    - `<lidar>_time`: time of the scan, vector of size 1 [s].
    - `<camera>_color`, `_depth`, `_label`: images as Drake's RgbdSensor gives
      them; `<camera>_pose`: abstract, the pose of that sensor.

    Ports that are not connected are not recorded.

    Messages are due at ticks; tick i is at the time i * period of the schedule.
    At a tick, from time zero on, a periodic publish event writes all messages
    that are due, from the current inputs. The samples on a port `imu_samples`
    need no events of their own: each event writes all samples since the last
    event. A simulation that starts before time zero causes a warning. A forced
    publish writes nothing.

    A discrete LiDAR has events of its own. One writes the odometry at the time
    of a scan, so that it has the state that the scan has seen; a message that
    is due with the same stamp is left out. Another writes the scan that is on
    the port, with its own time and pose, at most once.

    Connect all other inputs directly to continuous outputs. A publish event
    sees the state before any update at the same time. With a zero-order hold
    between output and input, every message would therefore be one period old.

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
        discrete: Mapping[str, tuple[float, float, float]] | None = None,
        further: Mapping[str, RecordedSensor] | None = None,
        layouts: Mapping[str, LayoutName] | None = None,
        num_rings: Mapping[str, int] | None = None,
        calibrated: Mapping[str, str] | None = None,
        imu_variances: tuple[float, float] = (0.0, 0.0),
        with_imu_samples: bool = False,
        with_objects: bool = False,
        start_ns: int = 0,
        has_steps: bool = False,
    ):
        """Declares the ports and the schedule.

        Args:
            bag: a bag with the topics of `recording_topics`; it must be open at
                the first frame.
            X_BSs: LiDAR name -> pose of its frame S in B. None for a LiDAR that
                is not fixed on B.
            X_BI: pose of the IMU frame I in B; None without an IMU.
            cameras: camera name -> camera.
            period: time between frames [s], if all topics share it. Give either
                `period` or `schedule`.
            schedule: times of the messages, with a stream for each topic, if
                topics have rates of their own.
            discrete: name of a discrete LiDAR -> period and offset of its
                scans, and their delay [s]. The schedule does not have its
                topic.
            further: name -> further sensor.
            layouts: LiDAR name -> name of the layout of its recorded points; by
                default `cns`.
            num_rings: LiDAR name -> number of its rings. For a LiDAR in this
                mapping, the layout `velodyne` counts rings from the lowest
                ring.
            calibrated: name -> reported echoes (such as `dual`), of the LiDARs
                with calibrated intensities, which are from 0 to 255.
            imu_variances: variances of specific force [m^2/s^4] and of
                angular velocity [rad^2/s^2].
            with_imu_samples: whether there is a port `imu_samples`.
            with_objects: whether there is a port `objects`.
            start_ns: the stamp of time zero [ns].
            has_steps: whether the Diagram can have a plant with a step. The
                events then come shortly before their times, see
                `cns_drake.scene.shortly_before`.

        Raises:
            ValueError: period and schedule are both given, or neither is; or
                names of sensors are not unique, or cannot be parts of ROS 2
                topics.
        """
        super().__init__()
        cameras, further, layouts = cameras or {}, further or {}, layouts or {}
        calibrated = calibrated or {}
        discrete = discrete or {}
        _check_frames(X_BSs, cameras, further)
        if (period is None) == (schedule is None):
            raise ValueError("a recorder needs either a period or a schedule")
        if schedule is None:
            assert period is not None
            topics = _recorded_topics(X_BSs, cameras, further, layouts)
            schedule = make_schedule({topic.name: period for topic in topics})
        self._schedule = schedule
        self._has_steps = has_steps
        self._is_discrete = bool(discrete)
        self._bag = bag
        self._start_ns = start_ns
        self._X_BI = None if X_BI is None else RigidTransform(X_BI)
        self._imu_variances = imu_variances
        self._X_BCs = _fixed_poses(X_BSs, X_BI, further)
        # Frame C that moves in the map -> the port with the pose of a frame P,
        # and the pose X_PC. Several frames may share a port.
        self._poses: dict[str, tuple[InputPort, RigidTransform]] = {}
        # Discrete LiDAR that moves in the map -> the port with the pose of its
        # scan, which is written with the stamp of the scan alone.
        self._held_poses: dict[str, InputPort] = {}
        # A topic, and a function that makes all messages that are due with it.
        self._streams: list[
            tuple[Topic, Callable[[Context, int], dict[Topic, Any]]]
        ] = []
        # Period, first time and function of the events of discrete LiDARs.
        self._discrete_events: list[
            tuple[float, float, Callable[[Context, int], EventStatus]]
        ] = []
        # The tick of the last event; None before the first event.
        self._last_tick: int | None = None
        # Topic -> sequence number and stamp [ns] of its last message.
        self._written: dict[str, tuple[int, int]] = {}

        # The following lines determine the order of the ports.
        self._odometry = self._declare_port("odometry", object())
        self._declare_imu_ports(with_imu_samples=with_imu_samples)
        if with_objects:
            self._add_objects_port()
        for name in X_BSs:
            convert = functools.partial(
                to_layout,
                layout=layouts.get(name, "cns"),
                num_rings=(num_rings or {}).get(name),
                is_calibrated=name in calibrated,
                echoes=calibrated.get(name, "strongest"),
            )
            self._add_scan_port(name, convert, discrete.get(name))
        for name, X_BS in X_BSs.items():
            if X_BS is None:
                port = self._declare_pose_port(name)
                if name in discrete:
                    self._held_poses[name] = port
                else:
                    self._poses[name] = port, RigidTransform()
        for name, camera in cameras.items():
            self._add_camera_ports(name, camera)
        for name, sensor in further.items():
            self._add_sensor_port(name, sensor)
        self.DeclareInitializationPublishEvent(publish=self._start)
        self._declare_events()

    def _declare_port(self, name: str, example: object) -> InputPort:
        """Declares an abstract port for values of the same type as `example`.

        If `example` is an `object()`, values can have any type.

        Raises:
            ValueError: there is a port with this name.
        """
        if self.HasInputPort(name):
            raise ValueError(f"name: two sensors would have the port '{name}'")
        return self.DeclareAbstractInputPort(name, Value(example))

    def _declare_imu_ports(self, *, with_imu_samples: bool) -> None:
        self._imu_samples: InputPort | None = None
        if with_imu_samples:
            self._imu_samples = self._declare_port("imu_samples", object())
        else:
            self._specific_force, self._angular_velocity = (
                self.DeclareVectorInputPort(name, 3)
                for name in ("specific_force", "angular_velocity")
            )

    def _declare_pose_port(self, name: str) -> InputPort:
        return self._declare_port(f"{name}_pose", RigidTransform())

    def _add_port(
        self,
        name: str,
        topic: Topic,
        make: Callable[[Any, int], dict],
        example: object = None,
    ) -> None:
        """Declares a port whose values are recorded.

        Args:
            topic: the topic that is due when messages are made.
            make: function that returns topic -> message, given the value of the
                port and the time [ns].
            example: a value of the port's type; None for any Python object.
        """
        port = self._declare_port(
            name, object() if example is None else example
        )

        def make_all(context: Context, stamp_ns: int) -> dict[Topic, Any]:
            value = optional_value(port, context)
            return {} if value is None else make(value, stamp_ns)

        self._streams.append((topic, make_all))

    def _add_camera_ports(self, name: str, camera: RecordedCamera) -> None:
        self._add_image_ports(name, camera)
        port = self._declare_pose_port(name)
        self._poses[name] = port, camera.X_BC
        if camera.depth is not None:
            self._poses[depth_frame(name)] = port, camera.depth.X_BC

    def _add_objects_port(self) -> None:
        detections = object_messages.BoxMessages(
            object_messages.marked_detections
        )
        boxes = object_messages.BoxMessages(object_messages.marked_boxes)

        def make(objects: object_messages.RecordedObjects, ns: int) -> dict:
            table = object_messages.motion_table(objects)
            return {
                recorded_topics.OBJECTS_TOPIC: detections.encode(objects, ns),
                recorded_topics.BOXES_TOPIC: boxes.encode(objects, ns),
                recorded_topics.MOTION_TOPIC: encode_point_cloud(
                    table, MAP_FRAME, ns
                ),
            }

        self._add_port("objects", recorded_topics.OBJECTS_TOPIC, make)

    def _add_scan_port(
        self,
        name: str,
        convert: Callable[[np.ndarray], np.ndarray],
        samples: tuple[float, float, float] | None,
    ) -> None:
        topic = recorded_topics.points_topic(name)

        def make(scan: np.ndarray, stamp_ns: int) -> dict:
            points = convert(scan)
            made = {topic: encode_point_cloud(points, name, stamp_ns)}
            if points is not scan:
                labels = encode_point_cloud(to_labels(scan), name, stamp_ns)
                made[recorded_topics.labels_topic(name)] = labels
            return made

        if samples is None:
            self._add_port(f"{name}_scan", topic, make)
        else:
            self._add_discrete_port(name, make, *samples)

    def _add_discrete_port(
        self,
        name: str,
        make: Callable[[np.ndarray, int], dict[Topic, Any]],
        period: float,
        offset: float,
        delay: float,
    ) -> None:
        """Declares the ports and the events of a discrete LiDAR.

        Args:
            make: function that returns topic -> message, given a scan and its
                stamp [ns].
            period: time between two scans [s].
            offset: time of the first periodic scan [s].
            delay: time from a scan to its appearance on the port [s].
        """
        scan = self._declare_port(f"{name}_scan", object())
        scan_time = self.DeclareVectorInputPort(f"{name}_time", 1)

        def write_motion(context: Context, times: int = 1) -> EventStatus:
            stamp_ns = self._start_ns + nearest_ns(context.get_time(), times)
            self._write_fixed_poses(stamp_ns)
            self._write_new(self._motion_messages(context, stamp_ns), stamp_ns)
            return EventStatus.Succeeded()

        def write_scan(context: Context, times: int = 1) -> EventStatus:
            if not np.isfinite(scan_time.Eval(context)[0]):
                return EventStatus.DidNothing()
            stamp_ns = self._start_ns + nearest_ns(scan_time.Eval(context)[0])
            if not self._is_new(recorded_topics.points_topic(name), stamp_ns):
                return EventStatus.DidNothing()
            for topic, message in make(scan.Eval(context), stamp_ns).items():
                self._write_message(topic, message, stamp_ns)
            return EventStatus.Succeeded()

        for time, publish in (
            (offset, write_motion),
            (offset + delay, write_scan),
        ):
            self.DeclarePeriodicPublishEvent(
                shortly_before(period), shortly_before(time), publish
            )
            self._discrete_events.append((period, time, publish))

    def _add_sensor_port(self, name: str, sensor: RecordedSensor) -> None:
        self._add_port(
            name,
            sensor.topic,
            lambda value, stamp_ns: {
                sensor.topic: sensor.make_message(
                    value, sensor.frame or name, stamp_ns
                )
            },
            sensor.example,
        )

    def _add_image_ports(self, name: str, camera: RecordedCamera) -> None:
        def make(kind: str, image: Any, stamp_ns: int) -> dict:
            info, frame = camera.info, name
            info_topic = recorded_topics.camera_topic(name, "camera_info")
            if kind == "depth" and camera.depth is not None:
                info, frame = camera.depth.info, depth_frame(name)
                info_topic = recorded_topics.depth_info_topic(name)
            return {
                recorded_topics.camera_topic(name, kind): messages.make_image(
                    image.data, messages.ENCODINGS[kind], frame, stamp_ns
                ),
                info_topic: messages.make_camera_info(info, frame, stamp_ns),
            }

        for kind, image in _IMAGES.items():
            topic = recorded_topics.camera_topic(name, kind)
            port = f"{name}_{kind}"
            self._add_port(port, topic, functools.partial(make, kind), image())

    def _declare_events(self) -> None:
        """Declares an event for each tick that needs one."""
        waits = {IMU_TOPIC.name} if self._imu_samples is not None else set()
        steps = self._schedule.steps
        step = math.gcd(*(steps[name] for name in steps if name not in waits))
        if not step:
            return  # Discrete LiDARs alone.
        period = float(self._schedule.exact_period * step)
        self.DeclarePeriodicPublishEvent(
            period_sec=shortly_before(period) if self._has_steps else period,
            offset_sec=0.0,
            publish=self._write_due_messages,
        )
        end = self._schedule.ends.get(IMU_TOPIC.name, 0)
        if waits and end % step:
            # The last samples come after all other messages.
            self.DeclarePeriodicPublishEvent(
                period_sec=end * self._schedule.period,
                offset_sec=end * self._schedule.period,
                publish=self._write_due_messages,
            )

    def _start(self, context: Context) -> EventStatus:
        """Warns of an early start; writes what the first event was due for."""
        # Of a simulation that begins again, the bag refuses what is there.
        self._written = {t: (n, -1) for t, (n, _) in self._written.items()}
        time, period = context.get_time(), self._schedule.period
        if time < 0.0:
            warnings.warn(
                f"the simulation starts at {time:g} s: nothing is recorded "
                "before time zero",
                stacklevel=2,
            )
        # The events of this time would have come shortly before it.
        for own, offset, publish in self._discrete_events:
            if starts_late(time, own, offset):
                publish(context, 0)
        if self._has_steps and period and starts_late(time, period, 0.0):
            self._write_due_messages(context)
        return EventStatus.Succeeded()

    def _write_due_messages(self, context: Context) -> EventStatus:
        # The event's time differs from a tick's only by rounding.
        tick = round(context.get_time() / self._schedule.period)
        stamp_ns = self._start_ns + self._schedule.time_ns(tick)
        due = set(self._schedule.due(tick))
        self._write_fixed_poses(stamp_ns)
        outgoing: dict[Topic, Any] = {}
        if TF_TOPIC.name in due or ODOMETRY_TOPIC.name in due:
            outgoing |= self._motion_messages(context, stamp_ns)
        if self._imu_samples is not None:
            outgoing |= self._write_imu_samples(context, tick)
        elif IMU_TOPIC.name in due:
            outgoing |= self._imu_message(context, stamp_ns)
        self._last_tick = tick
        for topic, make in self._streams:
            if topic.name in due:
                outgoing |= make(context, stamp_ns)
        self._write_new(
            {t: made for t, made in outgoing.items() if t.name in due},
            stamp_ns,
            tick,
        )
        return EventStatus.Succeeded()

    def _write_fixed_poses(self, stamp_ns: int) -> None:
        """Writes the poses of fixed sensors before all other messages."""
        if self._X_BCs and not self._written:
            tf = messages.make_tf(BASE_FRAME, self._X_BCs, stamp_ns)
            self._write_message(TF_STATIC_TOPIC, tf, stamp_ns)

    def _motion_messages(
        self, context: Context, stamp_ns: int
    ) -> dict[Topic, Any]:
        """Returns the messages of odometry and transforms."""
        odometry = optional_value(self._odometry, context)
        X_WCs, made = {}, {}
        if odometry is not None:
            X_WCs[BASE_FRAME] = odometry.X_WB
            made[ODOMETRY_TOPIC] = messages.make_odometry(
                odometry.X_WB, odometry.V_WB_B, stamp_ns
            )
        for name, (port, X_PC) in self._poses.items():
            X_WP = optional_value(port, context)
            if X_WP is not None:
                X_WCs[name] = X_WP @ X_PC
        for name, port in self._held_poses.items():
            (time,) = self.GetInputPort(f"{name}_time").Eval(context)
            if (
                self._start_ns + nearest_ns(np.nan_to_num(time, nan=-1.0))
                == stamp_ns
            ):
                X_WCs[name] = port.Eval(context)
        if X_WCs:
            tf = messages.make_tf(MAP_FRAME, X_WCs, stamp_ns)
            return {TF_TOPIC: tf, **made}
        return made

    def _imu_message(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the message of the IMU's present values, by topic."""
        rate = optional_value(self._angular_velocity, context)
        force = optional_value(self._specific_force, context)
        if rate is None and force is None:
            return {}
        odometry = optional_value(self._odometry, context)
        quat_xyzw = None
        if odometry is not None and self._X_BI is not None:
            R_WI = odometry.X_WB.rotation() @ self._X_BI.rotation()
            quat_xyzw = messages.to_quat_xyzw(R_WI)
        message = messages.make_imu(
            quat_xyzw, rate, force, stamp_ns, self._imu_variances
        )
        return {IMU_TOPIC: message}

    def _write_imu_samples(
        self, context: Context, tick: int
    ) -> dict[Topic, Any]:
        """Writes samples of earlier ticks; returns the message of this tick.

        Raises:
            ValueError: the port shows too few samples.
        """
        step = self._schedule.steps[IMU_TOPIC.name]
        last = min(tick, self._schedule.ends.get(IMU_TOPIC.name, tick))
        since = tick - 1 if self._last_tick is None else self._last_tick
        numbers = range(since // step + 1, last // step + 1)
        assert self._imu_samples is not None
        samples = optional_value(self._imu_samples, context)
        if samples is None or not numbers:
            return {}
        if numbers[0] < samples.first:
            raise ValueError("imu_samples: the oldest samples are missing")
        made = {}
        for number in numbers:
            row = number - samples.first
            stamp_ns = self._start_ns + self._schedule.time_ns(number * step)
            message = messages.make_imu(
                samples.quat_xyzw[row],
                samples.angular_velocity[row],
                samples.specific_force[row],
                stamp_ns,
                self._imu_variances,
            )
            if number * step == tick:
                made[IMU_TOPIC] = message
            else:
                self._write_message(IMU_TOPIC, message, stamp_ns, number)
        return made

    def _write_new(
        self,
        made: Mapping[Topic, Any],
        stamp_ns: int,
        tick: int | None = None,
    ) -> None:
        """Writes messages, unless their topics have one with this stamp."""
        for topic, message in made.items():
            if self._is_new(topic, stamp_ns):
                number = None
                if tick is not None and not self._is_discrete:
                    number = tick // self._schedule.steps[topic.name]
                self._write_message(topic, message, stamp_ns, number)

    def _is_new(self, topic: Topic, stamp_ns: int) -> bool:
        """Returns whether the last message of a topic has another stamp."""
        return self._written.get(topic.name, (0, -1))[1] != stamp_ns

    def _write_message(
        self,
        topic: Topic,
        message: Any,
        stamp_ns: int,
        sequence: int | None = None,
    ) -> None:
        """Writes a message; by default, it has the next sequence number."""
        if not isinstance(message, bytes):
            message = serialize(message)
        if sequence is None:
            sequence = self._written.get(topic.name, (-1, -1))[0] + 1
        self._bag.write(topic.name, stamp_ns, message, sequence)
        self._written[topic.name] = sequence, stamp_ns


def _check_frames(
    X_BSs: Mapping[str, RigidTransform | None],
    cameras: Mapping[str, RecordedCamera],
    further: Mapping[str, RecordedSensor],
) -> None:
    """Checks that the sensors' frames can all be parts of one recording.

    Raises:
        ValueError: names are not unique, or cannot be parts of ROS 2 topics.
    """
    check_sensor_names(
        (
            *X_BSs,
            *cameras,
            *map(depth_frame, _with_own_depth(cameras)),
            # Further sensors may share a frame.
            *dict.fromkeys(s.frame or n for n, s in further.items()),
        )
    )


def _recorded_topics(
    X_BSs: Mapping[str, RigidTransform | None],
    cameras: Mapping[str, RecordedCamera],
    further: Mapping[str, RecordedSensor],
    layouts: Mapping[str, LayoutName],
) -> tuple[Topic, ...]:
    return recorded_topics.recording_topics(
        X_BSs,
        camera_names=cameras,
        layouts=layouts,
        further=[sensor.topic for sensor in further.values()],
        depth_camera_names=_with_own_depth(cameras),
    )


def _with_own_depth(cameras: Mapping[str, RecordedCamera]) -> list[str]:
    """Returns the names of cameras whose depth images have their own frame."""
    return [name for name, camera in cameras.items() if camera.depth]


def _fixed_poses(
    X_BSs: Mapping[str, RigidTransform | None],
    X_BI: RigidTransform | None,
    further: Mapping[str, RecordedSensor],
) -> dict[str, RigidTransform]:
    """Returns the poses on the vehicle of all fixed sensors, by frame name.

    Args:
        X_BSs: LiDAR name -> pose of its frame; None if it is not fixed.
        X_BI: pose of the IMU; None without an IMU.
        further: name -> further sensor.
    """
    X_BCs = {
        **X_BSs,
        **({} if X_BI is None else {IMU_FRAME: X_BI}),
        **{s.frame or n: s.X_BC for n, s in further.items()},
    }
    return {
        name: RigidTransform(X) for name, X in X_BCs.items() if X is not None
    }
