"""MCAP files without an index whose records are damaged, or made to harm."""

import struct

from helpers.mcap_bytes import write_mcap
import lz4.frame
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC, CompressionType, IndexType
import pytest
import zstandard

from evaluation.base import InputError
from evaluation.drives.mcap_file import McapFile

# Behind the magic bytes and the header.
START = len(MCAP0_MAGIC) + 9 + 4 + 4 + len("test")


def bare(compression=CompressionType.ZSTD, **options):
    return write_mcap(
        compression,
        index_types=IndexType.NONE,
        use_statistics=False,
        repeat_channels=False,
        repeat_schemas=False,
        **options,
    )


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("use_chunking", [False, True])
def test_all_messages_are_found_without_an_index(
    tmp_path, compression, use_chunking
):
    path = tmp_path / "bare.mcap"
    path.write_bytes(bare(compression, use_chunking=use_chunking))
    with path.open("rb") as stream:
        wanted = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(stream).iter_messages()
        ]
    file = McapFile(path)
    found = [
        (topic, int(place["log_time_ns"]), bytes(file.read(place)))
        for topic in file.topics
        for place in file.locate(topic)
    ]
    assert sorted(found) == sorted(wanted)
    assert file.attachment("last.txt") == b"last"
    assert file.metadata("note") == [{"key": "value"}]


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
GIGABYTE = 1 << 30
BOMB = make_bomb(GIGABYTE)
LZ4_BOMB = lz4.frame.compress(bytes(64 * 2**20), store_size=False)
HARMFUL = {
    "huge record": record_of(Opcode.METADATA, b"abc", HUGE),
    "huge attachment": record_of(
        Opcode.ATTACHMENT, struct.pack("<QQIIQI", 0, 0, 0, 0, HUGE, 0)
    ),
    "huge name": record_of(Opcode.SCHEMA, struct.pack("<HI", 9, 2**32 - 1)),
    "huge map": record_of(Opcode.METADATA, struct.pack("<II", 0, 2**32 - 1)),
    "huge chunk": record_of(Opcode.CHUNK, chunk_of(b"", size=HUGE)),
    "huge chunk content": record_of(
        Opcode.CHUNK, chunk_of(b"", size=0, length=HUGE)
    ),
    "bomb": record_of(Opcode.CHUNK, chunk_of(BOMB, size=GIGABYTE)),
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
    "record of nothing": bytes(100),
    "not text": record_of(
        Opcode.SCHEMA, struct.pack("<HI", 9, 2) + b"\xff" * 9
    ),
}


@pytest.mark.parametrize("name", HARMFUL)
def test_harmful_records_are_refused_at_their_place(tmp_path, name):
    content = bare()
    path = tmp_path / "a.mcap"
    path.write_bytes(content[:START] + HARMFUL[name] + content[START:])
    fault = rf"a\.mcap: damaged MCAP file \(byte {START}: .*mcap recover IN"
    with pytest.raises(InputError, match=fault) as error:
        McapFile(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "content", [b"", b"MCAP", MCAP0_MAGIC, b"\x06" * 100_000, bytes(100_000)]
)
def test_files_without_anything_readable(tmp_path, content):
    path = tmp_path / "file.mcap"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"file\.mcap: .*MCAP") as error:
        McapFile(path)
    assert "\n" not in str(error.value)
