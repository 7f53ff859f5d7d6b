"""Recordings without a simulation: random bytes on the usual topics."""

import numpy as np
from rosbags.highlevel import AnyReader

from cns_drake.recording import (
    START_NS,
    BagWriter,
    frame_stamp_ns,
    recording_topics,
)

TOPICS = recording_topics(["lidar"])
FRAMES = 50


def open_bag(folder, title="drive", **kwargs):
    return BagWriter(
        folder,
        TOPICS,
        start_ns=START_NS,
        attachments={"scenario.json": {"title": title}},
        scenario={"title": title},
        **kwargs,
    )


def record(folder, frames=FRAMES, size=60, **kwargs):
    """Records frames with messages of random bytes."""
    with open_bag(folder, **kwargs) as bag:
        for frame in range(frames):
            write_frame(bag, frame, size)


def write_frame(bag, frame, size=60):
    """Writes a message of `size` bytes on each topic of a frame."""
    rng = np.random.default_rng(frame)
    for topic in reversed(TOPICS):
        if not topic.latched or frame == 0:
            data = rng.bytes(size)
            bag.write(topic.name, frame_stamp_ns(frame), data, frame)


def contents(folder):
    """Name -> bytes of each file in a folder."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def messages_by_topic(folder):
    """Topic -> (stamp_ns, message) of each message of a recording."""
    found = {}
    with AnyReader([folder]) as reader:
        for connection, stamp_ns, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((stamp_ns, message))
    return found
