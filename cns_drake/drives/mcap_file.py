"""Random access to the messages of an MCAP file.

The `mcap` package reads messages in the order of time: all messages, or the
messages of an interval. To read a scan by its number, this module finds the
location of each message of a topic, and reads only the chunk that contains the
scan. The locations come from the index at the end of a complete file, so that
opening a file of gigabytes reads a few kilobytes. The format makes this index
optional. If the message counts at the end of the file do not confirm the index,
the whole file is read once.

The `mcap` package checks only the checksums of chunks, and trusts the sizes
that a chunk declares. This module refuses damaged or hostile records.
"""

from collections.abc import Iterator
import contextlib
import functools
import os
from pathlib import Path
import struct
from typing import Any, BinaryIO

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata
import numpy as np
import zstandard

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular, user_errors
from cns_drake.drives.mcap_contents import (
    REPAIR_ADVICE,
    Contents,
    read_summary,
)
from cns_drake.drives.mcap_records import (
    CHUNK_LIMIT_BYTES,
    RECORD_HEADER,
    RecordContent,
    parse_attachment,
    uncompress,
)

# A table of structures has a few megabytes, too.
_ATTACHMENT_LIMIT_BYTES = 1 << 23
# Size of a chunk's record without its data.
_CHUNK_FIELDS_BYTES = 1 << 10
_RECORD_LIMIT_BYTES = CHUNK_LIMIT_BYTES + _CHUNK_FIELDS_BYTES
# A message, after its record header: channel id, sequence, two times.
_MESSAGE_HEADER = struct.Struct("<HIQQ")
# A message index, after its record header: channel id, length of the rest.
_INDEX_HEADER = struct.Struct("<HI")
# An entry of the rest: log time [ns], and offset in the chunk [bytes].
_INDEX_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
# The chunk that is being read, and its neighbour where messages interleave.
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


def _read_body(stream: BinaryIO, limit: int, what: str) -> bytes:
    """Returns the content of the record at the stream's position."""
    _, length = RECORD_HEADER.unpack(stream.read(RECORD_HEADER.size))
    if length > limit:
        raise ValueError(f"{what} of {length} bytes")
    body = stream.read(length)
    if len(body) != length:
        raise EOFError(f"{what} ends behind the file")
    return body


