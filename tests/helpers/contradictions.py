"""Recordings of well-formed parts that contradict each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import copy
from dataclasses import dataclass, replace
import io
from pathlib import Path
import re
from typing import Any

from mcap.reader import make_reader
from mcap.writer import Writer
import numpy as np

from helpers.drive_files import TYPES

_LIDAR = "/lidar/points"
_ODOMETRY = "/odometry"
_MOUNTS = "/tf_static"


@dataclass(frozen=True)
class RecordedMessage:
    """A message, and its form in a recording.

    Attributes:
        topic: of its channel.
        log_time: of the message [ns].
        channel: distinguishes channels of one topic.
        encoding: named by its channel.
    """

    topic: str
    kind: str
    body: Any
    log_time: int
    channel: int = 0
    encoding: str = "cdr"

    def copy(self, **changes) -> RecordedMessage:
        return replace(self, body=copy.deepcopy(self.body), **changes)


def read_messages(data: bytes) -> tuple[list[RecordedMessage], list]:
    """Returns the messages of a recording, and its attachments."""
    reader = make_reader(io.BytesIO(data))
    messages = [
        RecordedMessage(
            channel.topic,
            schema.name,
            TYPES.deserialize_cdr(message.data, schema.name),
            message.log_time,
        )
        for schema, channel, message in reader.iter_messages()
    ]
    return messages, list(reader.iter_attachments())


def write_messages(
    messages: list[RecordedMessage],
    attachments: list,
    metadata: Mapping[str, dict[str, str]] | None = None,
) -> bytes:
    """Returns a recording; `metadata` has metadata records by their names."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=4000)
    writer.start(profile="ros2", library="test")
    for one in attachments:
        writer.add_attachment(
            one.create_time, one.log_time, one.name, one.media_type, one.data
        )
    channels: dict[tuple, int] = {}
    for number, one in enumerate(messages):
        key = (one.topic, one.kind, one.channel, one.encoding)
        if key not in channels:
            text, _ = TYPES.generate_msgdef(one.kind, ros_version=2)
            schema = writer.register_schema(one.kind, "ros2msg", text.encode())
            channels[key] = writer.register_channel(
                one.topic, one.encoding, schema
            )
        data = bytes(TYPES.serialize_cdr(one.body, one.kind))
        writer.add_message(
            channels[key], one.log_time, data, one.log_time, number
        )
    for name, values in (metadata or {}).items():
        writer.add_metadata(name, values)
    writer.finish()
    return stream.getvalue()


def add_images(
    path: Path, topic: str, images: dict[int, bytes], late_ns: int = 0
) -> None:
    """Adds camera images to a recording: stamp [ns] -> file.

    Their log times are later than their stamps by `late_ns`.
    """
    messages, attachments = read_messages(path.read_bytes())
    kind = "sensor_msgs/msg/CompressedImage"
    for stamp_ns, data in images.items():
        time = TYPES.types["builtin_interfaces/msg/Time"](
            *divmod(stamp_ns, 10**9)
        )
        header = TYPES.types["std_msgs/msg/Header"](time, "camera")
        body = TYPES.types[kind](header, "", np.frombuffer(data, np.uint8))
        messages.append(RecordedMessage(topic, kind, body, stamp_ns + late_ns))
    path.write_bytes(write_messages(messages, attachments))


def _some(
    messages: list[RecordedMessage], topic: str, rng, later: bool = False
) -> int:
    """Returns the index of a topic's first message, or of a later one."""
    places = [k for k, one in enumerate(messages) if one.topic == topic]
    if not places:
        return _some(messages, _ODOMETRY, rng, later)
    places = places[1:] if later and len(places) > 1 else places
    return places[int(rng.integers(len(places)))]


def _changed(change: Callable[[Any, Any], None], topic: str, later=True):
    """Returns an edit that changes a topic's message."""

    def edit(messages: list[RecordedMessage], rng) -> None:
        place = _some(messages, topic, rng, later)
        new = messages[place].copy()
        change(new.body, rng)
        messages[place] = new

    return edit


def _said_twice(change: Callable[[Any, Any], None], topic: str):
    """Returns an edit that adds a changed copy of a message."""

    def edit(messages: list[RecordedMessage], rng) -> None:
        place = _some(messages, topic, rng)
        new = messages[place].copy(channel=int(rng.integers(2)))
        change(new.body, rng)
        messages.insert(int(rng.integers(place + 1, len(messages) + 1)), new)

    return edit


def _move(message, rng) -> None:
    axis = "xyz"[int(rng.integers(3))]
    position = message.pose.pose.position
    step = float(rng.choice([0.1, 1.0, -20.0, 1e5]))
    setattr(position, axis, getattr(position, axis) + step)


def _turn(message, rng) -> None:
    message.pose.pose.orientation.x += 0.3


def _move_mount(message, rng) -> None:
    message.transforms[-1].transform.translation.z += 0.5


def _other_parent(message, rng) -> None:
    message.transforms[-1].header.frame_id = "base_link"


def _rename(message, rng) -> None:
    message.header.frame_id += str(rng.choice(["2", "_raw", "/x"]))


def _rename_child(message, rng) -> None:
    message.child_frame_id += "_rear"


def _overlap(message, rng) -> None:
    one, other = rng.choice(3, 2, replace=False)
    by = int(rng.integers(-3, 4))
    message.fields[one].offset = max(message.fields[other].offset + by, 0)


def _name_twice(message, rng) -> None:
    message.fields[3].name = "xyz"[int(rng.integers(3))]


