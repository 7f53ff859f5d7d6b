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
from typing import TypeVar
import zlib

import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Chunk, ChunkIndex
import numpy as np
import zstandard

from evaluation.errors import InputError
from evaluation.workers import num_cores

_Parsed = TypeVar("_Parsed")

_MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEADER = struct.Struct("<BQ")
# Of a message, after its record header: channel id, sequence, two times.
_MESSAGE_HEADER_BYTES = 2 + 4 + 8 + 8
# Of a message index, after its record header: channel id, length of the rest.
_INDEX_HEADER = struct.Struct("<HI")
_INDEX_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
# The frame that is being read, and its neighbour when two of them interleave.
_CHUNKS_KEPT = 2
# A broken or hostile length must not be taken for the size of a buffer.
_RECORD_LIMIT_BYTES = 1 << 30
_CHUNK_LIMIT_BYTES = 1 << 28


@dataclass(frozen=True)
class Location:
    """Where a message lies.

    Attributes:
        chunk: number of the chunk in the file's index.
        offset: of the message record in the uncompressed chunk [bytes].
        log_time_ns: when the message was logged [ns].
    """

    chunk: int
    offset: int
    log_time_ns: int


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
            self._summary = SeekingReader(
                stream, record_size_limit=_RECORD_LIMIT_BYTES
            ).get_summary()
        if self._summary is None or not self._summary.chunk_indexes:
            raise InputError(f"{self.path}: the MCAP file has no chunk index")
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
        if not any(
            index.name == name for index in self._summary.attachment_indexes
        ):
            return None
        with self._reading() as stream:
            for attachment in SeekingReader(
                stream, record_size_limit=_RECORD_LIMIT_BYTES
            ).iter_attachments():
                if attachment.name == name:
                    return attachment.data
        return None

    def _read_locations(self, topic: str) -> list[Location]:
        channel_id = self._channels[topic].id
        locations = []
        with self._reading() as stream:
            for number, chunk in enumerate(self._chunk_indexes):
                offset = chunk.message_index_offsets.get(channel_id)
                if offset is None:
                    continue
                stream.seek(offset + _RECORD_HEADER.size)
                _, length = _INDEX_HEADER.unpack(
                    stream.read(_INDEX_HEADER.size)
                )
                entries = np.frombuffer(stream.read(length), _INDEX_ENTRY)
                locations.extend(
                    Location(number, message_offset, log_time)
                    for log_time, message_offset in entries.tolist()
                )
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
                + _RECORD_HEADER.size
            )
            return memoryview(_uncompress(Chunk.read(ReadDataStream(stream))))

    def _message(self, chunk: memoryview, location: Location) -> memoryview:
        with self._faults():
            start = location.offset + _RECORD_HEADER.size
            _, length = _RECORD_HEADER.unpack(chunk[location.offset : start])
            message = chunk[start + _MESSAGE_HEADER_BYTES : start + length]
            if len(message) != length - _MESSAGE_HEADER_BYTES:
                raise EOFError("a message ends behind its chunk")
        return message

    def _check_ends(self, stream) -> None:
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise InputError(f"{self.path}: not an MCAP file")
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - len(_MAGIC), len(_MAGIC)))
        if stream.read() != _MAGIC:
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


def _uncompress(chunk: Chunk) -> bytes:
    """Returns a chunk's records; a small file cannot fill the memory.

    Raises:
        ValueError: if it is damaged, too large or of unknown compression.
        RuntimeError: if lz4 finds it damaged.
        zstandard.ZstdError: likewise.
    """
    size = chunk.uncompressed_size
    if size > _CHUNK_LIMIT_BYTES:
        raise ValueError(f"a chunk of {size} bytes")
    if chunk.compression == "zstd":
        # The library reserves what the data says of itself.
        claimed = zstandard.frame_content_size(chunk.data)
        if claimed not in (-1, size):
            raise ValueError(f"a chunk of {claimed} instead of {size} bytes")
        data = zstandard.decompress(chunk.data, size)
    elif chunk.compression == "lz4":
        unpacker = lz4.frame.LZ4FrameDecompressor()
        data = unpacker.decompress(chunk.data, max_length=size)
        if not unpacker.eof:
            raise ValueError(f"a chunk of more than {size} bytes")
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise ValueError(f"unknown compression {chunk.compression!r}")
    if len(data) != size:
        raise ValueError(f"a chunk of {len(data)} instead of {size} bytes")
    if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
        raise ValueError("the checksum of a chunk is wrong")
    return data
