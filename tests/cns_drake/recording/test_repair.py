"""Repaired recordings, and files made to harm a reader."""

import io
import resource
import struct

from helpers.mcap_bytes import write_mcap
import lz4.frame
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC, CompressionType
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
import yaml
import zstandard

from cns_drake.base.errors import InputError
from cns_drake.drives.mcap_file import CHUNK_LIMIT_BYTES
from cns_drake.drives.mcap_records import Fault, read_records
from cns_drake.recording.repair import repair_mcap

COMPRESSIONS = (CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD)


def messages_of(path):
    """The messages by the `mcap` package's reader, which needs the index."""
    with path.open("rb") as stream:
        return [
            (
                channel.topic,
                schema.name,
                channel.metadata,
                message.log_time,
                message.publish_time,
                message.sequence,
                message.data,
            )
            for schema, channel, message in make_reader(
                stream, validate_crcs=True
            ).iter_messages()
        ]


def repaired(tmp_path, content):
    source = tmp_path / "source.mcap"
    source.write_bytes(content)
    output = tmp_path / "output.mcap"
    output.unlink(missing_ok=True)
    result = repair_mcap(source, output)
    assert source.read_bytes() == content
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "output.mcap",
        "source.mcap",
    ]
    return result, messages_of(output)


def all_messages(tmp_path, content):
    path = tmp_path / "whole.mcap"
    path.write_bytes(content)
    messages = messages_of(path)
    path.unlink()
    return messages


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("use_chunking", [False, True])
def test_a_whole_file_stays_whole(tmp_path, compression, use_chunking):
    content = write_mcap(compression, use_chunking=use_chunking)
    result, messages = repaired(tmp_path, content)
    assert messages == all_messages(tmp_path, content)
    assert result.num_messages == 200
    assert result.seconds == pytest.approx(1.99)
    assert result.num_faults == 0
    with result.output.open("rb") as stream:
        reader = make_reader(stream)
        attachments = {a.name: a.data for a in reader.iter_attachments()}
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    assert attachments == {"first.txt": b"first", "last.txt": b"last"}
    # The metadata of rosbag2 for the old file is invalid for the new one.
    assert metadata == {"note": {"key": "value"}}


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("use_chunking", [False, True])
def test_a_file_cut_off_anywhere(tmp_path, compression, use_chunking):
    content = write_mcap(compression, use_chunking=use_chunking)
    whole = all_messages(tmp_path, content)
    counts = []
    for size in range(300, len(content) - 1, 1511):
        result, messages = repaired(tmp_path, content[:size])
        assert messages == whole[: len(messages)]
        assert result.num_messages == len(messages)
        assert result.num_faults == 1
        counts.append(len(messages))
    assert counts == sorted(counts)
    assert counts[-1] > 150


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_damage_costs_the_chunks_that_it_hits(tmp_path, compression):
    content = write_mcap(compression)
    whole = all_messages(tmp_path, content)
    rng = np.random.default_rng(1)
    for place in rng.integers(300, 17_000, 30):
        damaged = bytearray(content)
        damaged[place : place + 40] = rng.bytes(40)
        result, messages = repaired(tmp_path, damaged)
        assert result.num_faults > 0 or messages == whole
        # Two chunks, each of up to 2,000 bytes and a message more.
        assert len(messages) >= 200 - 2 * 17
        assert all(message in whole for message in messages)


def test_definitions_come_from_the_end_if_the_first_chunk_is_lost(tmp_path):
    content = bytearray(write_mcap())
    first_chunk = content.index(b"\x06", 100)
    content[first_chunk + 60] ^= 1
    result, messages = repaired(tmp_path, content)
    assert result.num_faults == 1
    assert 180 < len(messages) < 200
    assert result.first_fault.endswith("the checksum of a chunk is wrong")


