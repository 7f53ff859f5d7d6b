import contextlib

import numpy as np
import pytest

from evaluation.base.jobs.parts import decode, encode


def arrays():
    rng = np.random.default_rng(8)
    grid = rng.normal(size=(4, 5, 6))
    record = np.dtype([("x", "<f4"), ("n", ">u2")])
    return [
        np.zeros(0),
        np.zeros((3, 0, 2)),
        np.array(2.5),
        grid,
        np.asfortranarray(grid),
        grid[:, ::2],
        grid.T,
        grid[:, :1, :1],
        grid.astype(">f8"),
        grid.astype(np.float16) > 0,
        rng.normal(size=7) + 1j,
        np.arange(11, dtype=np.uint8),
        np.array(["a", "\u00e9\u00e9"]),
        np.array(["2020-01-01"], dtype="M8[s]"),
        np.array([b"a"], dtype="V3"),
        np.ones(4, dtype=record),
        np.ones((2, 1_000_000), dtype=np.int8),
    ]


def test_arrays_come_back_in_their_order():
    for old, new in zip(arrays(), decode(encode(arrays())), strict=True):
        assert (old.dtype, old.shape) == (new.dtype, new.shape)
        assert old.flags.fnc == new.flags.fnc
        assert old.tobytes() == new.tobytes()
        new[...] = old


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_any_damage_of_a_header_is_a_fault_or_harmless():
    value = [np.arange(3.0), np.asfortranarray(np.ones((2, 3)))]
    data = encode(value)
    for place in range(len(data)):
        for byte in b"\0\1\xff \n'(){}[],:#0O\\":
            damaged = data[:place] + bytes([byte]) + data[place + 1 :]
            with contextlib.suppress(ValueError):
                decode(damaged)
    for length in range(len(data)):
        with pytest.raises(ValueError, match=r"."):
            decode(data[:length])
