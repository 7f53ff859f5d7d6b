"""Random access to the messages of an MCAP file.

The `mcap` package reads messages in the order of time: all messages, or the
messages of an interval. To read a scan by its number, this module finds the
location of each message of a topic, and reads only the chunk that contains the
scan. The locations come from the index at the end of a complete file, so that
opening a file of gigabytes reads a few kilobytes. The format makes this index
optional. If the message counts at the end of the file do not confirm the index,
the whole file is read once.

The package's records are used, but not its readers: they check only the
checksums of chunks, and reserve the sizes that a record or a chunk declares.
Here every size of a record is checked against the file before memory is
reserved, and every checksum is checked.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
import contextlib
from dataclasses import dataclass, field
import functools
import io
import os
from pathlib import Path
import struct
from typing import Any, BinaryIO
import zlib

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    Header,
    McapRecord,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
import numpy as np

from evaluation.base import (
    InputError,
    check_regular,
    reading,
    unpacked,
    user_errors,
    value_errors,
)
from evaluation.drives.bag_index import BagIndex, Entry, check_unpacked
from evaluation.drives.mcap_messages import read_stamp

_MAGIC = b"\x89MCAP0\r\n"
# Opcode and length.
_RECORD_HEADER = struct.Struct("<BQ")
# The last record: its header, where the summary begins, its offsets, its
# checksum.
_FOOTER = struct.Struct("<BQQQI")
# A chunk's index, after its record header: where the chunk begins, and the size
# of the table of message indexes that follows.
_CHUNK_INDEX = struct.Struct("<16xQ8xI")
# An entry of this table: a channel id, and an offset.
_CHUNK_INDEX_ENTRY = struct.Struct("<HQ")
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
# How to read a damaged file, for error messages.
_ADVICE = "(mcap recover IN -o OUT, of the program mcap, saves what is intact)"
# What reading a damaged file can raise.
_FAULTS = (
    McapError,
    EOFError,
    StopIteration,
    OverflowError,
    ValueError,
    RuntimeError,
    struct.error,
)


class McapFile:
    """An MCAP file, open for reading single messages.

    The file is open only during each access. The last two chunks that were read
    stay in memory uncompressed, since messages are mostly read in order.

    If a topic has several channels, for example because several nodes publish
    on the topic, the messages of all channels are read as one stream.

    Attributes:
        path: path of the file.
        names, notes, joints_ns: as of `RosbagFile`; there is one file.
    """

    names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    joints_ns: tuple[int, ...] = ()

    def __init__(self, path: Path):
        """Opens a file and reads its index.

        Raises:
            InputError: if there is no such file, or it is not a complete MCAP
                file.
        """
        self.path = Path(path)
        check_regular(self.path)
        with self._reading() as stream:
            summary = _read_summary(stream, self.path)
            self._contents = _Contents.of(summary)
            check_unpacked(sum(self._contents.sizes), _size_of(stream))
            if not self._contents.is_whole():
                self._contents = self._contents.read_through(stream)
        self._channels: dict[str, list[Channel]] = {}
        for _, channel in sorted(self._contents.channels.items()):
            self._channels.setdefault(channel.topic, []).append(channel)
        self._locations: dict[str, np.ndarray] = {}
        self.index = BagIndex(self.files, self._entries)
        self._chunk = functools.lru_cache(_CHUNKS_KEPT)(self._unpack)

    @property
    def topics(self) -> dict[str, list[str]]:
        """Maps topics to sorted types of messages.

        A type of messages that are not in CDR is `<type> in <encoding>`.

        In an intact recording each topic has exactly one such entry. Channels
        without a message do not count: `ros2 bag record` writes them for all
        topics that there are.
        """
        used = self._used
        found = {
            topic: sorted(
                {self._kind(one) for one in channels if one.id in used}
            )
            for topic, channels in self._channels.items()
        }
        return {topic: kinds for topic, kinds in found.items() if kinds}

    @property
    def empty_topics(self) -> list[str]:
        """Topics without a message."""
        used = self.topics
        return [one for one in self._channels if one not in used]

    @property
    def _used(self) -> set[int]:
        """The ids of channels with messages."""
        contents = self._contents
        if contents.found is not None:
            return set(contents.found)
        counts = contents.statistics.channel_message_counts  # type: ignore[union-attr]  # It is whole.
        return {number for number, count in counts.items() if count}

    @property
    def files(self) -> tuple[Path, ...]:
        """The file."""
        return (self.path,)

    def locate(self, topic: str) -> np.ndarray:
        """Returns the locations of a topic's messages in the file, by time.

        Returns:
            (N,) of dtype `evaluation.drives.mcap_file.LOCATION`: chunk,
            offset in the chunk, log time [ns] and channel of each message.

        Raises:
            InputError: if the index cannot be read.
        """
        if topic not in self._locations:
            self._locations[topic] = self._read_locations(topic)
        return self._locations[topic]

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

    def _entries(
        self, topics: Collection[str], kept: Collection[str]
    ) -> Iterator[Entry]:
        """Yields all messages of topics, each topic by time, in file order."""
        places = [self.locate(topic) for topic in topics]
        names = [
            topic
            for topic, of_topic in zip(topics, places, strict=True)
            for _ in of_topic
        ]
        joined = np.concatenate([np.zeros(0, LOCATION), *places])
        found: dict[int, Entry] = {}
        for number, data in self.visit(joined):
            topic = names[number]
            with value_errors(f"{self.path}: {topic}"):
                stamp_ns = read_stamp(data) or 0
            found[number] = Entry(
                topic,
                int(joined["log_time_ns"][number]),
                stamp_ns,
                zlib.crc32(data),
                bytes(data) if topic in kept else None,
            )
        for number in range(len(names)):
            yield found[number]

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
            with self._reading() as stream, _place_named(offset):
                _, body = _read_record(stream, offset, "an attachment")
                data = _parse_attachment(body).data
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
                with self._reading() as stream, _place_named(offset):
                    _, body = _read_record(stream, offset, "a metadata record")
                    content = Metadata.read(_RecordContent(body))
                    found.append(content.metadata)
        return found

    @functools.cached_property
    def library(self) -> str:
        """Name and version of the program that wrote the file.

        Raises:
            InputError: the header cannot be read.
        """
        start = len(_MAGIC)
        with self._reading() as stream, _place_named(start):
            _, body = _read_record(stream, start, "the header")
            return Header.read(_RecordContent(body)).library

    def _kind(self, channel: Channel) -> str:
        schema = self._contents.schemas.get(channel.schema_id)
        name = "a message without a type" if schema is None else schema.name
        encoding = channel.message_encoding
        return name if encoding == "cdr" else f"{name} in {encoding}"

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
            for number in numbers:
                for block, offsets in enumerate(self._contents.indexes):
                    if number not in offsets:
                        continue
                    parts.append(self._read_index(stream, offsets[number]))
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
    def _read_index(stream: BinaryIO, offset: int) -> bytes:
        """Returns the entries of an index."""
        stream.seek(offset + _RECORD_HEADER.size)
        _, length = _INDEX_HEADER.unpack(stream.read(_INDEX_HEADER.size))
        entries = stream.read(length)
        if len(entries) != length or length % _INDEX_ENTRY.itemsize:
            raise ValueError("the index of a chunk is cut off")
        return entries

    def _unpack(self, number: int) -> memoryview:
        """Reads and uncompresses a chunk whose checksum is right."""
        start = self._contents.blocks[number]
        with self._reading() as stream, _place_named(start):
            opcode, body = _read_record(stream, start, "a chunk")
            if opcode == Opcode.MESSAGE:
                return memoryview(_RECORD_HEADER.pack(opcode, len(body)) + body)
            chunk = Chunk.read(_RecordContent(body))
            sizes = self._contents.sizes
            if sizes and chunk.uncompressed_size > sizes[number]:
                raise ValueError("a chunk larger than the index says")
            return memoryview(_uncompress(chunk))

    def _message(self, chunk: memoryview, place: Any) -> memoryview:
        _, offset, expected_time_ns, expected_channel_id = place
        with self._faults():
            start = offset + _RECORD_HEADER.size
            _, length = _RECORD_HEADER.unpack(chunk[offset:start])
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
            reading(self.path),
            self._faults(),
            open(self.path, "rb") as stream,
        ):
            yield stream

    @contextlib.contextmanager
    def _faults(self) -> Iterator[None]:
        """Turns the errors of a damaged file into an InputError of one line."""
        try:
            yield
        except _FAULTS as error:
            # Some of these errors have no message.
            fault = str(error) or type(error).__name__
            raise InputError(
                f"{self.path}: damaged MCAP file ({fault}) {_ADVICE}"
            ) from error


@dataclass
class _Contents:
    """The contents of a file, by type of record.

    Attributes:
        schemas: id -> schema.
        channels: id -> channel.
        blocks: offset in the file of each chunk, or of each message outside of
            chunks, in the file's order [bytes].
        sizes: the uncompressed size of each block, as the index states it
            [bytes]; empty without an index.
        indexes: for each block, channel id -> offset of the message index
            [bytes].
        attachments: (name, offset in the file [bytes]) of each attachment.
        metadata: (name, offset in the file [bytes]) of each metadata record.
        found: maps a channel id to (block, offset in the block, log time [ns])
            of each message; None if `indexes` are used to find the messages.
        statistics: the file's statistics record; None without one.
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    blocks: list[int] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    indexes: list[dict[int, int]] = field(default_factory=list)
    attachments: list[tuple[str, int]] = field(default_factory=list)
    metadata: list[tuple[str, int]] = field(default_factory=list)
    found: dict[int, list[tuple[int, int, int]]] | None = None
    statistics: Statistics | None = None

    @classmethod
    def of(cls, summary: bytes) -> _Contents:
        """Returns the contents of a file, as its summary section lists them.

        With the `mcap` package, reading this section would take longer than
        reading all poses.
        """
        contents = cls()
        chunks: list[tuple[int, int, dict[int, int]]] = []
        position = 0
        while position < len(summary):
            start = position + _RECORD_HEADER.size
            opcode, length = _RECORD_HEADER.unpack(summary[position:start])
            position = start + length
            if position > len(summary):
                raise ValueError("a record reaches beyond the summary")
            body = summary[start:position]
            if opcode == Opcode.CHUNK_INDEX:
                chunks.append(_chunk_offsets(body))
            elif opcode == Opcode.SCHEMA:
                schema = Schema.read(_RecordContent(body))
                contents.schemas[schema.id] = schema
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(_RecordContent(body))
                contents.channels[channel.id] = channel
            elif opcode == Opcode.STATISTICS:
                contents.statistics = Statistics.read(_RecordContent(body))
            elif opcode == Opcode.ATTACHMENT_INDEX:
                attachment = AttachmentIndex.read(_RecordContent(body))
                contents.attachments.append(
                    (attachment.name, attachment.offset)
                )
            elif opcode == Opcode.METADATA_INDEX:
                other = MetadataIndex.read(_RecordContent(body))
                contents.metadata.append((other.name, other.offset))
        chunks.sort(key=lambda chunk: chunk[0])
        contents.blocks = [start for start, _, _ in chunks]
        contents.sizes = [size for _, size, _ in chunks]
        contents.indexes = [offsets for _, _, offsets in chunks]
        return contents

    def is_whole(self) -> bool:
        """Returns whether all contents are there that the statistics count.

        Without statistics, the result is False.
        """
        counts = self.statistics
        used = set().union(*self.indexes)
        return counts is not None and (
            len(self.schemas),
            len(self.channels),
            len(self.blocks),
            len(self.attachments),
            used | counts.channel_message_counts.keys() <= self.channels.keys(),
            sum(counts.channel_message_counts.values()),
        ) == (
            counts.schema_count,
            counts.channel_count,
            counts.chunk_count,
            counts.attachment_count,
            True,
            counts.message_count,
        )

    def read_through(self, stream: BinaryIO) -> _Contents:
        """Returns the contents of the whole file, found without an index.

        Schemas, channels and statistics of the summary are taken over.

        Raises:
            ValueError: the file is damaged, or has fewer messages than its
                statistics state.
        """
        told = self.statistics
        contents = _Contents(
            dict(self.schemas), dict(self.channels), statistics=told
        )
        found: dict[int, list[tuple[int, int, int]]] = {}
        contents.found = found
        there = 0
        for start, offset, record in _locate_records(stream):
            if isinstance(record, Schema):
                contents.schemas.setdefault(record.id, record)
            elif isinstance(record, Channel):
                contents.channels.setdefault(record.id, record)
            elif isinstance(record, Attachment):
                contents.attachments.append((record.name, start))
            elif isinstance(record, Metadata):
                contents.metadata.append((record.name, start))
            elif isinstance(record, Message):
                if contents.blocks[-1:] != [start]:
                    contents.blocks.append(start)
                found.setdefault(record.channel_id, []).append(
                    (len(contents.blocks) - 1, offset, record.log_time)
                )
                there += 1
        unknown = found.keys() - contents.channels.keys()
        if unknown:
            raise ValueError(f"channel {min(unknown)} is defined nowhere")
        if told is not None and there != told.message_count:
            raise ValueError(
                f"{there} of {told.message_count} messages are there"
            )
        return contents


