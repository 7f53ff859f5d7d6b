"""Writes bags as public programs do, with the writers of rosbags."""

from collections.abc import Iterable
import dataclasses
from pathlib import Path
import re
from typing import Any

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from evaluation.drives import make_message, message_definition, serialize

# Topic, type, stamp [ns], fields of the message.
Entry = tuple[str, str, int, dict[str, Any]]
LIVOX = "livox_ros_driver2/msg/CustomMsg"
_STORES = {1: Stores.ROS1_NOETIC, 2: Stores.ROS2_HUMBLE}


def header(stamp_ns: int, frame: str) -> dict[str, Any]:
    """Returns the fields of a header."""
    sec, nanosec = divmod(stamp_ns, 10**9)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}


def pose(X: np.ndarray) -> dict[str, Any]:
    """Returns the fields of a pose (4, 4) whose rotation is about z."""
    half = 0.5 * np.arctan2(X[1, 0], X[0, 0])
    return {
        "position": X[:3, 3].tolist(),
        "orientation": [0.0, 0.0, np.sin(half), np.cos(half)],
    }


def transform(parent: str, child: str, X: np.ndarray, stamp_ns: int) -> Any:
    """Returns the fields of a transform."""
    found = pose(X)
    return {
        "header": header(stamp_ns, parent),
        "child_frame_id": child,
        "transform": {
            "translation": found["position"],
            "rotation": found["orientation"],
        },
    }


def cloud(points: np.ndarray, frame: str, stamp_ns: int) -> dict[str, Any]:
    """Returns the fields of a PointCloud2 of a structured array."""
    numbers = {"f4": 7, "f8": 8, "u1": 2, "u2": 4, "u4": 6, "i2": 3}
    fields = [
        {
            "name": name,
            "offset": points.dtype.fields[name][1],
            "datatype": numbers[points.dtype[name].str[1:]],
            "count": 1,
        }
        for name in points.dtype.names
    ]
    return {
        "header": header(stamp_ns, frame),
        "height": 1,
        "width": len(points),
        "fields": fields,
        "point_step": points.itemsize,
        "row_step": points.nbytes,
        "data": np.frombuffer(points.tobytes(), np.uint8),
    }


def write_bag(
    path: Path,
    entries: Iterable[Entry],
    storage: str = "mcap",
    empty: Iterable[tuple[str, str]] = (),
    log_times: np.ndarray | None = None,
) -> Path:
    """Writes a bag.

    Args:
        path: the bag, of ROS 1 with the ending `.bag`.
        entries: the messages.
        storage: `mcap`, `sqlite3`, or one of these with `-file` or `-message`
            if compressed; `bz2` or `lz4` for ROS 1.
        empty: topics without a message, with their types.
        log_times: (N,) of the messages [ns]; by default their stamps.
    """
    is_1 = path.suffix == ".bag"
    store = get_typestore(_STORES[1 if is_1 else 2])
    if is_1:
        writer: Any = rosbag1.Writer(path)
        if storage in ("bz2", "lz4"):
            writer.set_compression(
                rosbag1.Writer.CompressionFormat[storage.upper()]
            )
    else:
        plugin, _, mode = storage.partition("-")
        writer = rosbag2.Writer(
            path, version=8, storage_plugin=StoragePlugin[plugin.upper()]
        )
        if mode:
            writer.set_compression(
                CompressionMode[mode.upper()], CompressionFormat.ZSTD
            )
    with writer:
        connections: dict[str, Any] = {}

        def connect(topic: str, kind: str) -> Any:
            if kind not in store.fielddefs:
                types = get_types_from_msg(message_definition(kind), kind)
                new = types.keys() - store.fielddefs.keys()
                store.register({name: types[name] for name in new})
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, kind, typestore=store
                )
            return connections[topic]

        for topic, kind in empty:
            connect(topic, kind)
        for number, (topic, kind, stamp_ns, fields) in enumerate(entries):
            message = make_message(kind, **fields)
            to = connect(topic, kind)
            if is_1:
                _number_headers(message)
                data = store.serialize_ros1(message, kind)
            else:
                data = serialize(message)
            logged = stamp_ns if log_times is None else log_times[number]
            writer.write(to, int(logged), bytes(data))
    return path


def _number_headers(message: Any) -> None:
    """Gives all headers of a message a number, which ROS 1 has."""
    if isinstance(message, list):
        for one in message:
            _number_headers(one)
    elif dataclasses.is_dataclass(message):
        if message.__msgtype__ == "std_msgs/msg/Header":
            message.seq = 0
        for one in vars(message).values():
            _number_headers(one)


def join_bags(first: Path, second: Path) -> None:
    """Makes one split bag of two of rosbag2."""
    for file in second.glob("*.*"):
        if file.name != "metadata.yaml":
            file.rename(first / file.name)
            name = file.name
    text = (first / "metadata.yaml").read_text()
    text = re.sub(
        r"(relative_file_paths:\n)(\s*)- ", rf"\1\2- {name}\n\2- ", text
    )
    (first / "metadata.yaml").write_text(text)
