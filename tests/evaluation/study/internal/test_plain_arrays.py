import contextlib
import io
import json
import struct

import numpy as np
import pytest

from evaluation.study.parts import decode, encode


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


def test_arrays_are_stored_as_numpy_writes_them():
    stream = io.BytesIO()
    for array in arrays():
        np.lib.format.write_array(stream, array)
    numbers = [{"array": k} for k in range(len(arrays()))]
    tree = json.dumps(numbers, separators=(",", ":")).encode()
    expected = struct.pack("<Q", len(tree)) + tree + stream.getvalue()
    assert encode(arrays()) == expected


@pytest.mark.parametrize("turned", [False, True])
def test_arrays_come_back_after_others_of_their_type(turned):
    stored = [*arrays(), *arrays()]
    if turned:
        stored.reverse()
    for old, new in zip(stored, decode(encode(stored)), strict=True):
        assert (old.dtype, old.shape) == (new.dtype, new.shape)
        assert old.tobytes() == new.tobytes()
        assert new.flags.writeable
        if old.flags.forc:
            assert old.flags.c_contiguous == new.flags.c_contiguous
            assert old.flags.f_contiguous == new.flags.f_contiguous


@pytest.mark.filterwarnings("ignore:Stored array in format 3.0")
def test_names_of_fields_are_any_text():
    old = np.ones(4, dtype=[("h\u00f6he", "<f4"), ("\u540d", ">u2")])
    (new,) = decode(encode([old]))
    assert new.dtype == old.dtype
    assert new.tobytes() == old.tobytes()


def test_names_of_fields_belong_to_one_array():
    old = np.ones(4, dtype=[("a", "<f4"), ("b", "<f4")])
    first, second = decode(encode([old, old.copy()]))
    first.dtype.names = ("p", "q")
    (third,) = decode(encode([old]))
    assert second.dtype.names == third.dtype.names == ("a", "b")


def test_what_is_read_shares_no_memory():
    first, second = decode(encode([np.zeros(3), np.zeros(3)]))
    first[:] = 1.0
    second[:] = 2.0
    assert first.tolist() == [1.0] * 3


@pytest.mark.parametrize(
    "shape",
    [
        b"(9,)",
        b"(9223372036854775807,)",
        b"(999999999999999999999,)",
        b"(-4,)",
        b"(4, 4)",
        b"(4.,)",
        b"(4,",
        b"(4,,)",
        b"4",
        b"(" + b"1" * 40,
    ],
)
@pytest.mark.parametrize("before", [[], [np.ones(3)]])
def test_an_array_of_another_shape(shape, before):
    data = encode([*before, np.arange(4.0)])
    old = b"(4,), }"
    old += b" " * (len(shape) - len(b"(4,)"))
    new = (shape + b", }").ljust(len(old))
    assert data.count(old) == 1
    with pytest.raises(ValueError, match=r"."):
        decode(data.replace(old, new))


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
