"""ROS 2 messages of moving objects: detections, boxes, velocities."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from cns_drake.recording import messages
from evaluation.base import NS_PER_S
from evaluation.drives import (
    DETECTIONS_3D,
    MAP_FRAME,
    SCENE_UPDATE,
    make_message,
    serialize,
)

# Placeholders of numbers in a message: this and the following integers, which
# are exact in double precision and larger than any measurement.
_FIRST_MARK = 2.0**52
# Placeholder of the stamp: seconds and nanoseconds.
_STAMP_MARK = (0x5A17C0DE, 0x3A17C0DE)
_STAMP_MARK_NS = _STAMP_MARK[0] * NS_PER_S + _STAMP_MARK[1]
# CDR begins with the encoding; alignment is counted from the byte after it.
_ENCAPSULATION = 4
# Numbers of a box: position, orientation and size.
_NUMBERS = 10
# A record of the table of velocities.
MOTION_DTYPE = np.dtype(
    [(name, "<f4") for name in ("x", "y", "z", "vx", "vy", "vz", "yaw_rate")]
    + [("instance", "<u2"), ("moving", "<u2")]
)
# `SceneEntityDeletion.ALL` of Foxglove.
_DELETE_ALL = 1
_RGB = {"person": (0.95, 0.35, 0.2), "bicyclist": (0.95, 0.75, 0.1)}
_OTHER_RGB = (0.2, 0.6, 0.95)
_OPACITY = 0.45


class RecordedObjects(NamedTuple):
    """The motion of N vehicles and pedestrians at one time, in the world W.

    Attributes:
        instance: (N,) uint16 instance ids, as in points and structure tables.
        names: N names of their structures.
        semantic_classes: N names of classes, keys of `CLASS_IDS`.
        p_WO: (N, 3) centres of their boxes [m].
        quat_xyzw: (N, 4) orientations of their boxes, as quaternions (x, y, z,
            w).
        sizes: (N, 3) length, width, height of their boxes [m].
        v_WO: (N, 3) velocities [m/s].
        yaw_rate: (N,) rates of turning about z [rad/s].
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


class BoxMessages:
    """Makes messages that contain the boxes of all objects at one time.

    While the objects stay the same, this class is much faster than making each
    message from its fields.
    """

    # A message is made only once for each set of objects, with placeholders for
    # its float64 numbers and its stamp. Later messages fill in these numbers.

    def __init__(
        self, make: Callable[[Sequence[tuple[int, str]], np.ndarray], Any]
    ):
        """Chooses the type of the messages.

        Args:
            make: function that makes a message: `marked_detections` for
                vision_msgs' Detection3DArray, or `marked_boxes` for Foxglove's
                SceneUpdate.
        """
        self._make = make
        self._identities: tuple[bytes, tuple[str, ...]] | None = None

    def encode(self, objects: RecordedObjects, stamp_ns: int) -> bytes:
        """Returns the message with all objects at a time [ns], as CDR."""
        identities = (objects.instance.tobytes(), objects.semantic_classes)
        if identities != self._identities:
            self._prepare(objects)
            self._identities = identities
        numbers = np.column_stack(
            [objects.p_WO, objects.quat_xyzw, objects.sizes]
        )
        data = self._data.copy()
        floats, words = _number_views(data)
        floats[self._number_places] = numbers.ravel()[self._number_order]
        words[self._stamp_places], words[self._stamp_places + 1] = divmod(
            stamp_ns, NS_PER_S
        )
        return data.tobytes()

    def _prepare(self, objects: RecordedObjects) -> None:
        """Makes the message, and finds the positions of its placeholders.

        Raises:
            ValueError: the message lacks a placeholder.
        """
        count = _NUMBERS * len(objects.instance)
        marks = (_FIRST_MARK + np.arange(count)).reshape(-1, _NUMBERS)
        pairs = zip(
            objects.instance.tolist(), objects.semantic_classes, strict=True
        )
        message = self._make(list(pairs), marks)
        self._data = np.frombuffer(serialize(message), np.uint8)
        floats, words = _number_views(self._data)
        with np.errstate(invalid="ignore"):
            which = floats - _FIRST_MARK
            self._number_places = np.flatnonzero(
                (which >= 0) & (which < count) & (which % 1 == 0)
            )
        self._number_order = which[self._number_places].astype(int)
        if len(np.unique(self._number_order)) != count:
            raise ValueError("a message lacks some of its numbers")
        sec, nanosec = _STAMP_MARK
        self._stamp_places = np.flatnonzero(
            (words[:-1] == sec) & (words[1:] == nanosec)
        )


