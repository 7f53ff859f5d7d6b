import numpy as np
import pytest

from evaluation.clouds.pcd_files import _decompress_lzf


@pytest.mark.parametrize(
    ("packed", "plain"),
    [
        (b"\x02abc", b"abc"),
        # A copy of 3 bytes from 3 back, and one that overlaps its output.
        (b"\x02abc\x20\x02", b"abcabc"),
        (b"\x00a\x80\x00", b"a" + b"a" * 6),
        # A long copy: 7 + 200 + 2 bytes from 1 back.
        (b"\x00a\xe0\xc8\x00", b"a" + b"a" * 209),
    ],
)
def test_lzf(packed, plain):
    out = np.zeros(len(plain), dtype=np.uint8)
    data = np.frombuffer(packed, dtype=np.uint8)
    assert _decompress_lzf(data, out)
    assert out.tobytes() == plain
    # Too short, too long, and reaching back behind the beginning.
    assert not _decompress_lzf(data[:-1], out)
    assert not _decompress_lzf(data, np.zeros(len(plain) + 1, dtype=np.uint8))
    assert not _decompress_lzf(data, np.zeros(len(plain) - 1, dtype=np.uint8))
    assert not _decompress_lzf(
        np.frombuffer(b"\x00a\x20\x01", dtype=np.uint8),
        np.zeros(4, dtype=np.uint8),
    )
