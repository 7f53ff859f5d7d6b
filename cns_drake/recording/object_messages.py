"""ROS 2 messages of moving objects: detections, boxes, velocities."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from cns_drake.base.drives.ros_types import (
    DETECTIONS_3D,
    SCENE_UPDATE,
    message_class,
    serialize,
)
from cns_drake.recording.messages import (
    MAP_FRAME,
    exact_covariance,
    make_vector,
)

# Placeholders of numbers in a message: this and the following integers, which
# are exact in double precision and larger than any measurement.
_FIRST_MARK = 2.0**52
# Placeholder of the stamp: seconds and nanoseconds. No stamp of a drive has
# more than 10^9 nanoseconds.
STAMP_MARK_NS = (0x5A17C0DE, 0x71B3E5A9)
# CDR begins with its encoding; alignment counts from behind it.
_ENCAPSULATION = 4
_NS_PER_S = 1_000_000_000
# Position, orientation and size of a box.
_NUMBERS = 10
# A record of the table of velocities.
MOTION_DTYPE = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("vx", "<f4"),
        ("vy", "<f4"),
        ("vz", "<f4"),
        ("yaw_rate", "<f4"),
        ("instance", "<u2"),
        ("moving", "<u2"),
    ]
)
_DELETE_ALL = 1
_RGB = {"person": (0.95, 0.35, 0.2), "bicyclist": (0.95, 0.75, 0.1)}
_OTHER_RGB = (0.2, 0.6, 0.95)
_OPACITY = 0.45


class RecordedObjects(NamedTuple):
    """The vehicles and walkers that are there at a time: N of them.

    Attributes:
        instance: (N,) uint16 ids in points and tables.
        names: N names of their structures.
        semantic_classes: N keys of `CLASS_IDS`.
        p_WO: (N, 3) middles of their boxes [m].
        quat_xyzw: (N, 4) orientations of their boxes.
        sizes: (N, 3) length, width, height of their boxes [m].
        v_WO: (N, 3) velocities [m/s].
        yaw_rate: (N,) [rad/s].
        is_moving: (N,) whether each is labelled as moving.
    """

    instance: np.ndarray
    names: tuple[str, ...]
    semantic_classes: tuple[str, ...]
    p_WO: np.ndarray
    quat_xyzw: np.ndarray
    sizes: np.ndarray
    v_WO: np.ndarray
    yaw_rate: np.ndarray
    is_moving: np.ndarray


class MessageTemplate:
    """The CDR form of a message, with places for float64 and for a stamp.

    It is made once: to fill in the numbers of a hundred boxes takes a tenth of
    the time that making their messages takes.
    """

    def __init__(self, message: Any, num_numbers: int):
        """Finds the places.

        Args:
            message: made with `number_marks(num_numbers)` and with times of
                the seconds and nanoseconds of `STAMP_MARK_NS`.

        Raises:
            ValueError: a number is missing.
        """
        self._data = np.frombuffer(serialize(message), np.uint8)
        numbers, words = self._views(self._data)
        with np.errstate(invalid="ignore"):
            which = numbers - _FIRST_MARK
            self._places = np.flatnonzero(
                (which >= 0) & (which < num_numbers) & (which % 1 == 0)
            )
        self._which = which[self._places].astype(int)
        if len(np.unique(self._which)) != num_numbers:
            raise ValueError("a message lacks some of its numbers")
        sec, nanosec = STAMP_MARK_NS
        self._stamps = np.flatnonzero(
            (words[:-1] == sec) & (words[1:] == nanosec)
        )

    @staticmethod
    def _views(data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns what can be a float64, and what can be a uint32.

        Args:
            data: (L,) bytes of the message.
        """
        body = data[_ENCAPSULATION:]
        return (
            body[: len(body) // 8 * 8].view("<f8"),
            body[: len(body) // 4 * 4].view("<u4"),
        )

    def fill(self, numbers: np.ndarray, stamp_ns: int) -> bytes:
        """Returns the CDR form of the message with N numbers and a stamp."""
        data = self._data.copy()
        floats, words = self._views(data)
        floats[self._places] = numbers[self._which]
        words[self._stamps], words[self._stamps + 1] = divmod(
            stamp_ns, _NS_PER_S
        )
        return data.tobytes()


def number_marks(count: int) -> np.ndarray:
    """Returns (count,) placeholder numbers for the message of a template."""
    return _FIRST_MARK + np.arange(count)


class BoxMessages:
    """Makes one message of all boxes at a time."""

    def __init__(
        self, make: Callable[[Sequence[tuple[int, str]], np.ndarray], Any]
    ):
        """Takes the function that makes a message of placeholders.

        Args:
            make: `marked_detections` or `marked_boxes`.
        """
        self._make = make
        self._who: tuple[bytes, tuple[str, ...]] | None = None
        self._template: MessageTemplate | None = None

    def encode(self, objects: RecordedObjects, stamp_ns: int) -> bytes:
        """Returns the CDR form of the message.

        Args:
            stamp_ns: the time of all of them [ns].
        """
        who = (objects.instance.tobytes(), objects.semantic_classes)
        if self._template is None or who != self._who:
            named = zip(
                objects.instance.tolist(), objects.semantic_classes, strict=True
            )
            count = _NUMBERS * len(objects.instance)
            marks = number_marks(count).reshape(-1, _NUMBERS)
            self._template = MessageTemplate(
                self._make(list(named), marks), count
            )
            self._who = who
        numbers = np.column_stack(
            [objects.p_WO, objects.quat_xyzw, objects.sizes]
        )
        return self._template.fill(numbers.ravel(), stamp_ns)


def marked_detections(
    who: Sequence[tuple[int, str]], numbers: np.ndarray
) -> Any:
    """Returns a Detection3DArray in the map, with a mark as its stamp.

    Args:
        who: id and class of N objects.
        numbers: (N, 10) position, orientation (x, y, z, w) and size.
    """
    return message_class(DETECTIONS_3D)(
        header=_header(),
        detections=[
            _detection(instance, name, row)
            for (instance, name), row in zip(who, numbers, strict=True)
        ],
    )


def marked_boxes(who: Sequence[tuple[int, str]], numbers: np.ndarray) -> Any:
    """Returns a SceneUpdate that replaces all boxes by those of N objects."""
    deletion = message_class("foxglove_msgs/msg/SceneEntityDeletion")(
        timestamp=_stamp(), type=_DELETE_ALL, id=""
    )
    return message_class(SCENE_UPDATE)(
        deletions=[deletion],
        entities=[
            _entity(instance, name, row)
            for (instance, name), row in zip(who, numbers, strict=True)
        ],
    )


def motion_table(objects: RecordedObjects) -> np.ndarray:
    """Returns (N,) records of the places and velocities of objects."""
    table = np.zeros(len(objects.instance), MOTION_DTYPE)
    for names, values in (("x y z", objects.p_WO), ("vx vy vz", objects.v_WO)):
        for k, name in enumerate(names.split()):
            table[name] = values[:, k]
    table["yaw_rate"] = objects.yaw_rate
    table["instance"] = objects.instance
    table["moving"] = objects.is_moving
    return table


def _stamp() -> Any:
    sec, nanosec = STAMP_MARK_NS
    return message_class("builtin_interfaces/msg/Time")(
        sec=sec, nanosec=nanosec
    )


def _header() -> Any:
    return message_class("std_msgs/msg/Header")(
        stamp=_stamp(), frame_id=MAP_FRAME
    )


def _pose(numbers: np.ndarray) -> Any:
    x, y, z, *quat_xyzw = (float(number) for number in numbers)
    return message_class("geometry_msgs/msg/Pose")(
        position=message_class("geometry_msgs/msg/Point")(x=x, y=y, z=z),
        orientation=message_class("geometry_msgs/msg/Quaternion")(
            **dict(zip("xyzw", quat_xyzw, strict=True))
        ),
    )


def _detection(instance: int, semantic_class: str, numbers: np.ndarray) -> Any:
    pose = _pose(numbers[:7])
    hypothesis = message_class("vision_msgs/msg/ObjectHypothesis")(
        class_id=semantic_class, score=1.0
    )
    certain = message_class("geometry_msgs/msg/PoseWithCovariance")(
        pose=pose, covariance=exact_covariance()
    )
    result = message_class("vision_msgs/msg/ObjectHypothesisWithPose")(
        hypothesis=hypothesis, pose=certain
    )
    box = message_class("vision_msgs/msg/BoundingBox3D")(
        center=pose, size=make_vector(numbers[7:])
    )
    return message_class("vision_msgs/msg/Detection3D")(
        header=_header(), results=[result], bbox=box, id=str(instance)
    )


def _entity(instance: int, semantic_class: str, numbers: np.ndarray) -> Any:
    r, g, b = _RGB.get(semantic_class, _OTHER_RGB)
    cube = message_class("foxglove_msgs/msg/CubePrimitive")(
        pose=_pose(numbers[:7]),
        size=make_vector(numbers[7:]),
        color=message_class("foxglove_msgs/msg/Color")(
            r=r, g=g, b=b, a=_OPACITY
        ),
    )
    named = message_class("foxglove_msgs/msg/KeyValuePair")(
        key="class", value=semantic_class
    )
    forever = message_class("builtin_interfaces/msg/Duration")(sec=0, nanosec=0)
    return message_class("foxglove_msgs/msg/SceneEntity")(
        timestamp=_stamp(),
        frame_id=MAP_FRAME,
        id=str(instance),
        lifetime=forever,
        frame_locked=False,
        metadata=[named],
        arrows=[],
        cubes=[cube],
        spheres=[],
        cylinders=[],
        lines=[],
        triangles=[],
        texts=[],
        models=[],
    )
