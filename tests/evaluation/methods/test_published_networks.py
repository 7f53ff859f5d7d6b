"""Published networks: convolutions, files of weights, closed forms."""

import itertools
import math
import struct
import tracemalloc
import zipfile

from helpers.torch_files import save_weights
import numpy as np
import pytest
from scipy.ndimage import correlate
from scipy.special import expit

from cns_drake.base.errors import InputError
from evaluation.methods import make_method
from evaluation.methods.dpa_net import DPA_NET_SHAPES, dpa_net, farthest_points
from evaluation.methods.pointnetvlad_clouds import prepare_cloud
from evaluation.methods.sparse_convolution import coarser, convolve
from evaluation.methods.svt_net import SVT_NET_SHAPES, svt_net
from evaluation.methods.torch_weights import read_weights
from evaluation.study.chosen_methods import choose_methods

RNG = np.random.default_rng(11)


def grid(size=8, part=0.3, channels=2):
    """Returns cells, some below 0, their features, and both in a box."""
    taken = RNG.uniform(size=(size, size, size)) < part
    cells = np.argwhere(taken)
    features = RNG.normal(size=(len(cells), channels))
    dense = np.zeros((size, size, size, channels))
    dense[taken] = features
    return cells - size // 2, features, dense, taken


def image(kernel, size, i, o):
    """Returns weights over x, y, z: of offsets, the first runs fastest."""
    values = np.zeros((size, size, size))
    for number, (z, y, x) in enumerate(
        itertools.product(range(size), repeat=3)
    ):
        values[x, y, z] = kernel[number, i, o]
    return values


@pytest.mark.parametrize("size", [1, 3, 5])
def test_convolution_of_a_dense_grid(size):
    cells, features, dense, taken = grid()
    order = RNG.permutation(len(cells))
    kernel = RNG.normal(size=(size**3, 2, 3))
    found = convolve(cells[order], features[order], kernel)
    for o in range(3):
        wanted = sum(
            correlate(dense[..., i], image(kernel, size, i, o), mode="constant")
            for i in range(2)
        )
        np.testing.assert_allclose(found[:, o], wanted[taken][order], atol=1e-9)


def test_convolution_to_a_coarser_grid():
    cells, features, dense, _ = grid()
    kernel = RNG.normal(size=(8, 2, 3))
    at = coarser(cells, 2)
    assert {tuple(c) for c in at.tolist()} == {
        tuple(2 * math.floor(v / 2) for v in cell) for cell in cells.tolist()
    }
    found = convolve(cells, features, kernel, 1, at)
    for (x, y, z), row in zip(at + 4, found, strict=True):
        block = dense[x : x + 2, y : y + 2, z : z + 2]
        wanted = sum(
            np.einsum("xyz,xyz->", block[..., i], image(kernel, 2, i, 1))
            for i in range(2)
        )
        assert row[1] == pytest.approx(wanted)


def test_convolution_with_a_step():
    cells, features = grid()[:2]
    kernel = RNG.normal(size=(27, 2, 1))
    once, thrice = (convolve(k * cells, features, kernel, k) for k in (1, 3))
    np.testing.assert_allclose(once, thrice)


def test_farthest_points():
    points = RNG.normal(size=(60, 3)).astype(np.float32)
    chosen = [0]
    for _ in range(9):
        gaps = [min(math.dist(p, points[c]) for c in chosen) for p in points]
        chosen.append(int(np.argmax(gaps)))
    assert farthest_points(points, 10).tolist() == chosen


def street(number=20_000, slope=0.05):
    """Returns sloping ground with walls of 8 m on both sides, (N, 3)."""
    rng = np.random.default_rng(2)
    x, y = rng.uniform([-60.0, -9.0], [60.0, 9.0], (number, 2)).T
    z = np.zeros(number)
    wall = np.arange(number) % 3 == 0
    y[wall] = np.where(y[wall] > 0.0, 9.0, -9.0)
    z[wall] = rng.uniform(0.0, 8.0, wall.sum())
    return np.stack([x, y, z + slope * x - 1.6], axis=1)


