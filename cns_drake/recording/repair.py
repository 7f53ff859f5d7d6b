"""Repair: writes the readable part of a damaged MCAP file as a whole file.

The readers of the `mcap` package need an intact file and trust the sizes that
it declares. The reader of this module starts at the beginning without any
index. It checks every size against the file and a limit before it reserves
memory, checks every checksum, and finds the next intact chunk behind damage."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
import itertools
import os
from pathlib import Path
import re
import struct
from typing import BinaryIO, NamedTuple

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    Header,
    McapRecord,
    Message,
    Metadata,
    Schema,
)
from mcap.writer import CompressionType, Writer
import zstandard

from cns_drake.base.drives import mcap_file
from cns_drake.base.drives.mcap_file import MAGIC, RECORD_HEADER, RecordContent
from cns_drake.base.errors import InputError
from cns_drake.base.files import check_writable, completing, user_errors
from cns_drake.base.version import __version__
from cns_drake.recording import rosbag2_metadata

_LAST_OPCODE = max(Opcode)
# The beginning of a chunk: the record's opcode and length, two times, size and
# checksum of the content, compression, length of the compressed content. A
# lookahead, so that a false beginning hides no true one.
_CHUNK_START = re.compile(
    rb"(?=\x06(?P<length>.{8}).{28}"
    rb"(?P<compression>\x04\0{3}zstd|\x03\0{3}lz4|\0{4})"
    rb"(?P<content_length>.{8}))",
    re.DOTALL,
)
_LONGEST_CHUNK_START = 9 + 28 + 8 + 8
_FIRST_SEARCH_BLOCK = 4096
_LAST_SEARCH_BLOCK = 4 * 1024 * 1024
# Bytes that look like a chunk are read in vain. A hostile file could keep a
# reader busy for days, hence a limit, in sizes of the file.
_MOST_READ = 16
_FAULTS = (
    McapError,
    ValueError,
    RuntimeError,
    struct.error,
    zstandard.ZstdError,
)
# Opcode -> what reads the content of a record; those of chunks first.
_IN_CHUNKS: dict[int, Callable[[bytes], McapRecord]] = {
    Opcode.MESSAGE: lambda content: Message.read(
        RecordContent(content), len(content)
    ),
    Opcode.SCHEMA: lambda content: Schema.read(RecordContent(content)),
    Opcode.CHANNEL: lambda content: Channel.read(RecordContent(content)),
}
_READERS = {
    **_IN_CHUNKS,
    Opcode.HEADER: lambda content: Header.read(RecordContent(content)),
    Opcode.METADATA: lambda content: Metadata.read(RecordContent(content)),
    Opcode.ATTACHMENT: mcap_file.parse_attachment,
}
# Schemas and channels are kept in memory; more of them is no recording.
_DEFINITIONS_LIMIT = 64 * 1024 * 1024
_ROSBAG2 = "rosbag2"
# Reports how many bytes of how many are done.
BytesCallback = Callable[[int, int], None]


@dataclass(frozen=True)
class Fault:
    """What is wrong where a file cannot be read, from an offset on [bytes]."""

    offset: int
    text: str

    def __str__(self) -> str:
        return f"byte {self.offset}: {self.text}"


def read_records(stream: BinaryIO) -> Iterator[McapRecord | Fault]:
    """Yields the readable records of an MCAP file, in the file's order.

    Those are header, schemas, channels, messages, attachments and metadata;
    chunks are opened, indexes left out. A Fault stands for each part that
    cannot be read, also for a missing end. The stream may be moved between two
    records.
    """
    size = stream.seek(0, os.SEEK_END)
    stream.seek(0)
    position: int | None = len(MAGIC)
    if stream.read(len(MAGIC)) != MAGIC:
        yield Fault(0, "does not begin like an MCAP file")
        position = _next_chunk(stream, 0, size)
    budget = _MOST_READ * size
    while position is not None:
        end = None
        try:
            opcode, end = _read_header(stream, position, size)
            budget -= end - position
            if budget < 0:
                yield Fault(position, "too much damage, the rest is not read")
                return
            start = position + RECORD_HEADER.size
            if end - start > mcap_file.CHUNK_LIMIT_BYTES:
                raise _DamageError(
                    f"a record of {end - start} bytes is too large"
                )
            yield from _parse(opcode, stream.read(end - start))
        except _FAULTS as error:
            text = " ".join(str(error).split())
            yield Fault(position, text or type(error).__name__)
            if end is None or not _begins_record(stream, end, size):
                end = _next_chunk(stream, position + 1, size)
        else:
            if opcode == Opcode.FOOTER:
                return
        position = end


class _DamageError(McapError):
    """Bytes that cannot be a record."""


def _read_header(stream: BinaryIO, position: int, size: int) -> tuple[int, int]:
    """Returns opcode and end of the record at a position."""
    stream.seek(position)
    header = stream.read(RECORD_HEADER.size)
    if len(header) < RECORD_HEADER.size:
        raise _DamageError("the file ends too early")
    opcode, length = RECORD_HEADER.unpack(header)
    end = position + RECORD_HEADER.size + length
    if end > size:
        raise _DamageError("a record reaches beyond the end of the file")
    if opcode == 0:
        raise _DamageError("there is no record")
    return opcode, end


def _begins_record(stream: BinaryIO, position: int, size: int) -> bool:
    try:
        opcode, _ = _read_header(stream, position, size)
    except _DamageError:
        return False
    return opcode <= _LAST_OPCODE


def _next_chunk(stream: BinaryIO, start: int, size: int) -> int | None:
    """Returns the position of the next bytes that look like a chunk."""
    block_size = _FIRST_SEARCH_BLOCK
    while start < size:
        stream.seek(start)
        # The overlap lets no chunk hide on the border of two blocks.
        block = stream.read(block_size + _LONGEST_CHUNK_START)
        for match in _CHUNK_START.finditer(block):
            length, compression, content_length = map(
                match.group, ("length", "compression", "content_length")
            )
            # The record ends with the chunk's content.
            fields = 28 + len(compression) + 8
            if (
                int.from_bytes(length, "little")
                == int.from_bytes(content_length, "little") + fields
                and match.start() < block_size
            ):
                return start + match.start()
        start += block_size
        block_size = min(2 * block_size, _LAST_SEARCH_BLOCK)
    return None


def _parse(opcode: int, content: bytes) -> Iterator[McapRecord]:
    """Yields the records of interest that a record is or contains."""
    if opcode == Opcode.CHUNK:
        chunk = Chunk.read(RecordContent(content))
        inner = RecordContent(mcap_file.uncompress(chunk))
        while inner.left:
            header = inner.read(RECORD_HEADER.size)
            opcode, length = RECORD_HEADER.unpack(header)
            content = inner.read(length)
            if opcode in _IN_CHUNKS:
                yield _IN_CHUNKS[opcode](content)
    elif opcode in _READERS:
        yield _READERS[opcode](content)


@dataclass(frozen=True)
class Repair:
    """The result of a repair: the new file, and the messages recovered.

    From the earliest to the latest of them it is `seconds`. Faults are places
    that could not be read, 0 if the file was whole; the first is in words.
    """

    output: Path
    num_messages: int
    seconds: float
    num_faults: int
    first_fault: str


def repair_mcap(
    path: Path,
    output: Path | None = None,
    on_bytes: BytesCallback = lambda done, total: None,
) -> Repair:
    """Writes the readable part of an MCAP file as a whole, indexed file.

    Messages keep their order, times, numbers and bytes; attachments and
    metadata are kept as well. A file of ROS 2 gets a `rosbag2` record with its
    counts, so that it opens without a folder around it.

    Args:
        path: any MCAP file, whole or damaged; it is only read.
        output: the new file; by default `<name>_repaired.mcap` beside it.

    Raises:
        InputError: nothing can be read, or the new file exists already, or
            cannot be written.
    """
    if output is None:
        stem = path.name.removesuffix(".part").removesuffix(".mcap")
        output = path.with_name(f"{stem}_repaired.mcap")
    with user_errors(path):
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        size = path.stat().st_size
    with user_errors(output):
        if output.exists():
            raise InputError(
                f"{output}: the file already exists; remove it or give "
                "another one"
            )

    def read(before: int) -> Iterator[McapRecord | Fault]:
        """Reads the file, after so many bytes of the work [bytes]."""
        with user_errors(path), open(path, "rb") as stream:
            for record in read_records(stream):
                on_bytes(before + stream.tell(), 2 * size)
                yield record

    check_writable(output)
    # Definitions may come behind messages that need them.
    definitions = _find_definitions(read(0), path)
    with (
        completing(output) as part,
        user_errors(part),
        open(part, "wb") as stream,
    ):
        repair = _copy(read(size), stream, definitions, output)
    on_bytes(2 * size, 2 * size)
    return repair


class _Definitions(NamedTuple):
    """What messages refer to: schemas and channels by id.

    The first one of an id counts, and only channels with a known schema do.
    """

    profile: str
    schemas: dict[int, Schema]
    channels: dict[int, Channel]


def _find_definitions(
    records: Iterable[McapRecord | Fault], path: Path
) -> _Definitions:
    """Returns what records define.

    Raises:
        InputError: they define nothing, or too much.
    """
    header: Header | None = None
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    kept_bytes = 0
    for record in records:
        if isinstance(record, Header) and header is None:
            header = record
            kept: tuple = (record.profile,)
        elif isinstance(record, Schema) and record.id not in schemas:
            schemas[record.id] = record
            kept = (record.name, record.encoding, record.data)
        elif isinstance(record, Channel) and record.id not in channels:
            channels[record.id] = record
            kept = (record.topic, *itertools.chain(*record.metadata.items()))
        elif isinstance(record, Attachment):  # Names go into an index.
            kept = (record.name, record.media_type)
        elif isinstance(record, Metadata):
            kept = (record.name,)
        else:
            continue
        kept_bytes += 100 + sum(map(len, kept))
        if kept_bytes > _DEFINITIONS_LIMIT:
            raise InputError(
                f"{path}: more topics, types and attachments than any "
                "recording has"
            )
    channels = {
        number: channel
        for number, channel in channels.items()
        if channel.schema_id == 0 or channel.schema_id in schemas
    }
    if header is None and not channels:
        raise InputError(f"{path}: nothing of an MCAP file can be read")
    return _Definitions(header.profile if header else "", schemas, channels)


def _copy(
    records: Iterable[McapRecord | Fault],
    stream: BinaryIO,
    definitions: _Definitions,
    output: Path,
) -> Repair:
    """Writes records as a whole MCAP file, which will be `output`."""
    profile, schemas, channels = definitions
    writer = Writer(stream, compression=CompressionType.ZSTD)
    writer.start(profile=profile, library=f"cns-drake {__version__} repair")
    schema_ids = {0: 0} | {
        number: writer.register_schema(
            schema.name, schema.encoding, schema.data
        )
        for number, schema in schemas.items()
    }
    channel_ids = {
        number: writer.register_channel(
            channel.topic,
            channel.message_encoding,
            schema_ids[channel.schema_id],
            channel.metadata,
        )
        for number, channel in channels.items()
    }
    counts: Counter[int] = Counter()
    start_ns = end_ns = num_faults = 0
    first_fault = ""
    for record in records:
        fault = str(record) if isinstance(record, Fault) else ""
        if isinstance(record, Attachment):
            writer.add_attachment(
                record.create_time,
                record.log_time,
                record.name,
                record.media_type,
                record.data,
            )
        elif isinstance(record, Metadata) and record.name != _ROSBAG2:
            writer.add_metadata(record.name, record.metadata)
        elif isinstance(record, Message):
            if record.channel_id in channel_ids:
                if not counts:
                    start_ns = end_ns = record.log_time
                start_ns = min(start_ns, record.log_time)
                end_ns = max(end_ns, record.log_time)
                counts[record.channel_id] += 1
                writer.add_message(
                    channel_ids[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
            else:
                fault = "messages of an unknown topic"
        if fault:
            num_faults += 1
            first_fault = first_fault or fault
    if profile == "ros2":
        topics = [
            rosbag2_metadata.describe_topic(
                channel.topic,
                schemas[channel.schema_id].name
                if channel.schema_id in schemas
                else "",
                counts[number],
                channel.metadata,
                channel.message_encoding,
            )
            for number, channel in channels.items()
        ]
        information = rosbag2_metadata.make_bag_information(
            output.name, topics, start_ns=start_ns, end_ns=end_ns
        )
        writer.add_metadata(
            _ROSBAG2,
            {"serialized_metadata": rosbag2_metadata.to_yaml(information)},
        )
    writer.finish()
    seconds = (end_ns - start_ns) / 1e9
    total = sum(counts.values())
    return Repair(output, total, seconds, num_faults, first_fault)
