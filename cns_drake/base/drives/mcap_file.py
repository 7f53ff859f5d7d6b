"""Random access to the messages of an MCAP file.

The `mcap` package reads messages in time order, or all of a span of time.
Reading a scan by its number needs the location of each message of a topic, and
the one chunk that holds it. Both come from the index at the end of a complete
file, so that opening a file of gigabytes reads a few kilobytes.

The package checks only the checksums of chunks, and trusts the sizes that a
chunk claims. Here damaged or hostile records are refused."""

from collections.abc import Iterator
import contextlib
import functools
import io
import os
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Attachment, Channel, Chunk
import numpy as np
import zstandard

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular

MAGIC = b"\x89MCAP0\r\n"
# Opcode and length.
RECORD_HEADER = struct.Struct("<BQ")
# A broken or hostile length must not be taken for the size of a buffer. A
# chunk holds a few scans; an index or a table of structures a few megabytes,
# of which Python makes a hundred times as much.
CHUNK_LIMIT_BYTES = 1 << 26
SUMMARY_LIMIT_BYTES = 1 << 25
_ATTACHMENT_LIMIT_BYTES = 1 << 23
# Size of a chunk's record without its data.
_CHUNK_FIELDS_BYTES = 1 << 10
# The last record: its header, where the summary begins, its offsets, its
# checksum.
_FOOTER = struct.Struct("<BQQQI")
# A message, after its record header: channel id, sequence, two times.
_MESSAGE_HEADER = struct.Struct("<HIQQ")
# A message index, after its record header: channel id, length of the rest.
_INDEX_HEADER = struct.Struct("<HI")
_INDEX_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
# The frame that is being read, and its neighbour when two of them interleave.
_CHUNKS_KEPT = 2
# The location of a message: the number of its chunk in the file's index, the
# offset of its record in the uncompressed chunk [bytes], its log time [ns] and
# the channel of its topic. Locations are an array, since a long drive has
# millions.
LOCATION = np.dtype(
    [
        ("chunk", "<u4"),
        ("offset", "<u8"),
        ("log_time_ns", "<u8"),
        ("channel_id", "<u2"),
    ]
)
_ORDER = ("log_time_ns", "chunk", "offset")


def parse_attachment(body: bytes) -> Attachment:
    """Returns the attachment whose record has this content.

    Raises:
        ValueError: if its checksum is wrong, or a field is cut off.
    """
    # The checksum of all that precedes it ends the record; 0 is none.
    checksum = int.from_bytes(body[-4:], "little")
    if checksum not in (0, zlib.crc32(body[:-4])):
        raise ValueError("the checksum of an attachment is wrong")
    return Attachment.read(RecordContent(body))


class RecordContent(ReadDataStream):
    """The content of one record; reads beyond its end are refused.

    Attributes:
        left: how much of it is still to be read [bytes].
    """

    def __init__(self, content: bytes):
        super().__init__(io.BytesIO(content))
        self.left = len(content)

    def read(self, length: int) -> bytes:
        """Returns the next bytes.

        Raises:
            ValueError: if there are fewer.
        """
        if not 0 <= length <= self.left:
            raise ValueError("a field reaches beyond the end of its record")
        self.left -= length
        return super().read(length)


def _read_body(stream: BinaryIO, limit: int, what: str) -> bytes:
    """Returns the content of the record at the stream's position."""
    _, length = RECORD_HEADER.unpack(stream.read(RECORD_HEADER.size))
    if length > limit:
        raise ValueError(f"{what} of {length} bytes")
    body = stream.read(length)
    if len(body) != length:
        raise EOFError(f"{what} ends behind the file")
    return body


def uncompress(chunk: Chunk) -> bytes:
    """Returns a chunk's records; a small file cannot fill the memory.

    Raises:
        ValueError: if it is damaged, too large or of unknown compression.
        RuntimeError: if lz4 finds it damaged.
        zstandard.ZstdError: likewise.
    """
    size = chunk.uncompressed_size
    if size > CHUNK_LIMIT_BYTES:
        raise ValueError(f"a chunk of {size} bytes")
    if chunk.compression == "zstd":
        # The library reserves the size that the data claim.
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


