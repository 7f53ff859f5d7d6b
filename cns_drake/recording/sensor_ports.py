"""The recorder's ports of sensors, and their messages."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, InputPort, LeafSystem
from pydrake.systems.sensors import (
    CameraInfo,
    ImageDepth32F,
    ImageLabel16I,
    ImageRgba8U,
)

from cns_drake.base.drives.point_layouts import to_labels, to_layout
from cns_drake.recording import messages
from cns_drake.recording.messages import ENCODINGS, make_camera_info, make_image
from cns_drake.recording.object_messages import (
    BoxMessages,
    RecordedObjects,
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
    TF_TOPIC,
    camera_info_topic,
    image_topic,
    labels_topic,
    points_topic,
)
from cns_drake.recording.rosbag2_metadata import Topic
from cns_drake.recording.schedule import Schedule


def declare_object(system: LeafSystem, name: str) -> InputPort:
    """Declares an abstract port that takes any Python object."""
    return system.DeclareAbstractInputPort(name, Value(object()))


def value_of(port: InputPort, context: Context) -> Any:
    """Returns the value of a port; None if it is not connected."""
    return port.Eval(context) if port.HasValue(context) else None


class MotionPorts:
    """The port `odometry`, and a port for each moving frame of a sensor."""

    def __init__(self, system: LeafSystem):
        """Declares the port `odometry`."""
        self._odometry = declare_object(system, "odometry")
        # Frame on the map -> the port with its pose, and the pose from there.
        self._poses: dict[str, tuple[InputPort, RigidTransform]] = {}

    def add(self, system: LeafSystem, name: str, X_PC: RigidTransform) -> None:
        """Declares the port `<name>_pose`.

        Args:
            X_PC: pose of C in the frame P whose pose the port has.
        """
        port = system.DeclareAbstractInputPort(
            f"{name}_pose", Value(RigidTransform())
        )
        self._poses[name] = (port, X_PC)

    def orientation(self, context: Context) -> RotationMatrix | None:
        """Returns R_WB of the vehicle; None if it is not known."""
        odometry = value_of(self._odometry, context)
        return None if odometry is None else odometry.X_WB.rotation()

    def messages(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the messages of odometry and transforms."""
        outgoing = {}
        odometry = value_of(self._odometry, context)
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


class ImuPorts:
    """Ports of the present sample: `specific_force`, `angular_velocity`."""

    def __init__(self, system: LeafSystem, variances: tuple[float, float]):
        """Declares the ports; for the variances see `make_imu`."""
        self._specific_force = system.DeclareVectorInputPort(
            "specific_force", 3
        )
        self._angular_velocity = system.DeclareVectorInputPort(
            "angular_velocity", 3
        )
        self._variances = variances

    def message(
        self, context: Context, R_WI: RotationMatrix | None, stamp_ns: int
    ) -> Any | None:
        """Returns the message; None if no port is connected.

        Args:
            R_WI: orientation of the imu frame I; None if it is not known.
            stamp_ns: time of the message [ns].
        """
        angular_velocity = value_of(self._angular_velocity, context)
        specific_force = value_of(self._specific_force, context)
        if angular_velocity is None and specific_force is None:
            return None
        quat_xyzw = None if R_WI is None else messages.to_quat_xyzw(R_WI)
        return messages.make_imu(
            quat_xyzw,
            angular_velocity,
            specific_force,
            stamp_ns,
            self._variances,
        )