def _size_of(stream: BinaryIO) -> int:
    return os.fstat(stream.fileno()).st_size


def _chunk_offsets(body: bytes) -> tuple[int, int, dict[int, int]]:
    """Returns what a chunk's index says of it.

    Returns:
        Its offset, its uncompressed size, and the offset of its message index
        by channel [bytes].
    """
    start, size = _CHUNK_INDEX.unpack_from(body)
    table = body[_CHUNK_INDEX.size : _CHUNK_INDEX.size + size]
    if len(table) != size:
        raise ValueError("the index of a chunk is cut off")
    # The uncompressed size ends the record.
    unpacked_bytes = int.from_bytes(body[-8:], "little")
    return start, unpacked_bytes, dict(_CHUNK_INDEX_ENTRY.iter_unpack(table))


def _read_summary(stream: BinaryIO, path: Path) -> bytes:
    """Returns the summary section; refuses a file that is not whole.

    Returns:
        The records of the section; empty for a file without this section.

    Raises:
        ValueError: the summary is damaged.
    """
    if stream.read(len(_MAGIC)) != _MAGIC:
        raise InputError(f"{path}: not an MCAP file")
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(size - len(_MAGIC), len(_MAGIC)))
    if stream.read() != _MAGIC:
        raise InputError(
            f"{path}: the MCAP file is cut off or was not finished; it is"
            f" intact up to byte {_intact_bytes(stream)} of {size} {_ADVICE}"
        )
    end = stream.seek(max(size - len(_MAGIC) - _FOOTER.size, 0))
    footer = stream.read(_FOOTER.size)
    opcode, _, start, _, checksum = _FOOTER.unpack(footer)
    if opcode != Opcode.FOOTER:
        raise ValueError("the footer is missing")
    if start == 0:
        return b""
    if start > end:
        raise ValueError("the summary begins behind its end")
    stream.seek(start)
    summary = stream.read(end - start)
    # The checksum is also that of the footer up to the checksum itself.
    if checksum > 0 and zlib.crc32(summary + footer[:-4]) != checksum:
        raise ValueError("the checksum of the summary is wrong")
    return summary


