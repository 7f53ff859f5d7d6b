"""Reads the readable records of an MCAP file, whole or damaged.

The readers of the `mcap` package need an intact file and trust the sizes that
it declares. This reader starts at the beginning without any index. It checks
every size against the file and a limit before it reserves memory, checks every
checksum, and finds the next intact chunk behind damage.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import os
import re
import struct
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    Header,
    McapRecord,
    Message,
    Metadata,
    Schema,
)
import zstandard

from cns_drake.base.recordings.mcap_records import (
    CHUNK_LIMIT_BYTES,
    MAGIC,
    RECORD_HEADER,
    RecordContent,
    parse_attachment,
    uncompress,
)

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


@dataclass(frozen=True)
class Fault:
    """A place where a file cannot be read.

    Attributes:
        offset: of the damaged record [bytes].
        text: what is wrong.
    """

    offset: int
    text: str

    def __str__(self) -> str:
        return f"byte {self.offset}: {self.text}"


def read_records(stream: BinaryIO) -> Iterator[McapRecord | Fault]:
    """Yields the readable records of an MCAP file, in the file's order.

    Those are header, schemas, channels, messages, attachments and metadata;
    chunks are opened, indexes left out. A Fault stands for each part that
    cannot be read, also for a missing end.

    Args:
        stream: the file; it may be moved between two records.
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
            yield from _parse(opcode, _read_content(stream, position, end))
        except _FAULTS as error:
            yield Fault(position, _describe(error))
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


def _read_content(stream: BinaryIO, position: int, end: int) -> bytes:
    start = position + RECORD_HEADER.size
    if end - start > CHUNK_LIMIT_BYTES:
        raise _DamageError(f"a record of {end - start} bytes is too large")
    stream.seek(start)
    return stream.read(end - start)


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
    stream = RecordContent(content)
    if opcode == Opcode.CHUNK:
        yield from _records_in_chunk(Chunk.read(stream))
    elif opcode == Opcode.HEADER:
        yield Header.read(stream)
    elif opcode == Opcode.METADATA:
        yield Metadata.read(stream)
    elif opcode == Opcode.ATTACHMENT:
        yield parse_attachment(content)
    else:
        yield from _parse_content(opcode, content)


def _parse_content(opcode: int, content: bytes) -> Iterator[McapRecord]:
    """Like `_parse`, for the records that a chunk may contain."""
    stream = RecordContent(content)
    if opcode == Opcode.MESSAGE:
        yield Message.read(stream, len(content))
    elif opcode == Opcode.SCHEMA:
        yield Schema.read(stream)
    elif opcode == Opcode.CHANNEL:
        yield Channel.read(stream)


def _records_in_chunk(chunk: Chunk) -> Iterator[McapRecord]:
    stream = RecordContent(uncompress(chunk))
    while stream.left:
        opcode, length = RECORD_HEADER.unpack(stream.read(RECORD_HEADER.size))
        yield from _parse_content(opcode, stream.read(length))


def _describe(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text or type(error).__name__
