"""Unpacks compressed data from untrusted sources, up to a limit."""

from collections.abc import Iterable
import io
from pathlib import Path
import zipfile

import lz4.frame
import numpy as np
import zstandard

from evaluation.base.errors import one_line
from evaluation.base.files import read_bytes

# The compressions that `np.savez` and `np.savez_compressed` write. Of these,
# `zipfile` unpacks no more than it is asked for.
_ZIPPED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def unpacked(packed: bytes, compression: str, most_bytes: int) -> bytes:
    """Returns data without their compression.

    Args:
        packed: the compressed data.
        compression: `zstd`, `lz4`, or "" for data that are not compressed.
        most_bytes: greatest size of the result. No more memory is used, not
            even if the data claim to be larger.

    Raises:
        ValueError: the data are damaged, unpack to more, or have an unknown
            compression.
    """
    too_large = ValueError(f"data of more than {most_bytes} bytes")
    try:
        if compression == "zstd":
            # The library reserves the size that the data claim.
            if zstandard.frame_content_size(packed) > most_bytes:
                raise too_large
            data = zstandard.decompress(packed, most_bytes)
        elif compression == "lz4":
            unpacker = lz4.frame.LZ4FrameDecompressor()
            data = unpacker.decompress(packed, max_length=most_bytes)
            if not unpacker.eof:
                raise too_large
        elif compression == "":
            data = packed
        else:
            raise ValueError(f"unknown compression {compression!r}")
    except (zstandard.ZstdError, RuntimeError) as error:
        raise ValueError(one_line(str(error))) from error
    if len(data) > most_bytes:
        raise too_large
    return data


def read_npz(
    path: Path, names: Iterable[str], most_bytes: int
) -> dict[str, np.ndarray]:
    """Reads the named arrays of an .npz file, as name -> array.

    Names that the file lacks are left out. Sizes are limited, and no pickled
    code is run.

    Args:
        path: the file.
        names: names of the arrays to read.
        most_bytes: greatest size of the file, and of the named arrays together.

    Raises:
        InputError: the file cannot be read, or is too large.
        ValueError: the file is not an .npz archive, or the arrays are too
            large.
    """
    content = read_bytes(path, most_bytes)
    found = {}
    left = most_bytes
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            known = {info.filename: info for info in archive.infolist()}
            for name in names:
                info = known.get(f"{name}.npy")
                if info is None:
                    continue
                left -= info.file_size
                if left < 0:
                    raise ValueError(f"{name}: more than {most_bytes} bytes")
                if info.compress_type not in _ZIPPED:
                    raise ValueError(f"{name}: an unknown compression")
                with archive.open(info) as member:
                    # Without a size, all that is compressed is unpacked first,
                    # and then cut to the declared size.
                    array = member.read(info.file_size)
                found[name] = np.lib.format.read_array(
                    io.BytesIO(array), allow_pickle=False
                )
    except Exception as error:
        # NumPy evaluates headers as Python, and can raise any error.
        fault = one_line(f"{type(error).__name__}: {error}")
        raise ValueError(fault) from error
    return found
