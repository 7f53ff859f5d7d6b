"""Repair of damaged MCAP files: the readable part becomes a whole file."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
import itertools
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.records import (
    Attachment,
    Channel,
    Header,
    McapRecord,
    Message,
    Metadata,
    Schema,
)
from mcap.writer import Writer

from cns_drake.base.complete_files import check_writable, completing
from cns_drake.base.errors import InputError
from cns_drake.base.files import user_errors
from cns_drake.base.progress import doing
from cns_drake.base.version import __version__
from cns_drake.drives.mcap_messages import STAMPED_RECORD
from cns_drake.drives.mcap_records import Fault, read_records
from cns_drake.recording import rosbag2_metadata
from cns_drake.recording.topic_chunks import TopicChunks

# Schemas and channels are kept in memory; more of them is no recording.
_DEFINITIONS_LIMIT = 64 * 1024 * 1024
_ROSBAG2 = "rosbag2"
_MB = 1_000_000


@dataclass(frozen=True)
class Repair:
    """The result of a repair: the new file, and the messages recovered.

    Attributes:
        output: the new file.
        num_messages: number of recovered messages.
        seconds: time between the earliest and the latest recovered message [s].
        num_faults: number of parts of the file that could not be read; 0 if the
            file was undamaged.
        first_fault: description of the first part that could not be read.
    """

    output: Path
    num_messages: int
    seconds: float
    num_faults: int
    first_fault: str


def repair_mcap(
    path: Path,
    output: Path | None = None,
) -> Repair:
    """Writes the readable part of an MCAP file to a complete, indexed file.

    Messages keep their times, numbers and bytes, and on each topic their order;
    attachments and metadata are kept as well. A file of ROS 2 also gets a
    metadata record `rosbag2` with its message counts, so that ROS 2 can open
    the file without a rosbag2 folder.

    Args:
        path: any MCAP file, whole or damaged; it is only read.
        output: the new file; by default `<name>_repaired.mcap` next to `path`.

    Raises:
        InputError: nothing can be read, or the new file already exists or
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
        """Yields the records of the file, and reports progress.

        Args:
            before: number of bytes that were read in an earlier pass.
        """
        with user_errors(path), open(path, "rb") as stream:
            for record in read_records(stream):
                at = before + stream.tell()
                doing("reading", at // _MB, 2 * size // _MB, "MB")
                yield record

    check_writable(output)
    # Definitions may come behind messages that need them.
    definitions = _find_definitions(read(0), path)
    with (
        completing(output) as part,
        user_errors(part),
        open(part, "wb") as stream,
    ):
        repair = _write_repaired(read(size), stream, definitions, output)
    return repair


class _Definitions(NamedTuple):
    """What messages refer to: schemas and channels by id.

    If an id is defined twice, the first definition counts. Channels without a
    known schema are left out.
    """

    profile: str
    schemas: dict[int, Schema]
    channels: dict[int, Channel]


def _find_definitions(
    records: Iterable[McapRecord | Fault], path: Path
) -> _Definitions:
    """Returns the schemas and channels that records define.

    Raises:
        InputError: the records define nothing, or too much.
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
        elif isinstance(record, Attachment):  # The index has its name.
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


def _write_repaired(
    records: Iterable[McapRecord | Fault],
    stream: BinaryIO,
    definitions: _Definitions,
    output: Path,
) -> Repair:
    """Writes records as a whole MCAP file, which will be `output`."""
    chunks = TopicChunks(stream)
    writer = chunks.writer
    writer.start(
        profile=definitions.profile,
        library=f"cns-drake {__version__} repair",
    )
    channel_ids = _register(definitions, writer)
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
        elif isinstance(record, Metadata):
            if record.name not in (_ROSBAG2, STAMPED_RECORD):
                writer.add_metadata(record.name, record.metadata)
        elif isinstance(record, Message):
            if record.channel_id in channel_ids:
                if not counts:
                    start_ns = end_ns = record.log_time
                start_ns = min(start_ns, record.log_time)
                end_ns = max(end_ns, record.log_time)
                counts[record.channel_id] += 1
                chunks.add_message(
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
    if definitions.profile == "ros2":
        information = rosbag2_metadata.make_bag_information(
            output.name,
            _described_topics(definitions, counts),
            start_ns=start_ns,
            end_ns=end_ns,
        )
        writer.add_metadata(
            _ROSBAG2,
            {"serialized_metadata": rosbag2_metadata.to_yaml(information)},
        )
    chunks.finish(
        {
            channel_ids[number]: channel.topic
            for number, channel in definitions.channels.items()
        }
    )
    seconds = (end_ns - start_ns) / 1e9
    total = sum(counts.values())
    return Repair(output, total, seconds, num_faults, first_fault)


def _register(definitions: _Definitions, writer: Writer) -> dict[int, int]:
    """Registers schemas and channels; returns the new id of each channel."""
    schema_ids = {0: 0} | {
        number: writer.register_schema(
            schema.name, schema.encoding, schema.data
        )
        for number, schema in definitions.schemas.items()
    }
    return {
        number: writer.register_channel(
            channel.topic,
            channel.message_encoding,
            schema_ids[channel.schema_id],
            channel.metadata,
        )
        for number, channel in definitions.channels.items()
    }


def _described_topics(
    definitions: _Definitions, counts: Counter[int]
) -> list[dict]:
    """Returns the descriptions of all topics for rosbag2.

    Args:
        definitions: schemas and channels.
        counts: id of a channel -> number of its messages.
    """
    schemas = definitions.schemas
    return [
        rosbag2_metadata.describe_topic(
            channel.topic,
            schemas[channel.schema_id].name
            if channel.schema_id in schemas
            else "",
            counts[number],
            channel.metadata,
            channel.message_encoding,
        )
        for number, channel in definitions.channels.items()
    ]