class McapFile:
    """An MCAP file, open for reading single messages.

    The file is open only during each access. The last two chunks that were read
    stay in memory uncompressed, since messages are mostly read in order.

    If a topic has several channels, for example because several nodes publish
    on the topic, the messages of all channels are read as one stream.

    Attributes:
        path: path of the file.
    """

    def __init__(self, path: Path):
        """Opens a file and reads its index.

        Raises:
            InputError: if there is no such file, or it is not a complete MCAP
                file.
        """
        self.path = Path(path)
        check_regular(self.path)
        with self._reading() as stream:
            summary = read_summary(stream, self.path)
            self._contents = Contents.of(summary)
            if not self._contents.is_whole():
                self._contents = self._contents.read_through(stream)
        self._channels: dict[str, list[Channel]] = {}
        for _, channel in sorted(self._contents.channels.items()):
            self._channels.setdefault(channel.topic, []).append(channel)
        self._locations: dict[str, np.ndarray] = {}
        self._chunk = functools.lru_cache(_CHUNKS_KEPT)(self._unpack)

    @property
    def topics(self) -> dict[str, list[str]]:
        """Maps topics to sorted types of messages, as `<type> in <encoding>`.

        In an intact recording each topic has exactly one such entry.
        """
        return {
            topic: sorted({self._kind(channel) for channel in channels})
            for topic, channels in self._channels.items()
        }

    def locate(self, topic: str) -> np.ndarray:
        """Returns the locations of a topic's messages in the file, by time.

        Returns:
            (N,) of dtype `cns_drake.drives.mcap_file.LOCATION`: chunk,
            offset in the chunk, log time [ns] and channel of each message.

        Raises:
            InputError: if the index cannot be read.
        """
        if topic not in self._locations:
            self._locations[topic] = self._read_locations(topic)
        return self._locations[topic]

    def step_back_ns(self, topic: str) -> int:
        """Returns the largest decrease of log time between two messages [ns].

        The two messages are consecutive messages of one topic, in the order in
        which they were written. The result is 0 if the log times never
        decrease.

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
            InputError: if the chunk that contains the message is damaged.
        """
        place: Any = location.item()
        return self._message(self._chunk(place[0]), place)

    def visit(self, locations: np.ndarray) -> Iterator[tuple[int, memoryview]]:
        """Yields many messages in file order, unpacking each chunk once.

        Args:
            locations: (N,) rows of `McapFile.locate`, in any order.

        Yields:
            The index of a message in `locations`, and the serialised message.

        Raises:
            InputError: if a chunk is damaged.
        """
        order = np.lexsort((locations["offset"], locations["chunk"]))
        places = locations[order].tolist()
        for index, place in zip(order.tolist(), places, strict=True):
            yield index, self._message(self._chunk(place[0]), place)

    def attachment(self, name: str) -> bytes | None:
        """Returns the content of the attachment of this name, if any.

        Raises:
            InputError: the attachment cannot be read, or several attachments of
                this name differ.
        """
        content = None
        for found, offset in self._contents.attachments:
            if found != name:
                continue
            with self._reading() as stream:
                stream.seek(offset)
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

    def metadata(self, name: str) -> list[dict[str, str]]:
        """Returns the contents of all metadata records of this name.

        Raises:
            InputError: a record cannot be read.
        """
        found = []
        for record_name, offset in self._contents.metadata:
            if record_name == name:
                with self._reading() as stream:
                    stream.seek(offset)
                    limit = _ATTACHMENT_LIMIT_BYTES
                    body = _read_body(stream, limit, "a metadata record")
                    content = Metadata.read(RecordContent(body))
                    found.append(content.metadata)
        return found

    def _kind(self, channel: Channel) -> str:
        schema = self._contents.schemas.get(channel.schema_id)
        name = "a message without a type" if schema is None else schema.name
        return f"{name} in {channel.message_encoding}"

    def _read_locations(self, topic: str) -> np.ndarray:
        numbers = [channel.id for channel in self._channels[topic]]
        if self._contents.found is None:
            locations = self._indexed(numbers)
            counts = self._contents.statistics.channel_message_counts  # type: ignore[union-attr]  # It is whole.
            if len(locations) != sum(
                counts.get(number, 0) for number in numbers
            ):
                # Message indexes are optional, too.
                with self._reading() as stream:
                    self._contents = self._contents.read_through(stream)
        found = self._contents.found
        if found is not None:
            locations = np.array(
                [
                    (block, offset, log_time_ns, number)
                    for number in numbers
                    for block, offset, log_time_ns in found.get(number, ())
                ],
                LOCATION,
            )
        chunk, offset = locations["chunk"], locations["offset"]
        order = np.lexsort((offset, chunk))
        twice = np.diff(chunk[order]) == 0
        if (twice & (np.diff(offset[order]) == 0)).any():
            raise InputError(
                f"{self.path}: {topic}: the index lists a message twice"
            )
        # Messages of equal time keep the file's order.
        return locations[np.lexsort([locations[key] for key in _ORDER[::-1]])]

    def _indexed(self, numbers: list[int]) -> np.ndarray:
        """Returns the locations (N,) of channels' messages from the index."""
        # Arrays of a few rows each would take longer to join than to read.
        parts: list[bytes] = []
        blocks: list[int] = []
        channels: list[int] = []
        with self._reading() as stream:
            # Many indexes at one place could claim more than the file holds.
            left = stream.seek(0, os.SEEK_END)
            for number in numbers:
                for block, offsets in enumerate(self._contents.indexes):
                    if number not in offsets:
                        continue
                    part = self._read_index(stream, offsets[number], left)
                    left -= len(part)
                    parts.append(part)
                    blocks.append(block)
                    channels.append(number)
        entries = np.frombuffer(b"".join(parts), _INDEX_ENTRY)
        counts = [len(part) // _INDEX_ENTRY.itemsize for part in parts]
        locations = np.empty(len(entries), LOCATION)
        locations["chunk"] = np.repeat(np.array(blocks, "<u4"), counts)
        locations["offset"] = entries["offset"]
        locations["log_time_ns"] = entries["log_time"]
        locations["channel_id"] = np.repeat(np.array(channels, "<u2"), counts)
        return locations

    @staticmethod
    def _read_index(stream: BinaryIO, offset: int, left: int) -> bytes:
        """Returns the entries of an index of at most `left` bytes."""
        stream.seek(offset + RECORD_HEADER.size)
        _, length = _INDEX_HEADER.unpack(stream.read(_INDEX_HEADER.size))
        if length > left:
            raise ValueError("the indexes of the chunks overlap")
        entries = stream.read(length)
        if len(entries) != length or length % _INDEX_ENTRY.itemsize:
            raise ValueError("the index of a chunk is cut off")
        return entries

    def _unpack(self, number: int) -> memoryview:
        """Reads and uncompresses a chunk whose checksum is right."""
        with self._reading() as stream:
            start = stream.seek(self._contents.blocks[number])
            opcode = int.from_bytes(stream.read(1), "little")
            stream.seek(start)
            body = _read_body(stream, _RECORD_LIMIT_BYTES, "a chunk")
            if opcode == Opcode.MESSAGE:
                return memoryview(RECORD_HEADER.pack(opcode, len(body)) + body)
            return memoryview(uncompress(Chunk.read(RecordContent(body))))

    def _message(self, chunk: memoryview, place: Any) -> memoryview:
        _, offset, expected_time_ns, expected_channel_id = place
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

    @contextlib.contextmanager
    def _reading(self) -> Iterator:
        with (
            user_errors(self.path),
            self._faults(),
            open(self.path, "rb") as stream,
        ):
            yield stream

    @contextlib.contextmanager
    def _faults(self) -> Iterator[None]:
        """Turns the errors of a damaged file into an InputError of one line."""
        try:
            yield
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
                f"{self.path}: damaged MCAP file ({fault}) {REPAIR_ADVICE}"
            ) from error
