"""What an MCAP file contains, from its summary or from the whole file."""

from __future__ import annotations

from dataclasses import dataclass, field
import os
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from cns_drake.base.errors import InputError
from cns_drake.drives.mcap_records import (
    MAGIC,
    RECORD_HEADER,
    Fault,
    RecordContent,
    locate_records,
)

# An index has a few megabytes; as Python objects it takes a hundred times as
# much memory.
SUMMARY_LIMIT_BYTES = 1 << 25
# The last record: its header, where the summary begins, its offsets, its
# checksum.
_FOOTER = struct.Struct("<BQQQI")
# A chunk's index, after its record header: where the chunk begins, and the size
# of the table of message indexes that follows.
_CHUNK_INDEX = struct.Struct("<16xQ8xI")
# An entry of this table: a channel id, and an offset.
_CHUNK_INDEX_ENTRY = struct.Struct("<HQ")
# How to read a damaged file, for error messages.
REPAIR_ADVICE = "(cns-drake export --format mcap saves what is whole)"


@dataclass
class Contents:
    """The contents of a file, by type of record.

    Attributes:
        schemas: id -> schema.
        channels: id -> channel.
        blocks: offset in the file of each chunk, or of each message outside of
            chunks, in the file's order [bytes].
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
    indexes: list[dict[int, int]] = field(default_factory=list)
    attachments: list[tuple[str, int]] = field(default_factory=list)
    metadata: list[tuple[str, int]] = field(default_factory=list)
    found: dict[int, list[tuple[int, int, int]]] | None = None
    statistics: Statistics | None = None

    @classmethod
    def of(cls, summary: bytes) -> Contents:
        """Returns the contents of a file, as its summary section lists them.

        With the `mcap` package, reading this section would take longer than
        reading all poses.
        """
        contents = cls()
        chunks: list[tuple[int, dict[int, int]]] = []
        position = 0
        while position < len(summary):
            start = position + RECORD_HEADER.size
            opcode, length = RECORD_HEADER.unpack(summary[position:start])
            position = start + length
            if position > len(summary):
                raise ValueError("a record reaches beyond the summary")
            body = summary[start:position]
            if opcode == Opcode.CHUNK_INDEX:
                chunks.append(_chunk_offsets(body))
            elif opcode == Opcode.SCHEMA:
                schema = Schema.read(RecordContent(body))
                contents.schemas[schema.id] = schema
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(RecordContent(body))
                contents.channels[channel.id] = channel
            elif opcode == Opcode.STATISTICS:
                contents.statistics = Statistics.read(RecordContent(body))
            elif opcode == Opcode.ATTACHMENT_INDEX:
                attachment = AttachmentIndex.read(RecordContent(body))
                contents.attachments.append(
                    (attachment.name, attachment.offset)
                )
            elif opcode == Opcode.METADATA_INDEX:
                other = MetadataIndex.read(RecordContent(body))
                contents.metadata.append((other.name, other.offset))
        chunks.sort(key=lambda chunk: chunk[0])
        contents.blocks = [start for start, _ in chunks]
        contents.indexes = [offsets for _, offsets in chunks]
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

    def read_through(self, stream: BinaryIO) -> Contents:
        """Returns the contents of the whole file, found without an index.

        Schemas, channels and statistics of the summary are taken over.

        Args:
            stream: the file.

        Raises:
            ValueError: the file is damaged, or has fewer messages than its
                statistics state.
        """
        told = self.statistics
        contents = Contents(
            dict(self.schemas), dict(self.channels), statistics=told
        )
        found: dict[int, list[tuple[int, int, int]]] = {}
        contents.found = found
        there = 0
        size = stream.seek(0, os.SEEK_END)
        for start, offset, record in locate_records(stream):
            if isinstance(record, Fault):
                raise ValueError(record)
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
                # A few compressed bytes can hold any number of messages.
                if there > size:
                    raise ValueError("more messages than bytes")
        unknown = found.keys() - contents.channels.keys()
        if unknown:
            raise ValueError(f"channel {min(unknown)} is defined nowhere")
        if told is not None and there != told.message_count:
            raise ValueError(
                f"{there} of {told.message_count} messages are there"
            )
        return contents


def _chunk_offsets(body: bytes) -> tuple[int, dict[int, int]]:
    """Returns the offsets of a chunk, and of its message index by channel."""
    start, size = _CHUNK_INDEX.unpack_from(body)
    table = body[_CHUNK_INDEX.size : _CHUNK_INDEX.size + size]
    if len(table) != size:
        raise ValueError("the index of a chunk is cut off")
    return start, dict(_CHUNK_INDEX_ENTRY.iter_unpack(table))


def read_summary(stream: BinaryIO, path: Path) -> bytes:
    """Returns the summary section; refuses a file that is not whole.

    Args:
        stream: the file.
        path: path of the file, for error messages.

    Returns:
        The records of the section; empty for a file without this section.

    Raises:
        InputError: the file is not MCAP, or is cut off.
        ValueError: the summary is damaged.
    """
    if stream.read(len(MAGIC)) != MAGIC:
        raise InputError(f"{path}: not an MCAP file")
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(size - len(MAGIC), len(MAGIC)))
    if stream.read() != MAGIC:
        raise InputError(
            f"{path}: the MCAP file is cut off or was not finished"
            f" {REPAIR_ADVICE}"
        )
    end = stream.seek(max(size - len(MAGIC) - _FOOTER.size, 0))
    footer = stream.read(_FOOTER.size)
    opcode, _, start, _, checksum = _FOOTER.unpack(footer)
    if opcode != Opcode.FOOTER:
        raise ValueError("the footer is missing")
    if start == 0:
        return b""
    if start > end:
        raise ValueError("the summary begins behind its end")
    if end - start > SUMMARY_LIMIT_BYTES:
        raise ValueError(f"a summary of {end - start} bytes")
    stream.seek(start)
    summary = stream.read(end - start)
    # The checksum is also that of the footer up to the checksum itself.
    if checksum > 0 and zlib.crc32(summary + footer[:-4]) != checksum:
        raise ValueError("the checksum of the summary is wrong")
    return summary
