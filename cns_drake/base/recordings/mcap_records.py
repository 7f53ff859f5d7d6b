"""Reads records of an MCAP file; damaged or hostile ones are refused.

The `mcap` package checks only the checksums of chunks, and trusts the sizes
that a chunk claims.
"""

from __future__ import annotations

import io
import os
import struct
from typing import BinaryIO
import zlib

import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.records import Attachment, Chunk
import zstandard

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


def check_summary(stream: BinaryIO) -> None:
    """Refuses a file whose summary does not match its checksum.

    Raises:
        ValueError: if so, or if the footer is no footer record.
    """
    size = stream.seek(0, os.SEEK_END)
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


def read_attachment(stream: BinaryIO) -> Attachment:
    """Reads the attachment at the stream's position.

    Raises:
        ValueError: if its checksum is wrong, or the record too large.
    """
    return parse_attachment(
        _read_body(stream, _ATTACHMENT_LIMIT_BYTES, "an attachment")
    )


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


def read_chunk(stream: BinaryIO, size: int) -> bytes:
    """Returns the records of the chunk at the stream's position.

    Args:
        stream: the file.
        size: of the records, as the file's index has it [bytes].

    Raises:
        ValueError: if it is damaged, too large or of unknown compression.
        RuntimeError: if lz4 finds it damaged.
        zstandard.ZstdError: likewise.
    """
    limit = CHUNK_LIMIT_BYTES + _CHUNK_FIELDS_BYTES
    body = _read_body(stream, limit, "a chunk")
    chunk = Chunk.read(RecordContent(body))
    if chunk.uncompressed_size != size:
        raise ValueError(
            f"a chunk of {chunk.uncompressed_size} bytes, of {size} by the"
            " index"
        )
    return uncompress(chunk)


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
