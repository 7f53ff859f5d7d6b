"""Files of weights that PyTorch saves: sound, damaged and hostile files."""

import struct
import tracemalloc
import zipfile

from helpers.torch_files import save_weights
import numpy as np
import pytest

from cns_drake.base.errors import InputError
from evaluation.methods import make_method
from evaluation.methods.torch_weights import read_weights
from evaluation.study.chosen_methods import choose_methods

RNG = np.random.default_rng(11)


class Ran:
    """Runs code when it is unpickled."""

    ran = False

    def __reduce__(self):
        return setattr, (Ran, "ran", True)


def test_weights_as_saved(tmp_path, monkeypatch):
    values = {
        "a": RNG.normal(size=(2, 3)).astype(np.float32),
        "b": np.float32(3.0),
        "c": RNG.normal(size=(4, 5)).astype(np.float32).T,
        "more": np.zeros(7, np.float32),
    }
    shapes = {"a": (2, 3), "b": (), "c": (5, 4)}
    for around in (
        lambda state: state,
        lambda state: {"epoch": 3, "net": state, "run": Ran()},
        lambda state: {"state": [Ran(), {"model": state}]},
        lambda state: {f"module.{k}": v for k, v in state.items()},
        lambda state: {"a": {f"x.model.{k}": v for k, v in state.items()}},
    ):
        path = save_weights(tmp_path / "w.pth", values, monkeypatch, around)
        found = read_weights(path, shapes)
        assert not Ran.ran
        assert found.keys() == shapes.keys()
        for name, value in found.items():
            np.testing.assert_array_equal(value, values[name])


def test_weights_in_other_numbers(tmp_path, monkeypatch):
    values = RNG.normal(size=(2, 3)).astype(np.float32)
    path = tmp_path / "w.pth"

    def read(stored, **options):
        save_weights(path, {"a": stored}, monkeypatch, **options)
        (found,) = read_weights(path, {"a": (2, 3)}).values()
        assert found.dtype == np.float32
        return found

    np.testing.assert_array_equal(read(values, as_parameter=True), values)
    np.testing.assert_array_equal(read(values.astype("f8")), values)
    half = values.astype("f2")
    np.testing.assert_array_equal(read(half), half.astype(np.float32))
    brain = (values.view(np.uint32) >> 16).astype("u2")
    np.testing.assert_allclose(read(brain), values, rtol=2**-7)
    np.testing.assert_array_equal(
        read(np.arange(6).reshape(2, 3)), [[0, 1, 2], [3, 4, 5]]
    )
    with pytest.raises(InputError, match=r"a: numbers of the type Complex"):
        read(values.astype("c8"))
    with pytest.raises(InputError, match=r"a: not all are finite numbers"):
        read(np.full((2, 3), 1e300))


def test_one_of_two_sets_of_weights_is_named(tmp_path, monkeypatch, capsys):
    values = {"a": np.ones(2, np.float32)}
    path = save_weights(
        tmp_path / "w.pth",
        values,
        monkeypatch,
        lambda state: {"net": state, "ema": {"module.a": state["a"]}, "n": {}},
    )
    read_weights(path, {"a": (2,)})
    assert "w.pth: the weights in net are read, not in ema" in (
        capsys.readouterr().err
    )


def hostile(path, pickled, **data):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a/data.pkl", pickled)
        for key, content in data.items():
            archive.writestr(f"a/data/{key[1:]}", content)
    return path


def nested(number, levels):
    """A pickle of lists in lists, `number` ** `levels` when walked."""
    lists = b"](" + b"K\x01" * number + b"eq\x00"
    for k in range(1, levels):
        lists += (
            b"]("
            + b"h"
            + bytes([k - 1])
            + (b"h" + bytes([k - 1])) * (number - 1)
            + b"eq"
            + bytes([k])
        )
    return b"\x80\x02" + lists


_AGAIN = (
    b"(X\x07\x00\x00\x00storagectorch\nFloatStorage\n"
    b"X\x01\x00\x00\x000X\x03\x00\x00\x00cpuM\x01\x00tQ"
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pickled", "data"),
    [
        # A place in the memory of the unpickler, far behind all others.
        (b"\x80\x02Nr" + struct.pack("<I", 1 << 30) + b".", {}),
        # The same numbers again and again.
        (b"\x80\x02](" + _AGAIN * 40 + b"e.", {"_0": bytes(100_000_000)}),
        (nested(10, 9) + b".", {}),
        # A type that is called with them.
        (nested(10, 9) + b"0ctorch\nFloatStorage\nh\x08\x85R.", {}),
        (b"\x80\x02N" + b"\x85" * 500_000 + b".", {}),
        (b"\x80\x02}q\x00X\x01\x00\x00\x00ah\x00s.", {}),
        (b"\x80\x02cos\nsystem\nX\x05\x00\x00\x00falseR.", {}),
    ],
    ids=["memory", "again", "nested", "called", "deep", "itself", "code"],
)
def test_small_files_of_weights_take_little_memory(tmp_path, pickled, data):
    path = hostile(tmp_path / "w.pth", pickled, **data)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=r"w\.pth: ") as error:
            read_weights(path, {"a": (2, 3)})
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert "\n" not in str(error.value)
    # A step of a pickle makes at most one object.
    assert most < 300_000_000


def test_files_that_are_no_weights(tmp_path):
    path = tmp_path / "w.pth"
    with pytest.raises(InputError, match=r"w\.pth: No such file"):
        make_method("dpa-net", {"weights": path})
    path.write_bytes(b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19.\x80\x02.")
    with pytest.raises(InputError, match=r"w\.pth: .* PyTorch before 1\.6"):
        make_method("dpa-net", {"weights": path})
    path.write_bytes(b"text")
    with pytest.raises(InputError, match=r"w\.pth: no weights of PyTorch"):
        make_method("dpa-net", {"weights": path})
    with pytest.raises(InputError, match="svt-net: weights: Field required"):
        choose_methods(["svt-net"])