def test_bytes_inserted_and_removed_between_chunks(tmp_path):
    content = write_mcap(CompressionType.LZ4)
    for change in (
        content[:9000] + b"junk" * 5000 + content[9000:],
        content[:9000] + content[9100:],
    ):
        result, messages = repaired(tmp_path, change)
        assert result.num_faults >= 1
        assert len(messages) >= 200 - 2 * 17


def test_a_ros2_file_gets_metadata_of_its_content(short_recording, tmp_path):
    content = (short_recording / "metropolis_04_0.mcap").read_bytes()
    result, _ = repaired(tmp_path, content[: len(content) // 2])
    with result.output.open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        names = {a.name for a in reader.iter_attachments()}
    information = yaml.safe_load(metadata["rosbag2"]["serialized_metadata"])
    assert information["version"] == 8
    assert information["message_count"] == result.num_messages
    assert information["relative_file_paths"] == ["output.mcap"]
    assert information["duration"]["nanoseconds"] == result.seconds * 1e9
    topics = {
        entry["topic_metadata"]["name"]: entry
        for entry in information["topics_with_message_count"]
    }
    assert topics["/tf_static"]["message_count"] == 1
    profile = yaml.safe_load(
        topics["/tf_static"]["topic_metadata"]["offered_qos_profiles"]
    )
    assert profile[0]["durability"] == 1
    assert {"scenario.json", "structures.json", "provenance.json"} <= names
    with AnyReader([result.output]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
        assert reader.message_count == result.num_messages


def test_the_new_file_lies_beside_the_old_one(tmp_path):
    for name in ("drive_0.mcap", "drive_0.mcap.part", "drive_0"):
        (tmp_path / name).write_bytes(write_mcap(messages=3))
        result = repair_mcap(tmp_path / name)
        assert result.output == tmp_path / "drive_0_repaired.mcap"
        with pytest.raises(InputError, match=r"_repaired\.mcap: .* exists"):
            repair_mcap(tmp_path / name)
        result.output.unlink()


@pytest.mark.parametrize(
    "content", [b"", b"MCAP", MCAP0_MAGIC, b"\x06" * 100_000, bytes(100_000)]
)
def test_files_without_anything_readable(tmp_path, content):
    path = tmp_path / "file.mcap"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"file\.mcap: nothing of an MCAP"):
        repair_mcap(path)
    assert [path.name for path in tmp_path.iterdir()] == ["file.mcap"]


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match=r"none\.mcap: no such file"):
        repair_mcap(tmp_path / "none.mcap")
    with pytest.raises(InputError, match="no such file"):
        repair_mcap(tmp_path)


def test_a_full_disk_leaves_nothing(tmp_path):
    source = tmp_path / "source.mcap"
    source.write_bytes(write_mcap())
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(InputError, match=r"\.part: File too large"):
            repair_mcap(source, tmp_path / "output.mcap")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path.name for path in tmp_path.iterdir()] == ["source.mcap"]


# Files made to harm.


def record_of(opcode, content, length=None):
    length = len(content) if length is None else length
    return struct.pack("<BQ", opcode, length) + content


def chunk_of(data, *, size, compression=b"zstd", length=None):
    length = len(data) if length is None else length
    return (
        struct.pack("<QQQII", 0, 0, size, 0, len(compression))
        + compression
        + struct.pack("<Q", length)
        + data
    )


