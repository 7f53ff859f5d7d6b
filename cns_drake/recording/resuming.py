"""Going on where an interrupted recording ended."""

from __future__ import annotations

from collections.abc import Sequence

from cns_drake.recording.bag_writer import BagWriter, RecordedMessage
from cns_drake.recording.frame_clock import frame_stamp_ns
from cns_drake.recording.rosbag2_metadata import Topic


def take_over_frames(bag: BagWriter, topics: Sequence[Topic]) -> int:
    """Writes the complete frames of an interrupted run into its successor.

    A frame has one message on every topic, latched topics only in frame 0.

    Args:
        bag: an open bag, to which nothing has been written.
        topics: the bag's topics.

    Returns:
        How many frames there are, from frame 0 on.
    """
    frames = 0
    frame: list[RecordedMessage] = []
    for message in bag.interrupted():
        expected = {
            topic.name for topic in topics if not topic.latched or frames == 0
        }
        stamp_ns = frame_stamp_ns(frames)
        if (
            message.topic not in expected - {other.topic for other in frame}
            or message.stamp_ns != stamp_ns
            or message.sequence != frames
        ):
            break
        frame.append(message)
        if len(frame) == len(expected):
            for complete in frame:
                bag.write(*complete)
            frames += 1
            frame.clear()
    return frames