def _read_record(
    stream: BinaryIO, position: int, what: str
) -> tuple[int, bytes]:
    """Returns the opcode and the content of the record at a position.

    Args:
        position: place of the record in the file [bytes].
        what: kind of the record, for error messages.

    Raises:
        ValueError: there is no record.
        EOFError: the record reaches beyond the end of the file.
    """
    stream.seek(position)
    header = stream.read(_RECORD_HEADER.size)
    if len(header) < _RECORD_HEADER.size:
        raise EOFError("the file ends too early")
    opcode, length = _RECORD_HEADER.unpack(header)
    if opcode == 0:
        raise ValueError("there is no record")
    start = stream.tell()
    if length > stream.seek(0, os.SEEK_END) - start:
        raise EOFError(f"{what} ends behind the file")
    stream.seek(start)
    body = stream.read(length)
    return opcode, body


def _parse_attachment(body: bytes) -> Attachment:
    """Returns the attachment in the content of a record.

    Raises:
        ValueError: if its checksum is wrong, or a field is cut off.
    """
    # The checksum of all that precedes it ends the record; 0 is none.
    checksum = int.from_bytes(body[-4:], "little")
    if checksum not in (0, zlib.crc32(body[:-4])):
        raise ValueError("the checksum of an attachment is wrong")
    return Attachment.read(_RecordContent(body))


