"""An MCAP file by the `mcap` package."""

import io

from mcap.writer import CompressionType, Writer
import numpy as np


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
