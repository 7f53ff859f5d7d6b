"""Archives and compressed data that claim more than they hold."""

import io
import os
import struct
import tracemalloc
import zipfile

import lz4.frame
import numpy as np
import pytest
import zstandard

from evaluation.base import InputError, read_npz, unpacked

_LIMIT = 10_000


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
    found = read_npz(tmp_path / "a.npz", ("a", "b", "none"), _LIMIT)
    assert sorted(found) == ["a", "b"]
    for name, value in values.items():
        np.testing.assert_array_equal(found[name], value)


@pytest.mark.parametrize(
    "kind", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA]
)
def test_a_small_archive_takes_little_memory(tmp_path, kind):
    path = archive(tmp_path / "a.npz", kind, a=npy("(2000000,)", bytes(16**6)))
    with pytest.raises(ValueError, match="a: "):
        read_npz(path, ("a",), 20_000)
    # It is not unpacked if nobody asks for it.
    assert read_npz(path, ("b",), 20_000) == {}


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
            read_npz(path, ("a",), 1 << 20)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 5_000_000


def test_the_arrays_together_are_bounded(tmp_path):
    values = {name: np.zeros(1000) for name in "abc"}
    np.savez_compressed(tmp_path / "a.npz", **values)
    assert read_npz(tmp_path / "a.npz", "ab", 20_000).keys() == {"a", "b"}
    with pytest.raises(ValueError, match="c: more than 20000 bytes"):
        read_npz(tmp_path / "a.npz", "abc", 20_000)


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
    with pytest.raises(ValueError):  # noqa: PT011  # NumPy's own words.
        read_npz(archive(tmp_path / "a.npz", a=member), ("a",), _LIMIT)


def test_files_that_are_no_archives(tmp_path):
    path = tmp_path / "a.npz"
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(ValueError, match="BadZipFile"):
        read_npz(path, ("a",), _LIMIT)
    path.write_bytes(bytes(_LIMIT + 1))
    with pytest.raises(InputError, match="larger than"):
        read_npz(path, ("a",), _LIMIT)
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(InputError, match="not a regular file"):
        read_npz(path, ("a",), _LIMIT)
    whole = bytearray(archive(tmp_path / "b.npz", a=npy("(0,)")).read_bytes())
    whole[6] |= 1  # An encrypted member.
    whole[whole.index(b"PK\x01\x02") + 8] |= 1
    (tmp_path / "b.npz").write_bytes(whole)
    with pytest.raises(ValueError, match="encrypted"):
        read_npz(tmp_path / "b.npz", ("a",), _LIMIT)


@pytest.mark.parametrize(
    ("compression", "compress"),
    [
        ("zstd", zstandard.compress),
        ("zstd", zstandard.ZstdCompressor(write_content_size=False).compress),
        ("lz4", lz4.frame.compress),
        ("", bytes),
    ],
)
def test_data_unpack_to_their_limit_and_no_further(compression, compress):
    plain = bytes(100_000)
    packed = compress(plain)
    assert unpacked(packed, compression, len(plain)) == plain
    with pytest.raises(ValueError, match=r"more than|not|dest"):
        unpacked(packed, compression, len(plain) - 1)


@pytest.mark.parametrize("compression", ["zstd", "lz4", "bz2"])
def test_damaged_and_unknown_data_are_value_errors(compression):
    with pytest.raises(ValueError, match=r"size|frame|compression"):
        unpacked(b"no compressed data", compression, 1 << 20)
