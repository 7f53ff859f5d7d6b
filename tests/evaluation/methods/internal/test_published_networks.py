"""Published networks: clouds, closed forms, and weights of other shapes."""

import io
import math
import pickle
import tracemalloc
import zipfile

import numpy as np
import pytest
from scipy.special import expit

from cns_drake.base import InputError
from evaluation.methods import make_method
from evaluation.methods.dpa_net import DPA_NET_SHAPES, dpa_net, farthest_points
from evaluation.methods.pointnetvlad_clouds import prepare_cloud
from evaluation.methods.svt_net import SVT_NET_SHAPES, svt_net
from evaluation.study import choose_methods

RNG = np.random.default_rng(11)


def save_weights(path, weights):
    np.savez(path, **weights)
    return path


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
def test_collapsed_clouds_are_no_candidates(tmp_path, name):
    shapes, infer = {
        "svt-net": (SVT_NET_SHAPES, svt_net),
        "dpa-net": (DPA_NET_SHAPES, dpa_net),
    }[name]
    weights = {
        key: RNG.uniform(0.5, 1.0, shape).astype(np.float32) * 0.1
        for key, shape in shapes.items()
    }
    path = save_weights(tmp_path / "w.npz", weights)
    method = make_method(name, {"weights": path})
    ground = next(collapsed())
    clouds = [street(4000), *collapsed()]
    clouds.append(np.r_[ground, [[5.0, 3.0, 1.0], [8.0, -3.0, 4.0]]])
    described = [method.describe(one) for one in clouds]
    np.testing.assert_array_equal(
        described[0], infer(weights, prepare_cloud(clouds[0]))
    )
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


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pooling.p": None}, "pooling.p is missing"),
        ({"pooling.p": np.ones(2, np.float32)}, r"\(2,\) instead of \(1,\)"),
        ({"pooling.p": np.full(1, np.nan, np.float32)}, "not all are finite"),
        ({"pooling.p": np.full(1, 1e300)}, "not all are finite"),
        ({"pooling.p": np.ones(1, np.complex64)}, "not all are finite"),
    ],
)
def test_other_weights(tmp_path, changes, message):
    values = {**svt_weights(), **changes}
    values = {k: v for k, v in values.items() if v is not None}
    path = save_weights(tmp_path / "w.npz", values)
    with pytest.raises(InputError, match=rf"w\.npz: .*{message}") as error:
        make_method("svt-net", {"weights": path})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", ["f2", "f8"])
def test_weights_in_other_precisions(tmp_path, kind):
    weights = {k: v.astype(kind) for k, v in svt_weights().items()}
    path = save_weights(tmp_path / "w.npz", weights)
    method = make_method("svt-net", {"weights": path})
    exact = {k: v.astype(np.float32) for k, v in weights.items()}
    np.testing.assert_array_equal(
        method.describe(street()), svt_net(exact, prepare_cloud(street()))
    )


def test_names_with_a_prefix(tmp_path):
    """As those of a network that was trained on several devices."""
    weights = {f"module.{k}": v for k, v in svt_weights().items()}
    path = save_weights(tmp_path / "w.npz", weights)
    with pytest.raises(InputError, match=r"no prefix, such as module\."):
        make_method("svt-net", {"weights": path})


class Ran:
    """Runs code when it is unpickled."""

    ran = False

    def __reduce__(self):
        return setattr, (Ran, "ran", True)


def torch_file():
    """Returns a pickle in an archive, as `torch.save` writes it."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("archive/data.pkl", pickle.dumps({"state": Ran()}))
    return content.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        torch_file(),
        # Files of `torch.save` before PyTorch 1.6 begin like this.
        b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19.\x80\x02.",
        pickle.dumps(Ran()),
        b"text",
    ],
    ids=["zip", "legacy", "pickle", "text"],
)
@pytest.mark.parametrize("name", ["w.pth", "w.pth.tar", "w.npz"])
def test_files_of_pytorch_are_refused(tmp_path, content, name):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(
        InputError, match=rf"{name}: no \.npz .*docs/notes/published_networks"
    ) as error:
        make_method("dpa-net", {"weights": path})
    assert "\n" not in str(error.value)
    assert not Ran.ran


@pytest.mark.slow
def test_weights_can_neither_run_code_nor_fill_the_memory(tmp_path):
    path = tmp_path / "w.npz"
    code = np.array([Ran()], object)
    np.savez(path, **svt_weights() | {"pooling.p": code})
    with pytest.raises(InputError, match=r"w\.npz: .*pickle"):
        make_method("svt-net", {"weights": path})
    assert not Ran.ran
    np.savez_compressed(path, **{"pooling.p": np.zeros(80_000_000, np.float32)})
    assert path.stat().st_size < 1_000_000
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=r"w\.npz: .*pooling.p: more than"):
            make_method("svt-net", {"weights": path})
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 300_000_000


def test_weights_must_be_given(tmp_path):
    with pytest.raises(InputError, match=r"w\.npz: No such file"):
        make_method("dpa-net", {"weights": tmp_path / "w.npz"})
    with pytest.raises(InputError, match="svt-net: weights: Field required"):
        choose_methods(["svt-net"])


def test_as_a_method(tmp_path):
    path = save_weights(tmp_path / "w.npz", svt_weights())
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