class McapFile:
    """An indexed MCAP file, open for reading single messages.

    The file is opened for each access only; two uncompressed chunks (of
    1 MiB as a rule) are kept, since messages are mostly read in order.

    All channels of a topic are one stream of messages, as when several nodes
    publish on it.
    """

    def __init__(self, path: Path):
        """Reads the index.

        Raises:
            InputError: if there is no such file, or it is no complete and
                indexed MCAP file.
        """
        self.path = Path(path)
        check_regular(self.path)
        with self._reading() as stream:
            self._check_ends(stream)
            summary = SeekingReader(
                stream, record_size_limit=SUMMARY_LIMIT_BYTES
            ).get_summary()
        if summary is None or not summary.chunk_indexes:
            raise InputError(f"{self.path}: the MCAP file has no chunk index")
        self._summary = summary
        self._chunk_indexes = sorted(
            summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset
        )
        self._channels: dict[str, list[Channel]] = {}
        for _, channel in sorted(self._summary.channels.items()):
            self._channels.setdefault(channel.topic, []).append(channel)
        self._check_channels()
        self._locations: dict[str, np.ndarray] = {}
        self._chunk = functools.lru_cache(_CHUNKS_KEPT)(self._unpack)

    @property
    def topics(self) -> dict[str, list[str]]:
        """Topic -> kinds of its messages: `<type> in <encoding>`, sorted.

        A sound recording has one kind for each topic.
        """
        return {
            topic: sorted({self._kind(channel) for channel in channels})
            for topic, channels in self._channels.items()
        }

    def locate(self, topic: str) -> np.ndarray:
        """Returns where a topic's messages lie, in the order of time.

        Returns:
            (N,) of `LOCATION`.

        Raises:
            InputError: if the index cannot be read.
        """
        if topic not in self._locations:
            self._locations[topic] = self._read_locations(topic)
        return self._locations[topic]

    def step_back_ns(self, topic: str) -> int:
        """Returns the largest step back of a topic's log time in the file [ns].

        Raises:
            InputError: if the index cannot be read.
        """
        places = self.locate(topic)
        order = np.lexsort((places["offset"], places["chunk"]))
        times_ns = places["log_time_ns"][order].astype(np.int64)
        return max(0, -int(np.diff(times_ns).min(initial=0)))

    def read(self, location: np.void) -> memoryview:
        """Returns the serialised message at a location.

        Raises:
            InputError: if the chunk is damaged.
        """
        return self._message(self._chunk(int(location["chunk"])), location)

    def visit(self, locations: np.ndarray) -> Iterator[tuple[int, memoryview]]:
        """Yields many messages in the file's order, unpacking each chunk once.

        Args:
            locations: (N,) of `LOCATION`.

        Yields:
            A position in `locations`, and the serialised message there.

        Raises:
            InputError: if a chunk is damaged.
        """
        order = np.lexsort((locations["offset"], locations["chunk"]))
        for i in order.tolist():
            yield i, self.read(locations[i])

    def attachment(self, name: str) -> bytes | None:
        """Returns the content of the attachment of this name, if any.

        Raises:
            InputError: if it cannot be read, or others of this name differ.
        """
        content = None
        for index in self._summary.attachment_indexes:
            if index.name != name:
                continue
            with self._reading() as stream:
                stream.seek(index.offset)
                limit = _ATTACHMENT_LIMIT_BYTES
                body = _read_body(stream, limit, "an attachment")
                data = parse_attachment(body).data
            if content not in (None, data):
                raise InputError(
                    f"{self.path}: attachment {name}: two attachments of this "
                    "name differ"
                )
            content = data
        return content

    def _kind(self, channel: Channel) -> str:
        schema = self._summary.schemas.get(channel.schema_id)
        name = "a message without a type" if schema is None else schema.name
        return f"{name} in {channel.message_encoding}"

    def _read_locations(self, topic: str) -> np.ndarray:
        parts = [np.empty(0, LOCATION)]
        with self._reading() as stream:
            # Many indexes at one place could claim more than the file holds.
            left = stream.seek(0, os.SEEK_END)
            for channel in self._channels[topic]:
                found = 0
                for number, chunk in enumerate(self._chunk_indexes):
                    offset = chunk.message_index_offsets.get(channel.id)
                    if offset is None:
                        continue
                    part = self._read_index(stream, offset, left)
                    part["chunk"], part["channel_id"] = number, channel.id
                    left -= len(part) * _INDEX_ENTRY.itemsize
                    found += len(part)
                    parts.append(part)
                statistics = self._summary.statistics
                if statistics is not None:
                    count = statistics.channel_message_counts.get(channel.id)
                    if count not in (None, found):
                        raise ValueError(
                            f"the index has {found} of {count} messages"
                        )
        locations = np.concatenate(parts)
        places = np.sort(locations[["chunk", "offset"]])
        if (places[1:] == places[:-1]).any():
            raise InputError(
                f"{self.path}: {topic}: the index lists a message twice"
            )
        # Messages of equal time keep the file's order.
        return locations[np.lexsort([locations[key] for key in _ORDER[::-1]])]

    @staticmethod
    def _read_index(stream: BinaryIO, offset: int, left: int) -> np.ndarray:
        """Returns the index at an offset, which has at most `left` bytes."""
        stream.seek(offset + RECORD_HEADER.size)
        _, length = _INDEX_HEADER.unpack(stream.read(_INDEX_HEADER.size))
        if length > left:
            raise ValueError("the indexes of the chunks overlap")
        entries = np.frombuffer(stream.read(length), _INDEX_ENTRY)
        part = np.zeros(len(entries), LOCATION)
        part["offset"] = entries["offset"]
        part["log_time_ns"] = entries["log_time"]
        return part

    def _unpack(self, number: int) -> memoryview:
        """Reads and uncompresses a chunk whose checksum is right."""
        index = self._chunk_indexes[number]
        with self._reading() as stream:
            stream.seek(index.chunk_start_offset)
            limit = CHUNK_LIMIT_BYTES + _CHUNK_FIELDS_BYTES
            body = _read_body(stream, limit, "a chunk")
            chunk = Chunk.read(RecordContent(body))
            if chunk.uncompressed_size != index.uncompressed_size:
                raise ValueError(
                    f"a chunk of {chunk.uncompressed_size} bytes, of"
                    f" {index.uncompressed_size} by the index"
                )
            return memoryview(uncompress(chunk))

    def _message(self, chunk: memoryview, location: np.void) -> memoryview:
        _, offset, expected_time_ns, expected_channel_id = location.item()
        with self._faults():
            start = offset + RECORD_HEADER.size
            _, length = RECORD_HEADER.unpack(chunk[offset:start])
            body = chunk[start : start + length]
            if len(body) != length:
                raise EOFError("a message ends behind its chunk")
            channel_id, _, log_time_ns, _ = _MESSAGE_HEADER.unpack_from(body)
            # No other check detects a damaged message index.
            if (channel_id, log_time_ns) != (
                expected_channel_id,
                expected_time_ns,
            ):
                raise ValueError("a message is not where the index says")
        return body[_MESSAGE_HEADER.size :]

    def _check_channels(self) -> None:
        """Refuses messages of a channel that the summary does not name."""
        used = {
            number
            for chunk in self._chunk_indexes
            for number in chunk.message_index_offsets
        }
        statistics = self._summary.statistics
        if statistics is not None:
            used |= statistics.channel_message_counts.keys()
        unknown = used - self._summary.channels.keys()
        if unknown:
            raise InputError(
                f"{self.path}: messages of channel {min(unknown)}, which the "
                "summary does not list"
            )

    def _check_ends(self, stream: BinaryIO) -> None:
        """Refuses a file that is not whole, or whose summary is damaged."""
        if stream.read(len(MAGIC)) != MAGIC:
            raise InputError(f"{self.path}: not an MCAP file")
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - len(MAGIC), len(MAGIC)))
        if stream.read() != MAGIC:
            raise InputError(
                f"{self.path}: the MCAP file is cut off or was not finished"
            )
        end = stream.seek(max(size - len(MAGIC) - _FOOTER.size, 0))
        _, _, start, _, checksum = _FOOTER.unpack(stream.read(_FOOTER.size))
        if start > end:
            raise ValueError("the summary begins behind its end")
        if start > 0 and end - start > SUMMARY_LIMIT_BYTES:
            raise ValueError(f"a summary of {end - start} bytes")
        if start > 0 and checksum > 0:
            stream.seek(start)
            # Up to the checksum itself.
            summary = stream.read(end + _FOOTER.size - 4 - start)
            if zlib.crc32(summary) != checksum:
                raise ValueError("the checksum of the summary is wrong")
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
            # Some of these errors have no message.
            fault = str(error) or type(error).__name__
            raise InputError(
                f"{self.path}: damaged MCAP file ({fault})"
            ) from error
