"""Archives and compressed data that claim more than they hold."""

import io
import os
import struct
import sys
import tracemalloc
import zipfile

import lz4.frame
import numpy as np
import pytest
import zstandard

from evaluation.base import InputError, read_npz, unpacked


def npy(shape, data=b""):
    """Returns the text of an array file with any shape."""
    stream = io.BytesIO()
    np.save(stream, np.zeros(0))
    text = stream.getvalue().replace(b"(0,)", shape.encode())
    return text + data


def archive(path, kind=zipfile.ZIP_STORED, **members):
    with zipfile.ZipFile(path, "w", kind) as target:
        for name, content in members.items():
            target.writestr(f"{name}.npy", content)
    return path


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_what_numpy_writes_is_read(tmp_path, save):
    values = {"a": np.arange(6.0).reshape(2, 3), "b": np.array(3)}
    save(tmp_path / "a.npz", **values, other=np.zeros(2))
    found = read_npz(tmp_path / "a.npz", ("a", "b", "none"))
    assert sorted(found) == ["a", "b"]
    for name, value in values.items():
        np.testing.assert_array_equal(found[name], value)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits memory")
@pytest.mark.parametrize(
    "shape", [f"({1 << 30},)", f"({1 << 27},)"], ids=["refused", "cut off"]
)
def test_a_small_archive_takes_little_memory(tmp_path, shape):
    member = npy(shape, bytes(1 << 27))
    path = archive(tmp_path / "a.npz", zipfile.ZIP_DEFLATED, a=member)
    with pytest.raises((ValueError, InputError), match=r"memory|Value"):
        read_npz(path, ("a",))
    # It is not unpacked if nobody asks for it.
    assert read_npz(path, ("b",)) == {}


def test_an_array_that_is_larger_than_declared(tmp_path):
    path = archive(tmp_path / "a.npz", zipfile.ZIP_DEFLATED, a=bytes(1 << 26))
    content = bytearray(path.read_bytes())
    # The size before compression, in the record of the member and in that of
    # the archive.
    for start, field in ((0, 22), (content.index(b"PK\x01\x02"), 24)):
        assert struct.unpack_from("<I", content, start + field) == (1 << 26,)
        struct.pack_into("<I", content, start + field, 100)
    path.write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(ValueError):  # noqa: PT011  # zipfile's own words.
            read_npz(path, ("a",))
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 5_000_000


@pytest.mark.parametrize(
    "member",
    [
        b"no array",
        npy("(True,)", bytes(8)),
        npy("(10000000000000,)"),
        npy("(3,)", bytes(8)),
        npy("(((((((((((("),
    ],
)
def test_members_that_are_no_arrays(tmp_path, member):
    with pytest.raises((ValueError, InputError)):
        read_npz(archive(tmp_path / "a.npz", a=member), ("a",))


def test_files_that_are_no_archives(tmp_path):
    path = tmp_path / "a.npz"
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(ValueError, match="BadZipFile"):
        read_npz(path, ("a",))
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(InputError, match="not a regular file"):
        read_npz(path, ("a",))
    whole = bytearray(archive(tmp_path / "b.npz", a=npy("(0,)")).read_bytes())
    whole[6] |= 1  # An encrypted member.
    whole[whole.index(b"PK\x01\x02") + 8] |= 1
    (tmp_path / "b.npz").write_bytes(whole)
    with pytest.raises(ValueError, match="encrypted"):
        read_npz(tmp_path / "b.npz", ("a",))


@pytest.mark.parametrize(
    ("compression", "compress"),
    [
        ("zstd", zstandard.compress),
        ("zstd", zstandard.ZstdCompressor(write_content_size=False).compress),
        ("lz4", lz4.frame.compress),
        # A zero, and 99,999 copies of the one before.
        ("lzf", lambda plain: b"\0\0" + b"\xe0\xff\0" * 378 + b"\xe0\xc6\0"),
        ("", bytes),
    ],
)
def test_data_unpack_to_their_size_and_to_no_other(compression, compress):
    plain = bytes(100_000)
    packed = compress(plain)
    assert unpacked(packed, compression, len(plain)) == plain
    for size in (len(plain) - 1, len(plain) + 1):
        with pytest.raises(ValueError, match=r"instead|not|dest|damaged"):
            unpacked(packed, compression, size)


@pytest.mark.parametrize("compression", ["zstd", "lz4", "lzf", "bz2"])
def test_damaged_and_unknown_data_are_value_errors(compression):
    with pytest.raises(ValueError, match=r"size|frame|compress"):
        unpacked(b"no compressed data", compression, 1 << 20)


@pytest.mark.parametrize(
    ("packed", "plain"),
    [
        (b"\x02abc", b"abc"),
        # A copy of 3 bytes from 3 back, and one that overlaps its output.
        (b"\x02abc\x20\x02", b"abcabc"),
        (b"\x00a\x80\x00", b"a" + b"a" * 6),
    ],
)
def test_lzf(packed, plain):
    assert unpacked(packed, "lzf", len(plain)) == plain
    # Cut off, and reaching back behind the beginning.
    for damaged in (packed[:-1], b"\x00a\x20\x01"):
        with pytest.raises(ValueError, match="damaged"):
            unpacked(damaged, "lzf", len(plain))
