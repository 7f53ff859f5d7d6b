"""Unpacks compressed data from untrusted sources."""

from collections.abc import Iterable
import io
from pathlib import Path
import zipfile

import lz4.frame
import numpy as np
import zstandard

from evaluation.base.budget import reading
from evaluation.base.errors import InputError, one_line
from evaluation.base.files import read_bytes

# The compressions that `np.savez` and `np.savez_compressed` write. Of these,
# `zipfile` unpacks no more than it is asked for.
_ZIPPED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def unpacked(packed: bytes, compression: str, size: int | None = None) -> bytes:
    """Returns data without their compression.

    Args:
        packed: the compressed data.
        compression: `zstd`, `lz4`, `lzf`, or "" for data that are not
            compressed.
        size: size of the result [bytes]; no more memory is used, not even if
            the data claim to be larger. None for the size that data by `zstd`
            state.

    Raises:
        ValueError: the data are damaged, unpack to another size, or have an
            unknown compression.
    """
    try:
        if compression == "zstd":
            # The library reserves the size that the data claim.
            claimed = zstandard.frame_content_size(packed)
            if size is not None and claimed > size:
                raise ValueError(f"{claimed} instead of {size} bytes")
            data = zstandard.decompress(packed, size or 0)
        elif compression == "lz4":
            unpacker = lz4.frame.LZ4FrameDecompressor()
            data = unpacker.decompress(packed, -1 if size is None else size)
            if not unpacker.eof:
                raise ValueError(f"not {size} bytes")
        elif compression == "lzf":
            data = _unpacked_lzf(packed, size or 0)
        elif compression == "":
            data = packed
        else:
            raise ValueError(f"unknown compression {compression!r}")
    except (zstandard.ZstdError, RuntimeError) as error:
        raise ValueError(one_line(str(error))) from error
    if size is not None and len(data) != size:
        raise ValueError(f"{len(data)} instead of {size} bytes")
    return data


def _unpacked_lzf(packed: bytes, size: int) -> bytes:
    from evaluation.base.lzf import unpack_lzf  # Numba takes long to import.

    data = np.empty(size, np.uint8)
    if not unpack_lzf(np.frombuffer(packed, np.uint8), data):
        raise ValueError("the compressed data is damaged")
    return data.tobytes()


def read_npz(path: Path, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Reads the named arrays of an .npz file, as name -> array.

    Names that the file lacks are left out. No pickled code is run.

    Args:
        path: the file.
        names: names of the arrays to read.

    Raises:
        InputError: the file cannot be read, or takes too much memory.
        ValueError: the file is not an .npz archive.
    """
    content = read_bytes(path)
    found = {}
    try:
        with reading(path), zipfile.ZipFile(io.BytesIO(content)) as archive:
            known = {info.filename: info for info in archive.infolist()}
            for name in names:
                info = known.get(f"{name}.npy")
                if info is None:
                    continue
                if info.compress_type not in _ZIPPED:
                    raise ValueError(f"{name}: an unknown compression")
                with archive.open(info) as member:
                    # Without a size, all that is compressed is unpacked first,
                    # and then cut to the declared size.
                    array = member.read(info.file_size)
                found[name] = np.lib.format.read_array(
                    io.BytesIO(array), allow_pickle=False
                )
    except InputError:
        raise
    except Exception as error:
        # NumPy evaluates headers as Python, and can raise any error.
        fault = one_line(f"{type(error).__name__}: {error}")
        raise ValueError(fault) from error
    return found
