from dataclasses import dataclass
import json
import os
import pickle
import struct
import sys
from typing import NamedTuple

import numpy as np
import pytest
import zstandard

from evaluation.base import InputError, Part, fingerprint

INPUTS = {"drive": ["a", 3], "roles": ("places",), "z": {"b": 1.5, "a": None}}


@dataclass(frozen=True)
class Description:
    spectrum: np.ndarray
    filled: np.ndarray
    empty: np.ndarray


@pytest.fixture
def part(tmp_path):
    part = Part(tmp_path / "new" / "folder" / "values.data")
    part.write(INPUTS, list(range(1000)))
    return part


def test_arrays_come_back_bit_by_bit(tmp_path):
    rng = np.random.default_rng(5)
    spectrum = (rng.normal(size=(40, 7)) * 1j).astype(np.complex64)
    spectrum[3, 3] = complex(np.nan, -0.0)
    value = Description(
        np.asfortranarray(spectrum),
        np.flatnonzero(rng.integers(2, size=50)),
        np.empty((0, 3)),
    )
    part = Part(tmp_path / "one.data")
    part.write(INPUTS, value)
    again = part.read()
    for name in ("spectrum", "filled", "empty"):
        old, new = getattr(value, name), getattr(again, name)
        assert (old.dtype, old.shape) == (new.dtype, new.shape)
        assert old.flags.f_contiguous == new.flags.f_contiguous
        assert old.tobytes("A") == new.tobytes("A")


def test_equal_inputs_and_values_give_equal_bytes(part, tmp_path):
    turned = {key: INPUTS[key] for key in reversed(INPUTS)}
    again = Part(tmp_path / "again.data")
    again.write(turned, list(range(1000)))
    assert again.path.read_bytes() == part.path.read_bytes()


def test_a_part_belongs_to_its_inputs(part):
    assert part.is_current(INPUTS)
    assert part.identity() == fingerprint(INPUTS)
    assert part.is_current({**INPUTS, "roles": ["places"]})
    for other in (
        {**INPUTS, "roles": []},
        {**INPUTS, "more": 1},
        {**INPUTS, "z": {"b": 1.5000001, "a": None}},
    ):
        assert not part.is_current(other)


def test_only_a_whole_part_is_one(part, tmp_path):
    whole = part.path.read_bytes()
    assert not Part(tmp_path / "none.data").is_current(INPUTS)
    with pytest.raises(InputError, match=r"none.data: No such file"):
        Part(tmp_path / "none.data").read()
    for length in (0, 10, 16, 60, len(whole) - 1):
        part.path.write_bytes(whole[:length])
        assert not part.is_current(INPUTS)
        with pytest.raises(InputError, match=r"values.data: damaged"):
            part.read()
    part.path.write_bytes(whole + b"x")
    assert not part.is_current(INPUTS)


@pytest.mark.parametrize("place", [-1, -5, -200])
def test_damage_is_noticed_before_it_is_used(part, place):
    data = bytearray(part.path.read_bytes())
    data[place] ^= 1
    part.path.write_bytes(bytes(data))
    with pytest.raises(InputError, match=r"values.data: damaged .* delete it"):
        part.read()


def test_what_cannot_be_kept_leaves_the_part_as_it_was(part):
    whole = part.path.read_bytes()
    with pytest.raises(InputError, match=r"function cannot be kept"):
        part.write(INPUTS, lambda: None)
    assert [path.name for path in part.path.parent.iterdir()] == ["values.data"]
    assert part.path.read_bytes() == whole


