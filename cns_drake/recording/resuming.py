"""Resumes an interrupted recording."""

from __future__ import annotations

from collections.abc import Sequence

from cns_drake.recording.bag_writer import BagWriter, RecordedMessage
from cns_drake.recording.frame_clock import START_NS
from cns_drake.recording.rosbag2_metadata import Topic
from cns_drake.recording.schedule import Schedule


def take_over_frames(
    bag: BagWriter,
    topics: Sequence[Topic],
    schedule: Schedule,
    frame_topic: str,
) -> int:
    """Writes the complete frames of an interrupted run into its successor.

    A frame has all messages from one message on `frame_topic` until the next;
    latched topics have one message, at tick 0.

    Args:
        bag: an open bag, to which nothing has been written.
        topics: the bag's topics.
        schedule: ticks of the topics that are not latched, by name.
        frame_topic: the topic with one message a frame.

    Returns:
        The number of frames, from frame 0 on.
    """
    frames = tick = 0
    frame: list[RecordedMessage] = []
    missing = {topic.name for topic in topics if topic.latched}
    missing.update(schedule.due(0))
    # After the end of all streams, if they have one, no message is due.
    last = None
    if schedule.ends.keys() >= schedule.steps.keys():
        last = max(schedule.ends.values())
    for message in bag.interrupted():
        if (
            message.topic not in missing
            or message.stamp_ns != START_NS + schedule.time_ns(tick)
            or message.sequence != tick // schedule.steps.get(message.topic, 1)
        ):
            break
        frame.append(message)
        missing.remove(message.topic)
        while not missing and tick != last:
            tick += 1
            missing.update(schedule.due(tick))
            if frame_topic in missing:
                frames += _write(bag, frame)
    if not missing:
        frames += _write(bag, frame)
    return frames


def _write(bag: BagWriter, frame: list[RecordedMessage]) -> int:
    """Writes a complete frame; returns 1."""
    for message in frame:
        bag.write(*message)
    frame.clear()
    return 1