class ImuSamplesPort:
    """The port `imu_samples`: the last samples up to now."""

    def __init__(self, system: LeafSystem, variances: tuple[float, float]):
        """Declares the port; for the variances see `make_imu`."""
        self._samples = declare_object(system, "imu_samples")
        self._variances = variances

    def messages(
        self,
        context: Context,
        schedule: Schedule,
        since: int,
        tick: int,
        start_ns: int,
    ) -> Iterator[tuple[int, int, Any]]:
        """Yields number, stamp [ns] and message of each new sample.

        Args:
            since: the last tick whose sample is written.
            tick: the present one.
            start_ns: the stamp of time zero [ns].

        Raises:
            ValueError: the port shows too few samples.
        """
        step = schedule.steps[IMU_TOPIC.name]
        last = min(tick, schedule.ends.get(IMU_TOPIC.name, tick))
        numbers = range(since // step + 1, last // step + 1)
        samples = value_of(self._samples, context)
        if samples is None or not numbers:
            return
        first = numbers[0] - samples.first
        if first < 0:
            raise ValueError("imu_samples: the oldest samples are missing")
        for row, number in enumerate(numbers, first):
            stamp_ns = start_ns + schedule.time_ns(number * step)
            message = messages.make_imu(
                samples.quat_xyzw[row],
                samples.angular_velocity[row],
                samples.specific_force[row],
                stamp_ns,
                self._variances,
            )
            yield number, stamp_ns, message


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


class RecordedSensor(NamedTuple):
    """A further sensor of a recording, with a port of its name.

    Attributes:
        topic: where its messages go.
        X_BC: pose of its frame C in the vehicle's frame B; the frame has the
            sensor's name.
        make_message: makes the message of a value of the port, from the value,
            the name of the frame and the time [ns].
    """

    topic: Topic
    X_BC: RigidTransform
    make_message: Callable[[Any, str, int], Any]


class ValuePort:
    """A port whose value makes messages, on the due topic and others.

    Attributes:
        due_topic: at its times there are messages.
    """

    def __init__(
        self,
        system: LeafSystem,
        name: str,
        due_topic: Topic,
        make: Callable[[Any, int], dict[Topic, Any]],
    ):
        """Declares the port; `make` takes its value and the time [ns]."""
        self._port = declare_object(system, name)
        self.due_topic = due_topic
        self._make = make

    def messages(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the messages of the present value."""
        value = value_of(self._port, context)
        return {} if value is None else self._make(value, stamp_ns)


def sensor_port(
    system: LeafSystem, name: str, sensor: RecordedSensor
) -> ValuePort:
    """Declares the port of a further sensor, `<name>`."""

    def make(value: Any, stamp_ns: int) -> dict[Topic, Any]:
        return {sensor.topic: sensor.make_message(value, name, stamp_ns)}

    return ValuePort(system, name, sensor.topic, make)


def scan_port(system: LeafSystem, name: str, layout: str) -> ValuePort:
    """Declares the port `<lidar>_scan`, of points and labels beside them."""
    encode = messages.encode_point_cloud

    def make(scan: np.ndarray, stamp_ns: int) -> dict[Topic, Any]:
        points = to_layout(scan, layout)
        outgoing = {points_topic(name): encode(points, name, stamp_ns)}
        if layout != "cns":
            labels = encode(to_labels(scan), name, stamp_ns)
            outgoing[labels_topic(name)] = labels
        return outgoing

    return ValuePort(system, f"{name}_scan", points_topic(name), make)


def objects_port(system: LeafSystem) -> ValuePort:
    """Declares the port `objects`, of moving objects."""
    detections, boxes = (
        BoxMessages(marked_detections),
        BoxMessages(marked_boxes),
    )

    def make(objects: RecordedObjects, stamp_ns: int) -> dict[Topic, Any]:
        return {
            OBJECTS_TOPIC: detections.encode(objects, stamp_ns),
            BOXES_TOPIC: boxes.encode(objects, stamp_ns),
            MOTION_TOPIC: messages.encode_point_cloud(
                motion_table(objects), messages.MAP_FRAME, stamp_ns
            ),
        }

    return ValuePort(system, "objects", OBJECTS_TOPIC, make)


class CameraPorts:
    """The ports `<camera>_color`, `<camera>_depth` and `<camera>_label`."""

    def __init__(self, system: LeafSystem, name: str, camera: RecordedCamera):
        """Declares the ports of a camera."""
        self._name, self._info = name, camera.info
        self._images = {
            kind: system.DeclareAbstractInputPort(
                f"{name}_{kind}", Value(image())
            )
            for kind, image in _IMAGES.items()
        }
        self.due_topic = camera_info_topic(name)

    def messages(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the messages of images, and of the intrinsics."""
        outgoing = {}
        for kind, port in self._images.items():
            image = value_of(port, context)
            if image is not None:
                outgoing[image_topic(self._name, kind)] = make_image(
                    image.data, ENCODINGS[kind], self._name, stamp_ns
                )
        if outgoing:
            outgoing[self.due_topic] = make_camera_info(
                self._info, self._name, stamp_ns
            )
        return outgoing