def test_preparation():
    points = street()
    cloud = prepare_cloud(points)
    assert cloud.shape == (4096, 3)
    assert cloud.dtype == np.float32
    assert np.abs(cloud).max() <= 1.0
    again = prepare_cloud(street(2000))
    assert again.shape == (4096, 3)
    # Without ground the rest has its centre at 0, and a mean distance of 1/2,
    # up to the few that are drawn anew.
    assert np.abs(cloud.mean(axis=0)).max() < 0.02
    distances = np.linalg.norm(cloud, axis=1)
    assert distances.mean() == pytest.approx(0.5, abs=0.02)
    # x points backwards: the street falls ahead.
    assert np.polyfit(cloud[:, 0], cloud[:, 2], 1)[0] == pytest.approx(
        -0.05, abs=0.01
    )
    ground = np.array([[x, y, -1.6] for x in range(9) for y in range(9)], float)
    assert (
        prepare_cloud(ground).shape == prepare_cloud(ground[:0]).shape == (0, 3)
    )


def collapsed():
    """Yields clouds of which nothing but one place is above the ground."""
    x, y = np.meshgrid(np.linspace(-40, 40, 50), np.linspace(-40, 40, 50))
    ground = np.stack([x.ravel(), y.ravel(), np.full(2500, -1.6)], axis=1)
    for number in (0, 1, 2, 100):
        yield np.r_[ground, np.tile([5.0, 3.0, 1.0], (number, 1))]
    yield ground[:2]
    yield np.tile([[5.0, 3.0, 1.0]], (3000, 1))


def test_clouds_at_one_place_have_no_descriptor():
    for points in collapsed():
        assert prepare_cloud(points).shape == (0, 3)
    # Two places are enough. Points of a grid are often drawn on one line.
    ground = next(collapsed())
    two = [[5.0, 3.0, 1.0], [8.0, -3.0, 4.0]]
    assert prepare_cloud(np.r_[ground, two]).shape == (4096, 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["svt-net", "dpa-net"])
def test_collapsed_clouds_are_no_candidates(tmp_path, monkeypatch, name):
    shapes = {"svt-net": SVT_NET_SHAPES, "dpa-net": DPA_NET_SHAPES}[name]
    weights = {
        key: RNG.uniform(0.5, 1.0, shape).astype(np.float32) * 0.1
        for key, shape in shapes.items()
    }
    path = save_weights(tmp_path / "w.pth", weights, monkeypatch)
    method = make_method(name, {"weights": path})
    ground = next(collapsed())
    clouds = [street(4000), *collapsed()]
    clouds.append(np.r_[ground, [[5.0, 3.0, 1.0], [8.0, -3.0, 4.0]]])
    described = [method.describe(one) for one in clouds]
    scores = method.score(described[0], method.build_database(described))
    assert np.isfinite(scores[[0, -1]]).all()
    assert np.isnan(scores[1:-1]).all()


def blank(shapes, **values):
    """Returns weights of 0, of normalisations that change nothing, and some."""
    weights = {n: np.zeros(s, np.float32) for n, s in shapes.items()}
    for name in weights:
        if name.endswith(("running_var", "bn.weight", "norm1.weight")):
            weights[name][:] = 1.0
            if name.endswith("running_var"):
                weights[name] -= 1e-6 if "spconv" in name else 1e-5
    for name, value in values.items():
        weights[name][...] = value
    return weights


def svt_weights():
    """Returns weights by which each channel counts the cells of a block."""
    eye = np.eye(32)
    weights = blank(SVT_NET_SHAPES)
    weights["backbone.conv0.kernel"][62] = 1.0
    for number in (0, 1):
        weights[f"backbone.convs.{number}.kernel"][:] = eye
    weights["backbone.blocks.1.0.downsample.0.kernel"][:, :32] = eye
    weights["backbone.conv1x1.0.kernel"][:32, :32] = 3.0 * eye
    weights["pooling.p"][:] = 2.0
    return weights


