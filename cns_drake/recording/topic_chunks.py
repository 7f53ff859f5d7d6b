"""Chunks of an MCAP file that hold one topic each.

To read one message, a reader has to uncompress the whole chunk that contains
the message. If chunks contained all messages in the order of time, a reader of
the poses would uncompress all clouds as well. Therefore the messages of a short
span of time are collected, and then written topic by topic. The topics keep the
order of their first messages: readers sort messages by their log times, and
messages of equal time by their places in the file.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import BinaryIO

from mcap.records import Channel, Message
from mcap.writer import CompressionType, Writer
import numpy as np

from cns_drake.drives.mcap_messages import STAMPED_RECORD, read_stamp
from cns_drake.drives.mcap_records import (
    Fault,
    chunk_times,
    locate_records,
)

# A killed process loses the messages that are held. It may lose a second; part
# of it is reserved for frames on their way to the file.
_SPAN_NS = 800_000_000
# Several LiDARs or cameras make more than that in a span. Their messages must
# not fill the memory.
_MOST_HELD_BYTES = 1 << 24
# Size of a chunk, before compression, at which it ends [bytes].
_CHUNK_BYTES = 1 << 20


class TopicChunks:
    """Writes an MCAP file in zstd-compressed chunks that hold one topic each.

    Attributes:
        writer: the writer of all records other than messages.
    """

    def __init__(self, stream: BinaryIO):
        self.writer = Writer(
            stream, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD
        )
        # Channel id -> the arguments of its messages.
        self._held: dict[int, list[tuple[int, bytes, int, int]]] = {}
        self._held_bytes = 0
        self._start_ns: int | None = None
        # Channel id -> number of messages with the log time as their stamp.
        self._stamped: Counter[int] = Counter()

    def add_message(
        self,
        channel_id: int,
        log_time: int,
        data: bytes,
        publish_time: int,
        sequence: int,
    ) -> None:
        """Holds a message, after messages of an earlier span were written."""
        if self._start_ns is None:
            self._start_ns = log_time
        if (
            log_time - self._start_ns >= _SPAN_NS
            or self._held_bytes >= _MOST_HELD_BYTES
        ):
            self.flush()
            self._start_ns = log_time
        message = log_time, data, publish_time, sequence
        self._held.setdefault(channel_id, []).append(message)
        self._held_bytes += len(data)
        self._stamped[channel_id] += read_stamp(data) == log_time

    def flush(self) -> None:
        """Writes all messages that are held."""
        for channel_id, held in self._held.items():
            for message in held:
                self.writer.add_message(channel_id, *message)
            self.writer.flush()
            held.clear()
        self._held_bytes = 0

    def finish(self, topics: Mapping[int, str]) -> None:
        """Completes the file.

        Args:
            topics: channel id -> name of its topic.
        """
        self.flush()
        counts: Counter[str] = Counter()
        for channel_id, count in self._stamped.items():
            counts[topics[channel_id]] += count
        stamped = {
            topic: str(count) for topic, count in counts.items() if count
        }
        if stamped:
            self.writer.add_metadata(STAMPED_RECORD, stamped)
        self.writer.finish()


def messages_by_time(stream: BinaryIO) -> Iterator[tuple[str, Message]]:
    """Yields the topics and messages of a recording in the order of log times.

    The iterator ends where the file is damaged or ends. Messages of equal time
    keep the file's order. Memory holds only the messages of chunks that overlap
    in time.
    """
    times = list(chunk_times(stream))
    starts = [chunk[1] for chunk in times]
    # Position of a chunk -> the earliest time in this and all later chunks.
    earliest = dict(
        zip(
            (position for position, _ in times),
            np.minimum.accumulate(starts[::-1])[::-1].tolist(),
            strict=True,
        )
    )
    topics: dict[int, str] = {}
    held: list[Message] = []

    def due(before: int | None) -> Iterator[tuple[str, Message]]:
        held.sort(key=lambda message: message.log_time)
        count = 0
        for message in held:
            if before is not None and message.log_time >= before:
                break
            yield topics[message.channel_id], message
            count += 1
        del held[:count]

    last = None
    for position, _, record in locate_records(stream):
        if isinstance(record, Fault):
            break
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message):
            if position != last and position in earliest:
                yield from due(earliest[position])
                last = position
            if record.channel_id not in topics:
                break
            held.append(record)
    yield from due(None)