def make_bomb(size):
    """Few bytes that decompress to many."""
    compressor = zstandard.ZstdCompressor().compressobj(size=size)
    zeros = bytes(2**20)
    parts = [compressor.compress(zeros) for _ in range(size // len(zeros))]
    return b"".join([*parts, compressor.flush()])


HUGE = 2**63 + 1
BOMB = make_bomb(2 * CHUNK_LIMIT_BYTES)
LZ4_BOMB = lz4.frame.compress(bytes(64 * 2**20), store_size=False)
MESSAGE = struct.pack("<HIQQ", 1, 0, 0, 0)
HARMFUL = {
    "huge record": record_of(Opcode.METADATA, b"abc", HUGE),
    "huge attachment": record_of(
        Opcode.ATTACHMENT, struct.pack("<QQIIQI", 0, 0, 0, 0, HUGE, 0)
    ),
    "huge name": record_of(Opcode.HEADER, struct.pack("<I", 2**32 - 1)),
    "huge map": record_of(Opcode.METADATA, struct.pack("<II", 0, 2**32 - 1)),
    "huge chunk": record_of(Opcode.CHUNK, chunk_of(b"", size=HUGE)),
    "huge chunk content": record_of(
        Opcode.CHUNK, chunk_of(b"", size=0, length=HUGE)
    ),
    "bomb": record_of(Opcode.CHUNK, chunk_of(BOMB, size=2 * CHUNK_LIMIT_BYTES)),
    "bomb of a wrong size": record_of(Opcode.CHUNK, chunk_of(BOMB, size=1000)),
    "lz4 bomb of a wrong size": record_of(
        Opcode.CHUNK, chunk_of(LZ4_BOMB, size=1000, compression=b"lz4")
    ),
    "huge window": record_of(
        Opcode.CHUNK,
        chunk_of(b"\x28\xb5\x2f\xfd\x00\xff\x00\x00\x00\x00", size=1000),
    ),
    "unknown compression": record_of(
        Opcode.CHUNK, chunk_of(b"abc", size=3, compression=b"rar")
    ),
    "short message": record_of(Opcode.MESSAGE, b"abc"),
    "unknown topic": record_of(Opcode.MESSAGE, b"\xff\xff" + MESSAGE[2:]),
    "record of nothing": bytes(100),
    "not text": record_of(Opcode.HEADER, struct.pack("<I", 2) + b"\xff\xff"),
    "chunk in a chunk": record_of(
        Opcode.CHUNK,
        chunk_of(
            record_of(Opcode.CHUNK, chunk_of(BOMB, size=2**20)),
            size=len(BOMB) + 60,
            compression=b"",
        ),
    ),
}


@pytest.mark.parametrize("name", HARMFUL)
def test_harmful_records_cost_no_more_than_themselves(tmp_path, name):
    content = write_mcap()
    header_end = len(MCAP0_MAGIC) + 9 + 4 + 4 + len("test")
    content = content[:header_end] + HARMFUL[name] + content[header_end:]
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(
        resource.RLIMIT_AS,
        (_address_space() + 6 * CHUNK_LIMIT_BYTES, limits[1]),
    )
    try:
        result, messages = repaired(tmp_path, content)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
    assert result.num_faults >= 1
    assert len(messages) == 200


def _address_space():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[0]) * resource.getpagesize()


def test_more_definitions_than_a_recording_has(tmp_path):
    schema = record_of(
        Opcode.SCHEMA,
        struct.pack("<HIII", 0, 0, 0, 2**20) + bytes(2**20),
    )
    chunks = b""
    for first in (1, 36):
        schemas = b"".join(
            schema[:9] + struct.pack("<H", k) + schema[11:]
            for k in range(first, first + 35)
        )
        data = zstandard.compress(schemas)
        chunks += record_of(Opcode.CHUNK, chunk_of(data, size=len(schemas)))
    path = tmp_path / "many.mcap"
    path.write_bytes(MCAP0_MAGIC + chunks)
    with pytest.raises(InputError, match=r"many\.mcap: more topics"):
        repair_mcap(path)


def test_false_chunks_do_not_keep_a_reader_busy():
    # Each has the form of a chunk up to the end of the file, and must be read
    # to find out that it is none.
    count = 3000
    size = 53
    total = 8 + count * size
    content = bytearray(MCAP0_MAGIC)
    for _ in range(count):
        left = total - len(content) - 9
        chunk = chunk_of(b"", size=10, length=left - 44)
        content += record_of(Opcode.CHUNK, chunk, left)
    content[-9:] = bytes(9)
    faults = list(read_records(io.BytesIO(content)))
    assert all(isinstance(fault, Fault) for fault in faults)
    assert faults[-1].text.startswith("too much damage")
    assert len(faults) < 100
