"""The records of an MCAP file, read from its beginning without an index.

The readers of the `mcap` package need an intact file, and trust the sizes that
the file declares. Here every size is checked against the file and a limit
before memory is reserved, and every checksum is checked. After a damaged part,
reading continues at the next intact chunk.
"""

from collections.abc import Callable, Iterator
import contextlib
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
import zstandard

MAGIC = b"\x89MCAP0\r\n"
# Opcode and length.
RECORD_HEADER = struct.Struct("<BQ")
# The beginning of a chunk's content: the time of its earliest message.
_CHUNK_TIME = struct.Struct("<Q")
# A broken or hostile length must not be taken for the size of a buffer. A
# chunk holds a few scans.
CHUNK_LIMIT_BYTES = 1 << 26
_LAST_OPCODE = max(Opcode)
# Size of a chunk's fields before its compression: the times of its earliest and
# latest message, and size and checksum of the uncompressed content [bytes].
_CHUNK_FIELDS_SIZE = struct.calcsize("<QQQI")
# Size of the length of a record, or of a chunk's compressed content [bytes].
_LENGTH_SIZE = struct.calcsize("<Q")
# Size of the longest name of a compression, with its length before it [bytes].
_LONGEST_COMPRESSION = 4 + len("zstd")
# The beginning of a chunk: the record's opcode and length, fields, compression,
# length of the compressed content. A lookahead, so that a false beginning hides
# no true one.
_CHUNK_START = re.compile(
    rb"(?=\x06(?P<length>.{%d}).{%d}"
    rb"(?P<compression>\x04\0{3}zstd|\x03\0{3}lz4|\0{4})"
    rb"(?P<content_length>.{%d}))"
    % (_LENGTH_SIZE, _CHUNK_FIELDS_SIZE, _LENGTH_SIZE),
    re.DOTALL,
)
# Greatest length of that beginning [bytes].
_LONGEST_CHUNK_START = (
    RECORD_HEADER.size
    + _CHUNK_FIELDS_SIZE
    + _LONGEST_COMPRESSION
    + _LENGTH_SIZE
)
# Blocks in which a file is searched grow from the first to the last size
# [bytes].
_FIRST_SEARCH_BLOCK = 4096
_LAST_SEARCH_BLOCK = 4 * 1024 * 1024
# Limit of the bytes read in search of chunks, in multiples of the file's size:
# a hostile file with many false chunks could keep a reader busy for days.
_MOST_READ = 16
_FAULTS = (
    McapError,
    ValueError,
    RuntimeError,
    struct.error,
    zstandard.ZstdError,
)


def parse_attachment(body: bytes) -> Attachment:
    """Returns the attachment in the content of a record.

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


def uncompress(chunk: Chunk) -> bytes:
    """Returns the uncompressed records of a chunk.

    The uncompressed size is limited, so that a small file cannot fill the
    memory.

    Raises:
        ValueError: if the chunk is damaged, too large or of unknown
            compression.
        RuntimeError: if lz4 finds that the chunk is damaged.
        zstandard.ZstdError: if zstd finds that the chunk is damaged.
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


# Opcode -> function that reads a record's content; first records in chunks.
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
    Opcode.ATTACHMENT: parse_attachment,
}


@dataclass(frozen=True)
class Fault:
    """A part of a file that cannot be read.

    Attributes:
        offset: where the part begins in the file [bytes].
        text: why the part cannot be read.
    """

    offset: int
    text: str

    def __str__(self) -> str:
        return f"byte {self.offset}: {self.text}"


def read_records(stream: BinaryIO) -> Iterator[McapRecord | Fault]:
    """Yields the readable records of an MCAP file, in the file's order.

    These records are the header, schemas, channels, messages, attachments and
    metadata. The records inside chunks are yielded as well; indexes are left
    out. For each part that cannot be read, and for a missing end of the file, a
    Fault is yielded. The caller may seek in the stream between two records.
    """
    return (record for _, _, record in locate_records(stream))


def locate_records(
    stream: BinaryIO,
) -> Iterator[tuple[int, int, McapRecord | Fault]]:
    """Yields the records of an MCAP file, each with its place in the file.

    The records are the same as in `read_records`.

    Yields:
        Two offsets [bytes], and the record. For a record in a chunk, the first
        offset is the place of the chunk in the file, and the second is the
        place of the record in the uncompressed chunk. For any other record, the
        first offset is the place of the record in the file, and the second is
        0.
    """
    size = stream.seek(0, os.SEEK_END)
    stream.seek(0)
    position: int | None = len(MAGIC)
    if stream.read(len(MAGIC)) != MAGIC:
        yield 0, 0, Fault(0, "does not begin like an MCAP file")
        position = _next_chunk(stream, 0, size)
    budget = _MOST_READ * size
    while position is not None:
        end = None
        try:
            opcode, end = _read_header(stream, position, size)
            budget -= end - position
            if budget < 0:
                fault = "too much damage, the rest is not read"
                yield position, 0, Fault(position, fault)
                return
            start = position + RECORD_HEADER.size
            if end - start > CHUNK_LIMIT_BYTES:
                raise _DamageError(
                    f"a record of {end - start} bytes is too large"
                )
            for offset, record in _records_in(opcode, stream.read(end - start)):
                yield position, offset, record
        except _FAULTS as error:
            text = " ".join(str(error).split()) or type(error).__name__
            yield position, 0, Fault(position, text)
            if end is None or not _begins_record(stream, end, size):
                end = _next_chunk(stream, position + 1, size)
        else:
            if opcode == Opcode.FOOTER:
                return
        position = end


def chunk_times(stream: BinaryIO) -> Iterator[tuple[int, int]]:
    """Yields each chunk's place and the time of its earliest message.

    The chunks are not uncompressed. The iterator ends where the file is damaged
    or ends.

    Yields:
        The offset of a chunk in the file [bytes], and the log time [ns].
    """
    size = stream.seek(0, os.SEEK_END)
    position = len(MAGIC)
    with contextlib.suppress(_DamageError, struct.error):
        while True:
            opcode, end = _read_header(stream, position, size)
            if opcode == Opcode.CHUNK:
                yield (
                    position,
                    *_CHUNK_TIME.unpack(stream.read(_CHUNK_TIME.size)),
                )
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
    """Returns the position of the next bytes that look like a chunk.

    The result is None if there is no further chunk.
    """
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
            fields = _CHUNK_FIELDS_SIZE + len(compression) + _LENGTH_SIZE
            if (
                int.from_bytes(length, "little")
                == int.from_bytes(content_length, "little") + fields
                and match.start() < block_size
            ):
                return start + match.start()
        start += block_size
        block_size = min(2 * block_size, _LAST_SEARCH_BLOCK)
    return None


def _records_in(
    opcode: int, content: bytes
) -> Iterator[tuple[int, McapRecord]]:
    """Yields a record itself or, for a chunk, the records in the chunk.

    Types of records that no caller needs are left out. Each record comes with
    its offset in the uncompressed chunk [bytes], which is 0 outside of chunks.
    """
    if opcode == Opcode.CHUNK:
        chunk = Chunk.read(RecordContent(content))
        inner = RecordContent(uncompress(chunk))
        while inner.left:
            offset = chunk.uncompressed_size - inner.left
            header = inner.read(RECORD_HEADER.size)
            opcode, length = RECORD_HEADER.unpack(header)
            content = inner.read(length)
            if opcode in _IN_CHUNKS:
                yield offset, _IN_CHUNKS[opcode](content)
    elif opcode in _READERS:
        yield 0, _READERS[opcode](content)
