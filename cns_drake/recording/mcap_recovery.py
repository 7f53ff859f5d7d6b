"""Reading whatever is readable of an MCAP file, whole or not.

The readers of the `mcap` package need an intact file and trust the sizes that
it declares. This one reads from the start without any index, checks every
size against the file and a limit before it makes room for it, checks every
checksum, and finds the next intact chunk behind damage.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import io
import os
import re
import struct
from typing import BinaryIO
import zlib

import lz4.frame
from mcap.data_stream import ReadDataStream
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
from mcap.writer import MCAP0_MAGIC
import zstandard

# The largest record, compressed or not, that is taken for real [bytes].
RECORD_LIMIT = 64 * 1024 * 1024

_RECORD_HEADER = struct.Struct("<BQ")
_LAST_OPCODE = max(Opcode)
# What a chunk begins with: the record's opcode and length, two times, size and
# checksum of the content, compression, length of the compressed content.
# As lookahead, so that a false beginning hides no true one.
_CHUNK_START = re.compile(
    rb"(?=\x06(?P<length>.{8}).{28}"
    rb"(?P<compression>\x04\0{3}zstd|\x03\0{3}lz4|\0{4})"
    rb"(?P<content_length>.{8}))",
    re.DOTALL,
)
_LONGEST_CHUNK_START = 9 + 28 + 8 + 8
_FIRST_SEARCH_BLOCK = 4096
_LAST_SEARCH_BLOCK = 4 * 1024 * 1024
# What is shaped like a chunk but is none, is read in vain. A file made for
# that could keep a reader busy for days, hence a limit: so often its size.
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
    chunks are opened, indexes left out. Where something cannot be read, also
    where the file ends too early, comes a Fault.

    Args:
        stream: the file; it may be moved between two records.
    """
    size = stream.seek(0, os.SEEK_END)
    stream.seek(0)
    position: int | None = len(MCAP0_MAGIC)
    if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
        yield Fault(0, "does not begin as an MCAP file")
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
    """A record that cannot be one."""


def _read_header(stream: BinaryIO, position: int, size: int) -> tuple[int, int]:
    """Returns opcode and end of the record at a position."""
    stream.seek(position)
    header = stream.read(_RECORD_HEADER.size)
    if len(header) < _RECORD_HEADER.size:
        raise _DamageError("the file ends too early")
    opcode, length = _RECORD_HEADER.unpack(header)
    end = position + _RECORD_HEADER.size + length
    if end > size:
        raise _DamageError("a record reaches beyond the end of the file")
    if opcode == 0:
        raise _DamageError("there is no record")
    return opcode, end


def _read_content(stream: BinaryIO, position: int, end: int) -> bytes:
    start = position + _RECORD_HEADER.size
    if end - start > RECORD_LIMIT:
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
    """Returns where the next thing lies that is shaped like a chunk."""
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
    stream = _Content(content)
    if opcode == Opcode.CHUNK:
        yield from _records_in_chunk(Chunk.read(stream))
    elif opcode == Opcode.HEADER:
        yield Header.read(stream)
    elif opcode == Opcode.METADATA:
        yield Metadata.read(stream)
    elif opcode == Opcode.ATTACHMENT:
        (crc,) = struct.unpack("<I", content[-4:])
        if crc and crc != zlib.crc32(content[:-4]):
            raise _DamageError("an attachment's checksum is wrong")
        yield Attachment.read(stream)
    else:
        yield from _parse_content(opcode, content)


def _parse_content(opcode: int, content: bytes) -> Iterator[McapRecord]:
    """Like `_parse`, for the records that a chunk may contain."""
    stream = _Content(content)
    if opcode == Opcode.MESSAGE:
        yield Message.read(stream, len(content))
    elif opcode == Opcode.SCHEMA:
        yield Schema.read(stream)
    elif opcode == Opcode.CHANNEL:
        yield Channel.read(stream)


def _records_in_chunk(chunk: Chunk) -> Iterator[McapRecord]:
    data = _uncompressed(chunk)
    if len(data) != chunk.uncompressed_size:
        raise _DamageError("a chunk's size is wrong")
    if chunk.uncompressed_crc and chunk.uncompressed_crc != zlib.crc32(data):
        raise _DamageError("a chunk's checksum is wrong")
    stream = _Content(data)
    while stream.left:
        opcode, length = _RECORD_HEADER.unpack(stream.read(_RECORD_HEADER.size))
        yield from _parse_content(opcode, stream.read(length))


def _uncompressed(chunk: Chunk) -> bytes:
    """Returns a chunk's content; makes room for no more than it declares."""
    size = chunk.uncompressed_size
    if size > RECORD_LIMIT:
        raise _DamageError(f"a chunk of {size} bytes is too large")
    if chunk.compression == "":
        return chunk.data
    if chunk.compression == "zstd":
        reader = zstandard.ZstdDecompressor(
            max_window_size=RECORD_LIMIT
        ).stream_reader(chunk.data)
        data = reader.read(size)
        rest = reader.read(1)
    elif chunk.compression == "lz4":
        decompressor = lz4.frame.LZ4FrameDecompressor()
        data = decompressor.decompress(chunk.data, max_length=size)
        rest = b"" if decompressor.eof else b"?"
    else:
        raise _DamageError(f"unknown compression '{chunk.compression[:20]}'")
    if rest:
        raise _DamageError("a chunk holds more than it declares")
    return data


class _Content(ReadDataStream):
    """The content of one record, which no read can leave."""

    def __init__(self, content: bytes):
        super().__init__(io.BytesIO(content))
        self.left = len(content)

    def read(self, length: int) -> bytes:
        if not 0 <= length <= self.left:
            raise _DamageError("a field reaches beyond the end of its record")
        self.left -= length
        return super().read(length)


def _describe(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text or type(error).__name__