class _RecordContent(ReadDataStream):
    """The content of one record; reads beyond its end are refused.

    Attributes:
        left: how much of the content is still to be read [bytes].
    """

    def __init__(self, content: bytes):
        super().__init__(io.BytesIO(content))
        self.left = len(content)

    def read(self, length: int) -> bytes:
        """Returns the next bytes.

        Raises:
            ValueError: there are not that many bytes left.
        """
        if not 0 <= length <= self.left:
            raise ValueError("a field reaches beyond the end of its record")
        self.left -= length
        return super().read(length)


def _uncompress(chunk: Chunk) -> bytes:
    """Returns the uncompressed records of a chunk.

    Raises:
        ValueError: if the chunk is damaged, or of unknown compression.
    """
    data = unpacked(chunk.data, chunk.compression, chunk.uncompressed_size)
    if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
        raise ValueError("the checksum of a chunk is wrong")
    return data


# Opcode -> function that reads a record's content; first records in chunks.
_IN_CHUNKS: dict[int, Callable[[bytes], McapRecord]] = {
    Opcode.MESSAGE: lambda content: Message.read(
        _RecordContent(content), len(content)
    ),
    Opcode.SCHEMA: lambda content: Schema.read(_RecordContent(content)),
    Opcode.CHANNEL: lambda content: Channel.read(_RecordContent(content)),
}
_READERS = {
    **_IN_CHUNKS,
    Opcode.METADATA: lambda content: Metadata.read(_RecordContent(content)),
    Opcode.ATTACHMENT: _parse_attachment,
}


