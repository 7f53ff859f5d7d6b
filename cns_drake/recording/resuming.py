"""Takes over the frames of an interrupted recording into its next run."""

from collections.abc import Collection, Iterable, Iterator, Sequence

from cns_drake.recording.bag_writer import BagWriter, RecordedMessage
from cns_drake.recording.rosbag2_metadata import Topic
from cns_drake.recording.schedule import START_NS, Schedule


def take_over_frames(
    bag: BagWriter,
    topics: Sequence[Topic],
    schedule: Schedule,
    frame_topic: str,
) -> int:
    """Copies the complete frames of an interrupted run to the new run.

    A frame consists of a message on `frame_topic` and all messages until the
    next message on this topic. A latched topic has a single message, at the
    start of the recording.

    Args:
        bag: open bag of the new run, to which nothing has been written yet.
        topics: topics of the recording.
        schedule: schedule of the topics that are not latched; its streams have
            the names of the topics.
        frame_topic: name of the topic on which each frame begins.

    Returns:
        The number of copied frames, from frame 0 on.
    """
    latched = {topic.name for topic in topics if topic.latched}
    frames = 0
    for frame in _complete_frames(
        bag.interrupted(), latched, schedule, frame_topic
    ):
        for message in frame:
            bag.write(*message)
        frames += 1
    return frames


def _complete_frames(
    messages: Iterable[RecordedMessage],
    latched: Collection[str],
    schedule: Schedule,
    frame_topic: str,
) -> Iterator[list[RecordedMessage]]:
    """Yields the messages of each frame, up to the first incomplete frame.

    A frame is yielded before the first message after the frame is read.

    Args:
        messages: messages of a recording from its start on, by time.
        latched: topics with a single message, at tick 0.
        schedule: schedule of the other topics.
        frame_topic: name of the topic on which each frame begins.
    """
    tick = 0
    missing = {*latched, *schedule.due(tick)}
    frame: list[RecordedMessage] = []
    for message in messages:
        if message.topic not in missing or not _is_due_at(
            message, tick, schedule
        ):
            return
        frame.append(message)
        missing.remove(message.topic)
        if missing:
            continue
        following = schedule.next_tick(tick)
        if following is None:
            yield frame
            return
        tick = following
        missing = {*schedule.due(tick)}
        if frame_topic in missing:
            yield frame
            frame = []


def _is_due_at(message: RecordedMessage, tick: int, schedule: Schedule) -> bool:
    """Returns whether a message has the time and the number of a tick."""
    step = schedule.steps.get(message.topic, 1)
    return (
        message.stamp_ns == START_NS + schedule.time_ns(tick)
        and message.sequence == tick // step
    )
