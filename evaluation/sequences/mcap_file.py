"""Random access to the messages of an MCAP file.

The `mcap` package reads messages in time order, or all of a span of time. A
scan by number needs less and more: where each message of a topic lies, and
the one chunk that holds it. Both come from the index that a complete file
ends with, so that opening a file of gigabytes reads a few kilobytes.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
import contextlib
from dataclasses import dataclass
import os
from pathlib import Path
import struct

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Chunk, ChunkIndex, MessageIndex
from mcap.stream_reader import get_chunk_data_stream
import zstandard

from evaluation.errors import InputError

_MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEADER = struct.Struct("<BQ")
# Of a message, after its record header: channel id, sequence, two times.
_MESSAGE_HEADER_BYTES = 2 + 4 + 8 + 8
# The frame that is being read, and its neighbour when two of them interleave.
_CHUNKS_KEPT = 2
# A broken length field must not be taken for the size of a buffer.
_RECORD_LIMIT_BYTES = 1 << 30


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
        chunk = self._chunk(location.chunk)
        with self._faults():
            start = location.offset + _RECORD_HEADER.size
            _, length = _RECORD_HEADER.unpack(chunk[location.offset : start])
            message = chunk[start + _MESSAGE_HEADER_BYTES : start + length]
            if len(message) != length - _MESSAGE_HEADER_BYTES:
                raise EOFError("a message ends behind its chunk")
        return message

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
                index = MessageIndex.read(ReadDataStream(stream))
                locations.extend(
                    Location(number, message_offset, log_time)
                    for log_time, message_offset in index.records
                )
        # Stable, so that messages of one time keep the file's order.
        return sorted(locations, key=lambda location: location.log_time_ns)

    def _chunk(self, number: int) -> memoryview:
        """Returns an uncompressed chunk whose checksum is right."""
        if number in self._chunks:
            self._chunks.move_to_end(number)
            return self._chunks[number]
        with self._reading() as stream:
            stream.seek(
                self._chunk_indexes[number].chunk_start_offset
                + _RECORD_HEADER.size
            )
            chunk = Chunk.read(ReadDataStream(stream))
            content, size = get_chunk_data_stream(chunk, validate_crc=True)
            data = memoryview(content.read(size))
        self._chunks[number] = data
        if len(self._chunks) > _CHUNKS_KEPT:
            self._chunks.popitem(last=False)
        return data

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
            ValueError,
            RuntimeError,
            struct.error,
            zstandard.ZstdError,
        ) as error:
            raise InputError(
                f"{self.path}: damaged MCAP file ({error})"
            ) from error