def test_svt_net_in_closed_form():
    cloud = RNG.uniform(-0.1, 0.1, (500, 3)).astype(np.float32)
    cells = {tuple(c) for c in np.floor(cloud / np.float32(0.01)).tolist()}
    counts = {}
    for cell in cells:
        block = tuple(v // 4 for v in cell)
        counts[block] = counts.get(block, 0) + 1
    # Both transformers add nothing to their input, and both have it.
    wanted = math.sqrt(np.mean([(6.0 * n) ** 2 for n in counts.values()]))
    found = svt_net(svt_weights(), cloud)
    np.testing.assert_allclose(found[:32], wanted, rtol=1e-5)
    np.testing.assert_allclose(found[32:], 1e-6, rtol=1e-3)


def dpa_weights():
    """Returns weights by which a point is described by its coordinates."""
    rng = np.random.default_rng(4)
    weights = blank(DPA_NET_SHAPES, **{"Gem.p": 1.0})
    random = ("spconv", "offset", "q_proj", "k_proj", "rel_pos", "interpolate")
    for name, values in weights.items():
        if any(part in name for part in random) and "var" not in name:
            values[...] = rng.normal(size=values.shape) * 0.1
    weights["dpa0.norm2.bias"][:] = rng.normal(size=32)
    for layer in (0, 1):
        kernel = weights[f"FP_modules.0.mlp.layer{layer}.conv.weight"]
        kernel[...] = rng.normal(size=kernel.shape)
    return weights


def test_dpa_net_in_closed_form():
    cloud = RNG.uniform(-1.0, 1.0, (1500, 3)).astype(np.float32)
    weights = dpa_weights()
    # The attention ends with the same 32 numbers at each point.
    feature = np.tile(weights["dpa0.norm2.bias"], (len(cloud), 1))
    x = np.concatenate([feature, cloud], axis=1)
    for layer in (0, 1):
        kernel = weights[f"FP_modules.0.mlp.layer{layer}.conv.weight"]
        x = np.maximum(x @ kernel[:, :, 0, 0].T, 0.0)
    wanted = np.maximum(x * expit(0.0), 1e-6).mean(axis=0)
    np.testing.assert_allclose(dpa_net(weights, cloud), wanted, rtol=1e-3)


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


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pooling.p": None}, "pooling.p: no such tensor"),
        ({"pooling.p": np.ones(2, np.float32)}, r"\(2,\) instead of \(1,\)"),
        ({"pooling.p": np.full(1, np.nan, np.float32)}, "not all are finite"),
    ],
)
def test_other_weights(tmp_path, monkeypatch, changes, message):
    values = {**svt_weights(), **changes}
    values = {k: v for k, v in values.items() if v is not None}
    path = save_weights(tmp_path / "w.pth", values, monkeypatch)
    with pytest.raises(InputError, match=rf"w\.pth: .*{message}") as error:
        make_method("svt-net", {"weights": path})
    assert "\n" not in str(error.value)


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


def test_as_a_method(tmp_path, monkeypatch):
    path = save_weights(tmp_path / "w.pth", svt_weights(), monkeypatch)
    chosen = choose_methods(["svt-net"], [f"svt-net.weights={path}"])[-1]
    method = chosen.make()
    assert len(chosen.identity()["parameters"]["digest"]) == 16
    query = method.describe(street())
    empty = method.describe(np.zeros((0, 3)))
    other = method.describe(street(slope=0.3) * [1.0, 2.0, 1.0])
    database = method.build_database([query, other, empty])
    scores = method.score(query, database)
    assert scores[0] == 0.0
    assert np.isnan(scores[2])
    assert scores[1] == pytest.approx(-np.linalg.norm(query - other))
    assert method.relative_pose(query, database, 0) is None