def _far_point(message, rng) -> None:
    step, width = message.point_step, message.width
    if width == 0:
        _other_size(message, rng)
        return
    data = message.data.copy()
    place = int(rng.integers(width)) * step + 4 * int(rng.integers(3))
    far = np.array([rng.choice([1e7, -1e5, 3e38])], "<f4")
    data[place : place + 4] = far.view(np.uint8)
    message.data = data


def _other_size(message, rng) -> None:
    # A smaller number would be padding at the end of a row.
    message.width += int(rng.choice([1, 2, 1000]))


def _more_rows(message, rng) -> None:
    message.height += 1


def _add_channel(**changes):
    """Returns an edit that adds a channel that does not belong to its topic."""

    def edit(messages: list[RecordedMessage], rng) -> None:
        topic = (_LIDAR, _ODOMETRY, _MOUNTS)[int(rng.integers(3))]
        place = _some(messages, topic, rng)
        messages.insert(place, messages[place].copy(channel=1, **changes))

    return edit


def _another_type(messages: list[RecordedMessage], rng) -> None:
    topics = [_LIDAR, _ODOMETRY, _MOUNTS]
    one, other = rng.choice(3, 2, replace=False)
    stranger = messages[_some(messages, topics[other], rng)]
    messages.insert(
        int(rng.integers(len(messages))), stranger.copy(topic=topics[one])
    )


# Name -> edit, and a text of the error.
CONTRADICTIONS: dict[
    str, tuple[Callable[[list[RecordedMessage], Any], None], str]
] = {
    "two poses": (_said_twice(_move, _ODOMETRY), "m and 0 deg apart"),
    "two attitudes": (
        _said_twice(_turn, _ODOMETRY),
        "two poses of one time, 0 m",
    ),
    "two mounts": (_said_twice(_move_mount, _MOUNTS), "lidar: at .* before"),
    "two parents": (_said_twice(_other_parent, _MOUNTS), "lidar: at .* before"),
    "another sensor frame": (_changed(_rename, _LIDAR), "in frame 'lidar"),
    "another world": (_changed(_rename, _ODOMETRY), "in frame 'map.*'map -"),
    "another vehicle": (_changed(_rename_child, _ODOMETRY), "base_link_rear"),
    "overlapping fields": (_changed(_overlap, _LIDAR), "overlap"),
    "a field twice": (_changed(_name_twice, _LIDAR), "field"),
    "a far point": (_changed(_far_point, _LIDAR, False), r"at \d+ ns: [xyz]:"),
    "another width": (_changed(_other_size, _LIDAR), "bytes|overlap"),
    "another height": (_changed(_more_rows, _LIDAR), "bytes instead of"),
    "another encoding": (
        _add_channel(encoding="json"),
        "and .* in json",
    ),
    "another type": (_another_type, "and .* instead of"),
}


def contradict(path: Path, data: bytes, rng) -> bytes:
    """Returns a recording with a contradiction in it."""
    messages, attachments = read_messages(data)
    names = sorted(CONTRADICTIONS)
    CONTRADICTIONS[names[int(rng.integers(len(names)))]][0](messages, rng)
    return write_messages(messages, attachments)


def contradict_cloud(path: Path, data: bytes, rng) -> bytes:
    """Returns a point cloud whose header and rows differ in number."""
    more = int(rng.choice([1, 2, 7, 1000]))
    is_text = path.stem in ("text", "ascii")
    if path.suffix in (".npy", ".bin") or rng.random() < 0.3:
        return data + (b"1 2 3 4\n" * more if is_text else bytes(16 * more - 3))
    names = rb"WIDTH|HEIGHT|POINTS" if path.suffix == ".pcd" else rb"vertex"
    places = list(re.finditer(rb"(?:%s) (\d+)" % names, data))
    place = places[int(rng.integers(len(places)))]
    number = max(int(place[1]) + more * int(rng.choice([-1, 1])), 0)
    number += number == int(place[1])
    return data[: place.start(1)] + b"%d" % number + data[place.end(1) :]


def contradict_size(path: Path, data: bytes, rng) -> bytes:
    """Returns a world with an invalid number or size."""
    text = data.decode()
    places = list(re.finditer(r"<(radius|length|size|scale)>([^<]+)", text))
    place = places[int(rng.integers(len(places)))]
    numbers = place[2].split()
    kind = rng.integers(4)
    if kind == 0:
        numbers[int(rng.integers(len(numbers)))] = str(
            rng.choice(["nan", "abc", "1,5", "2m", "inf", "1e999", ".", "0x1"])
        )
    elif kind == 1:
        numbers += ["1"]
    elif kind == 2 or place[1] == "scale":
        numbers[int(rng.integers(len(numbers)))] = "0"
    else:
        numbers[int(rng.integers(len(numbers)))] = "-3"
    return (
        f"{text[: place.start(2)]}{' '.join(numbers)}{text[place.end(2) :]}"
    ).encode()


def contradict_rows(path: Path, data: bytes, rng) -> bytes:
    """Returns a file of an exported drive with added or missing rows."""
    if path.suffix in (".label", ".bin"):
        size = 4 if path.suffix == ".label" else 16
        if rng.random() < 0.5 and len(data) > size:
            return data[:-size]
        return data + bytes(size - 1) + b"\x3f"
    lines = data.splitlines(keepends=True)
    if rng.random() < 0.5:
        return b"".join(lines[:-1])
    return data + lines[-1]
