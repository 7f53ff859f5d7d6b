"""Random access to the messages of an MCAP file.

The `mcap` package reads messages in time order, or all of a span of time. A
scan by number needs less and more: where each message of a topic lies, and
the one chunk that holds it. Both come from the index that a complete file
ends with, so that opening a file of gigabytes reads a few kilobytes.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
import contextlib
from dataclasses import dataclass
import itertools
import os
from pathlib import Path
import struct
from typing import BinaryIO, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Chunk, ChunkIndex
import numpy as np
import zstandard

from evaluation.sequences.mcap_records import (
    MAGIC,
    RECORD_HEADER,
    RECORD_LIMIT_BYTES,
    check_summary,
    read_attachment,
    uncompress,
)
from evaluation.support.errors import InputError
from evaluation.support.processors import num_cores

_Parsed = TypeVar("_Parsed")

# Of a message, after its record header: channel id, sequence, two times.
_MESSAGE_HEADER = struct.Struct("<HIQQ")
# Of a message index, after its record header: channel id, length of the rest.
_INDEX_HEADER = struct.Struct("<HI")
_INDEX_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
# The frame that is being read, and its neighbour when two of them interleave.
_CHUNKS_KEPT = 2


@dataclass(frozen=True)
class Location:
    """Where a message lies.

    Attributes:
        chunk: number of the chunk in the file's index.
        offset: of the message record in the uncompressed chunk [bytes].
        log_time_ns: when the message was logged [ns].
        channel_id: of its topic.
    """

    chunk: int
    offset: int
    log_time_ns: int
    channel_id: int


class McapFile:
    """An indexed MCAP file, open for reading single messages.

    The file is opened for each access only; two uncompressed chunks (of
    1 MiB as a rule) are kept, since messages are mostly read in order.
    """

    def __init__(self, path: Path):
        """Reads the index.

        Raises:
            InputError: if there is no such file, or it is no complete and
                indexed MCAP file.
        """
        self.path = Path(path)
        with self._reading() as stream:
            self._check_ends(stream)
            check_summary(stream)
            summary = SeekingReader(
                stream, record_size_limit=RECORD_LIMIT_BYTES
            ).get_summary()
        if summary is None or not summary.chunk_indexes:
            raise InputError(f"{self.path}: the MCAP file has no chunk index")
        self._summary = summary
        self._chunk_indexes: list[ChunkIndex] = sorted(
            self._summary.chunk_indexes,
            key=lambda chunk: chunk.chunk_start_offset,
        )
        self._channels = {
            channel.topic: channel
            for channel in self._summary.channels.values()
        }
        self._locations: dict[str, list[Location]] = {}
        self._chunks: OrderedDict[int, memoryview] = OrderedDict()

    @property
    def topics(self) -> dict[str, str]:
        """Topic -> message type."""
        return {
            topic: self._summary.schemas[channel.schema_id].name
            for topic, channel in self._channels.items()
            if channel.schema_id in self._summary.schemas
        }

    def encoding(self, topic: str) -> str:
        """Returns how the topic's messages are serialised, e.g. `cdr`."""
        return self._channels[topic].message_encoding

    def locate(self, topic: str) -> list[Location]:
        """Returns where a topic's messages lie, in the order of time.

        Raises:
            InputError: if the index cannot be read.
        """
        if topic not in self._locations:
            self._locations[topic] = self._read_locations(topic)
        return self._locations[topic]

    def read(self, location: Location) -> memoryview:
        """Returns the serialised message at a location.

        Raises:
            InputError: if the chunk is damaged.
        """
        return self._message(self._chunk(location.chunk), location)

    def parse_each(
        self,
        locations: Sequence[Location],
        parse: Callable[[int, memoryview], _Parsed],
    ) -> list[_Parsed]:
        """Parses many messages, unpacking each chunk once.

        Chunks are unpacked on all cores, which zstd leaves Python free to
        do; what `parse` returns must not refer to the chunk, or all of them
        stay in memory.

        Args:
            locations: where the messages lie.
            parse: of a position in `locations` and its serialised message;
                called from several threads.

        Returns:
            What `parse` returned, in the order of `locations`.

        Raises:
            InputError: if a chunk is damaged, or as `parse` does.
        """
        order = sorted(
            range(len(locations)),
            key=lambda i: (locations[i].chunk, locations[i].offset),
        )
        groups = [
            list(group)
            for _, group in itertools.groupby(
                order, key=lambda i: locations[i].chunk
            )
        ]

        def parse_chunk(group: list[int]) -> list[_Parsed]:
            chunk = self._unpack(locations[group[0]].chunk)
            return [parse(i, self._message(chunk, locations[i])) for i in group]

        parsed: list = [None] * len(locations)
        pool = ThreadPoolExecutor(num_cores())
        try:
            for group, values in zip(
                groups, pool.map(parse_chunk, groups), strict=True
            ):
                for i, value in zip(group, values, strict=True):
                    parsed[i] = value
        finally:
            # After a fault the other chunks are of no interest.
            pool.shutdown(cancel_futures=True)
        return parsed

    def attachment(self, name: str) -> bytes | None:
        """Returns the content of the attachment of this name, if any."""
        for index in self._summary.attachment_indexes:
            if index.name == name:
                with self._reading() as stream:
                    stream.seek(index.offset)
                    return read_attachment(stream).data
        return None

    def _read_locations(self, topic: str) -> list[Location]:
        channel_id = self._channels[topic].id
        locations: list[Location] = []
        with self._reading() as stream:
            for number, chunk in enumerate(self._chunk_indexes):
                offset = chunk.message_index_offsets.get(channel_id)
                if offset is None:
                    continue
                stream.seek(offset + RECORD_HEADER.size)
                _, length = _INDEX_HEADER.unpack(
                    stream.read(_INDEX_HEADER.size)
                )
                entries = np.frombuffer(stream.read(length), _INDEX_ENTRY)
                locations.extend(
                    Location(number, message_offset, log_time, channel_id)
                    for log_time, message_offset in entries.tolist()
                )
            self._check_count(channel_id, len(locations))
        # Stable, so that messages of one time keep the file's order.
        return sorted(locations, key=lambda location: location.log_time_ns)

    def _chunk(self, number: int) -> memoryview:
        """Returns an uncompressed chunk, of which the last are kept."""
        if number in self._chunks:
            self._chunks.move_to_end(number)
            return self._chunks[number]
        data = self._unpack(number)
        self._chunks[number] = data
        if len(self._chunks) > _CHUNKS_KEPT:
            self._chunks.popitem(last=False)
        return data

    def _unpack(self, number: int) -> memoryview:
        """Reads and uncompresses a chunk whose checksum is right."""
        with self._reading() as stream:
            stream.seek(
                self._chunk_indexes[number].chunk_start_offset
                + RECORD_HEADER.size
            )
            return memoryview(uncompress(Chunk.read(ReadDataStream(stream))))

    def _message(self, chunk: memoryview, location: Location) -> memoryview:
        with self._faults():
            start = location.offset + RECORD_HEADER.size
            _, length = RECORD_HEADER.unpack(chunk[location.offset : start])
            body = chunk[start : start + length]
            if len(body) != length:
                raise EOFError("a message ends behind its chunk")
            channel_id, _, log_time_ns, _ = _MESSAGE_HEADER.unpack_from(body)
            # Nothing else would tell that a message index is damaged.
            if (channel_id, log_time_ns) != (
                location.channel_id,
                location.log_time_ns,
            ):
                raise ValueError("a message is not where the index says")
        return body[_MESSAGE_HEADER.size :]

    def _check_count(self, channel_id: int, found: int) -> None:
        """Refuses an index that lists not all messages of a channel.

        Raises:
            ValueError: that tells the numbers.
        """
        if self._summary.statistics is None:
            return
        counts = self._summary.statistics.channel_message_counts
        if found != counts.get(channel_id, found):
            raise ValueError(
                f"the index has {found} of {counts[channel_id]} messages"
            )

    def _check_ends(self, stream: BinaryIO) -> None:
        if stream.read(len(MAGIC)) != MAGIC:
            raise InputError(f"{self.path}: not an MCAP file")
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - len(MAGIC), len(MAGIC)))
        if stream.read() != MAGIC:
            raise InputError(
                f"{self.path}: the MCAP file is cut off or was not finished"
            )
        stream.seek(0)

    @contextlib.contextmanager
    def _reading(self) -> Iterator:
        with self._faults(), open(self.path, "rb") as stream:
            yield stream

    @contextlib.contextmanager
    def _faults(self) -> Iterator[None]:
        """Turns what a missing or damaged file raises into one line."""
        try:
            yield
        except OSError as error:
            fault = error.strerror or str(error)
            raise InputError(f"{self.path}: {fault}") from error
        except (
            McapError,
            EOFError,
            StopIteration,
            MemoryError,
            OverflowError,
            ValueError,
            RuntimeError,
            struct.error,
            zstandard.ZstdError,
        ) as error:
            raise InputError(
                f"{self.path}: damaged MCAP file ({error})"
            ) from error