def test_a_part_runs_nothing_of_what_it_names(tmp_path, monkeypatch):
    """It may come from others, so it runs neither imports nor constructors."""
    path = tmp_path / "ran"
    (tmp_path / "evil_module.py").write_text(
        f"from pathlib import Path\nPath({str(path)!r}).touch()\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    described = Description(*[np.zeros(1)] * 3)
    part = Part(tmp_path / "one.data")
    part.write({}, described)
    data = zstandard.decompress(part.path.read_bytes().split(b"\n", 2)[2])
    (length,) = struct.unpack_from("<Q", data)
    tree, arrays = data[8 : 8 + length], data[8 + length :]

    def refuses(changed, fault):
        assert changed != tree
        changed = struct.pack("<Q", len(changed)) + changed + arrays
        _replaced(part, data=zstandard.compress(changed))
        with pytest.raises(InputError, match=fault):
            part.read()

    module = __name__.encode()
    assert module in tree
    refuses(tree.replace(module, b"evil_module"), "evil_module")
    refuses(tree.replace(module, b"evaluation.nothing.here"), "ModuleNotFound")
    refuses(tree.replace(b'"Description"', b'"np"'), "no type")
    refuses(tree.replace(b'"Description"', b'"Painter"'), "dataclass")
    refuses(tree.replace(b'"empty"', b'"full"'), "other fields")
    refuses(tree.replace(b'"array":0', b'"array":9'), "IndexError")
    refuses(b"[" * 100_000, "RecursionError|Expecting")
    refuses(b"\xff", "decode")
    assert not path.exists()
    # A pickle with any bytes is refused.
    part.path.write_bytes(b"cns-eval part 1\n{}\n" + pickle.dumps(described))
    with pytest.raises(InputError, match="damaged"):
        part.read()


class Painter:
    def __init__(self):
        raise AssertionError("run")


class Pair(NamedTuple):
    low: float
    high: float


@pytest.mark.parametrize(
    "value",
    [
        None,
        True,
        2**200,
        -0.0,
        float("inf"),
        "\u00e9\n\0",
        (),
        [(), [], {}],
        {("a", 1): {2: None}, "array": 3, "dict": [1]},
        Pair(1.0, 2.5),
        np.float32(0.1),
        b"\0\xff",
    ],
)
def test_plain_values_come_back(tmp_path, value):
    part = Part(tmp_path / "one.data")
    part.write({}, value)
    again = part.read()
    assert type(again) is type(value)
    assert repr(again) == repr(value)


def test_an_array_that_is_there_twice_is_stored_once(tmp_path):
    array = np.random.default_rng(1).random(10_000)
    part = Part(tmp_path / "one.data")
    part.write({}, [Description(array, array, array), array])
    assert part.path.stat().st_size < 2 * array.nbytes
    again = part.read()
    assert again[0].spectrum is again[1]


@pytest.mark.parametrize(
    "value", [{1, 2}, object(), np.array([None]), [lambda: 0]]
)
def test_what_cannot_be_kept(tmp_path, value):
    path = tmp_path / "a.data"
    with pytest.raises(InputError, match=f"^{path}: .*cannot be kept"):
        Part(path).write({}, value)
    assert not list(tmp_path.iterdir())


def _replaced(part, header=None, data=None, **fields):
    """Writes a part again with another header or another value."""
    magic, line, old = part.path.read_bytes().split(b"\n", 2)
    data = old if data is None else data
    values = json.loads(line) | {"bytes": len(data)} | fields
    line = json.dumps(values).encode() if header is None else header
    part.path.write_bytes(b"\n".join([magic, line, data]))


@pytest.mark.parametrize(
    "header",
    [b"[" * 100_000, b"[]", b"null", b"3", b"{}", b'{"bytes": "1"}', b"\xff"],
)
def test_headers_that_are_none(part, header):
    _replaced(part, header)
    assert not part.is_current(INPUTS)
    with pytest.raises(InputError, match=r"values\.data: damaged"):
        part.read()


def test_a_part_is_a_file_that_ends(part):
    part.path.unlink()
    os.mkfifo(part.path)
    assert not part.is_current(INPUTS)
    with pytest.raises(InputError, match="not a regular file"):
        part.read()


def test_arrays_that_their_bytes_do_not_hold(part):
    """They reserve no memory, and are none of Python's objects."""
    for kind, shape in (("'<f8'", [10**14]), ("'|O'", [1])):
        index = json.dumps([[kind], [[0, shape, "C"]], {"array": 0}]).encode()
        plain = struct.pack("<Q", len(index)) + index + bytes(8)
        _replaced(part, data=zstandard.compress(plain))
        with pytest.raises(InputError, match="damaged"):
            part.read()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits memory")
def test_a_small_file_unpacks_to_no_gigabyte(part):
    packing = zstandard.ZstdCompressor().compressobj(size=1 << 30)
    data = b"".join(packing.compress(bytes(1 << 20)) for _ in range(1 << 10))
    _replaced(part, data=data + packing.flush())
    assert part.path.stat().st_size < 100_000
    with pytest.raises(InputError, match=f"^{part.path}: takes more memory"):
        part.read()