def _number_views(data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns views of a message's bytes (L,) as float64 and as uint32."""
    body = data[_ENCAPSULATION:]
    return (
        body[: len(body) // 8 * 8].view("<f8"),
        body[: len(body) // 4 * 4].view("<u4"),
    )


def marked_detections(
    identities: Sequence[tuple[int, str]], numbers: np.ndarray
) -> Any:
    """Returns a Detection3DArray with the boxes of N objects, without a time.

    A placeholder stands for the time stamp. The boxes are in the map frame W.

    Args:
        identities: instance id and class of each object.
        numbers: (N, 10) position [m], orientation (x, y, z, w) and size [m] of
            each box.
    """
    header = messages.make_header(MAP_FRAME, _STAMP_MARK_NS)
    detections = []
    for (instance, semantic_class), row in zip(
        identities, numbers, strict=True
    ):
        pose, size = _box_fields(row)
        certain = (pose, messages.EXACT_COVARIANCE)
        detections.append(
            {
                "header": header,
                "results": [((semantic_class, 1.0), certain)],
                "bbox": (pose, size),
                "id": instance,
            }
        )
    return make_message(DETECTIONS_3D, header=header, detections=detections)


def marked_boxes(
    identities: Sequence[tuple[int, str]], numbers: np.ndarray
) -> Any:
    """Returns a SceneUpdate message with the boxes of N objects.

    The message deletes all boxes that were sent before. The time stamps of the
    message are placeholders. The boxes are in the map frame W.

    Args:
        identities, numbers: see `marked_detections`.
    """
    stamp = messages.make_header(MAP_FRAME, _STAMP_MARK_NS).stamp
    entities = []
    for (instance, semantic_class), row in zip(
        identities, numbers, strict=True
    ):
        color = (*_RGB.get(semantic_class, _OTHER_RGB), _OPACITY)
        entities.append(
            {
                "timestamp": stamp,
                "frame_id": MAP_FRAME,
                "id": instance,
                "metadata": [("class", semantic_class)],
                "cubes": [(*_box_fields(row), color)],
            }
        )
    return make_message(
        SCENE_UPDATE,
        deletions=[{"timestamp": stamp, "type": _DELETE_ALL}],
        entities=entities,
    )


def _box_fields(numbers: np.ndarray) -> tuple[tuple, np.ndarray]:
    """Returns the fields of a box's pose, and its size."""
    return (numbers[:3], numbers[3:7]), numbers[7:]


def motion_table(objects: RecordedObjects) -> np.ndarray:
    """Returns the positions and velocities of N objects as records (N,).

    The fields of `MOTION_DTYPE` are x, y, z [m], vx, vy, vz [m/s], yaw_rate
    [rad/s], instance and moving. Positions and velocities are in the world W.
    """
    table = np.zeros(len(objects.instance), MOTION_DTYPE)
    for names, values in (("x y z", objects.p_WO), ("vx vy vz", objects.v_WO)):
        for k, name in enumerate(names.split()):
            table[name] = values[:, k]
    table["yaw_rate"] = objects.yaw_rate
    table["instance"] = objects.instance
    table["moving"] = objects.is_moving
    return table