def _locate_records(
    stream: BinaryIO,
) -> Iterator[tuple[int, int, McapRecord]]:
    """Yields the records of an MCAP file, each with its place in the file.

    These records are schemas, channels, messages, attachments and metadata. The
    records inside chunks are yielded as well.

    Yields:
        Two offsets [bytes], and the record. For a record in a chunk, the first
        offset is the place of the chunk in the file, and the second is the
        place of the record in the uncompressed chunk. For any other record, the
        first offset is the place of the record in the file, and the second is
        0.

    Raises:
        ValueError: a part of the file cannot be read.
    """
    opcode, position, total = 0, len(_MAGIC), 0
    while opcode != Opcode.FOOTER:
        with _place_named(position):
            opcode, content = _read_record(stream, position, "a record")
            chunk = None
            if opcode == Opcode.CHUNK:
                chunk = Chunk.read(_RecordContent(content))
                total += chunk.uncompressed_size
                check_unpacked(total, _size_of(stream))
            for offset, record in _records_in(opcode, content, chunk):
                yield position, offset, record
        position += _RECORD_HEADER.size + len(content)


def _records_in(
    opcode: int, content: bytes, chunk: Chunk | None
) -> Iterator[tuple[int, McapRecord]]:
    """Yields a record itself or, if it is a chunk, the records in the chunk.

    Types of records that no caller needs are left out. Each record comes with
    its offset in the uncompressed chunk [bytes], which is 0 outside of chunks.
    """
    if chunk is not None:
        inner = _RecordContent(_uncompress(chunk))
        while inner.left:
            offset = chunk.uncompressed_size - inner.left
            header = inner.read(_RECORD_HEADER.size)
            opcode, length = _RECORD_HEADER.unpack(header)
            content = inner.read(length)
            if opcode == 0:
                raise ValueError("there is no record")
            if opcode in _IN_CHUNKS:
                yield offset, _IN_CHUNKS[opcode](content)
    elif opcode in _READERS:
        yield 0, _READERS[opcode](content)


def _intact_bytes(stream: BinaryIO) -> int:
    """Returns the place behind the last whole record of a cut file [bytes]."""
    size = stream.seek(0, os.SEEK_END)
    position = end = len(_MAGIC)
    while end <= size:
        position = stream.seek(end)
        header = stream.read(_RECORD_HEADER.size)
        if len(header) < _RECORD_HEADER.size or header[0] == 0:
            break
        end += _RECORD_HEADER.size + _RECORD_HEADER.unpack(header)[1]
    return position


@contextlib.contextmanager
def _place_named(position: int) -> Iterator[None]:
    """Adds a place in the file to the error of a damaged record."""
    try:
        yield
    except _FAULTS as error:
        # Some of these errors have no message.
        fault = str(error) or type(error).__name__
        raise ValueError(f"byte {position}: {fault}") from error
