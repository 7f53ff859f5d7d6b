"""MCAP files by the `mcap` package."""

from collections.abc import Callable
import io
from pathlib import Path
import struct

from mcap.data_stream import RecordBuilder
from mcap.reader import SeekingReader
from mcap.records import Footer
from mcap.summary import Summary
from mcap.writer import CompressionType, Writer
import numpy as np

# Where the summary begins, its offsets and its checksum; then the magic bytes.
_END = struct.Struct("<QQI8s")


def write_mcap(
    compression=CompressionType.ZSTD, *, messages=200, profile="", **options
):
    """An MCAP file of two topics with an attachment before and behind."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=2000, compression=compression, **options)
    writer.start(profile=profile, library="test")
    writer.add_attachment(1, 2, "first.txt", "text/plain", b"first")
    schema = writer.register_schema("pkg/msg/Type", "ros2msg", b"int8 x")
    channels = [
        writer.register_channel(topic, "cdr", schema, {"a": topic})
        for topic in ("/a", "/b")
    ]
    rng = np.random.default_rng(0)
    for k in range(messages):
        time = 1_000_000_000 + k * 10_000_000
        writer.add_message(
            channels[k % 2], time, rng.bytes(100), time + 5, sequence=k
        )
    writer.add_metadata("note", {"key": "value"})
    writer.add_metadata("rosbag2", {"serialized_metadata": "old: true"})
    writer.add_attachment(3, 4, "last.txt", "text/plain", b"last")
    writer.finish()
    return stream.getvalue()


def edit_summary(path: Path, change: Callable[[Summary], None]) -> None:
    """Changes the summary section of a file; it has no checksum then."""
    data = path.read_bytes()
    start, _, _, magic = _END.unpack(data[-_END.size :])
    summary = SeekingReader(io.BytesIO(data)).get_summary()
    change(summary)
    builder = RecordBuilder()
    for record in (
        *summary.schemas.values(),
        *summary.channels.values(),
        *filter(None, [summary.statistics]),
        *summary.chunk_indexes,
        *summary.attachment_indexes,
        *summary.metadata_indexes,
        Footer(start, 0, 0),
    ):
        record.write(builder)
    path.write_bytes(data[:start] + builder.end() + magic)
