"""BEVPlace: each step against its definition, and the method as a whole."""

import io
import itertools
import math
import pickle
import zipfile

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
import pytest
from scipy.ndimage import map_coordinates

from evaluation import check_method
from evaluation.base import InputError
from evaluation.methods import make_method
from evaluation.methods.bevplace import (
    SHAPES,
    _turned_images,
    count_image,
    describe_image,
)
from evaluation.recognition import choose_methods

# As large as an image must be for all scales.
SIZE = 63


def random_weights(seed=1):
    """Returns weights that neither explode nor vanish."""
    rng = np.random.default_rng(seed)
    weights = {
        name: rng.normal(
            scale=1.0 / math.sqrt(max(math.prod(shape[1:]), 1)), size=shape
        ).astype(np.float32)
        for name, shape in SHAPES.items()
    }
    # Otherwise the centroids outweigh what is in an image.
    weights["netvlad.centroids"] *= 0.01
    return weights


def picture(seed=3, size=SIZE):
    """Returns an image of walls."""
    rng = np.random.default_rng(seed)
    image = np.zeros((size, size), np.uint8)
    for _ in range(12):
        row, column = rng.integers(2, size - 12, 2)
        image[row : row + rng.integers(1, 10), column : column + 2] = 255
        image[row, column : column + 9] = 102
    return image


def reference(weights, image):
    """The descriptor by definition, in double precision and in loops."""
    weights = {name: value.astype(float) for name, value in weights.items()}
    local = []
    for turned, points in _turned_images(image):
        x = turned.transpose(2, 0, 1).astype(float)
        name = "encoder.extractor.extractor.conv"
        for block, inner in itertools.product("01", "03"):
            x = convolved(x, weights[f"{name}{block}.{inner}.weight"])
            mean = x.mean(axis=(1, 2), keepdims=True)
            variance = x.var(axis=(1, 2), keepdims=True)
            x = (x - mean) / np.sqrt(variance + 1e-5)
            if (block, inner) != ("1", "3"):
                x = np.maximum(x, 0.0)
            if (block, inner) == ("0", "3"):
                _, height, width = x.shape
                x = x[:, : height // 2 * 2, : width // 2 * 2]
                x = (x[:, ::2, ::2] + x[:, 1::2, ::2]) / 4.0 + (
                    x[:, ::2, 1::2] + x[:, 1::2, 1::2]
                ) / 4.0
        x /= np.linalg.norm(x, axis=0)
        # Positions are scaled as if the outer pixels' centres were the borders.
        last = np.array(x.shape[:0:-1]) - 1.0
        at = (points + 0.5) / 2.0 - 0.5
        at = at / last * (last + 1.0) - 0.5
        local.append(
            [
                map_coordinates(
                    np.pad(one, 1), at.T[::-1] + 1.0, order=1, cval=0.0
                )
                for one in x
            ]
        )
    # (points, channels, scales, turns)
    grid = np.array(local).transpose(2, 1, 0).reshape(-1, 32, 5, 5)
    one, two = (
        embedded(weights, f"encoder.embedder.embedder.network{k}_", grid)
        for k in "12"
    )
    vlad = np.zeros((64, 128))
    for a, b in zip(one, two, strict=True):
        x = (a.reshape(8, 25) @ b.reshape(16, 25).T).ravel()
        x /= np.linalg.norm(x)
        logits = weights["netvlad.conv.weight"][:, :, 0, 0] @ x
        shares = np.exp(logits - logits.max())
        shares /= shares.sum()
        vlad += shares[:, None] * (x - weights["netvlad.centroids"])
    vlad /= np.linalg.norm(vlad, axis=1, keepdims=True)
    return vlad.ravel() / np.linalg.norm(vlad)


def convolved(x, kernel):
    """Cross-correlation of (..., channels, H, W) with zeros around."""
    half = kernel.shape[-1] // 2
    around = [(0, 0)] * (x.ndim - 2) + [(half, half)] * 2
    windows = sliding_window_view(np.pad(x, around), kernel.shape[2:], (-2, -1))
    result = np.tensordot(windows, kernel, ([-5, -2, -1], [1, 2, 3]))
    return np.moveaxis(result, -1, -3)


def embedded(weights, name, x):
    def layer(part, x):
        bias = weights[f"{name}{part}.bias"][:, None, None]
        return convolved(x, weights[f"{name}{part}.weight"]) + bias

    for block in ("embed1", "embed2"):
        y = layer(f"{block}.2", np.maximum(layer(f"{block}.0", x), 0.0))
        x = np.maximum(y + layer(f"{block}_short", x), 0.0)
    return layer("embed3.2", np.maximum(layer("embed3.0", x), 0.0))


def column(x, y, number):
    """Returns a column of voxels with two points each."""
    z = np.repeat(0.4 * np.arange(number) - 1.6, 2) + [0.01, 0.3] * number
    return np.stack([np.full(2 * number, x), np.full(2 * number, y), z], axis=1)


@pytest.mark.parametrize(
    ("x", "y", "row", "left"),
    [
        (0.0, 0.0, 75, 75),
        # The pixel in the middle reaches to both sides.
        (0.39, -0.39, 75, 75),
        (0.41, 0.41, 74, 74),
        (-0.41, -0.41, 76, 76),
        (25.1, -25.1, 13, 137),
        (10.1, 0.0, 50, 75),
    ],
)
def test_one_column(x, y, row, left):
    image = count_image(column(x, y, 4))
    assert image.shape == (151, 151)
    assert np.argwhere(image).tolist() == [[row, left]]
    # The largest number is 255, whatever it is.
    assert image.max() == 255


def test_counts_are_those_beyond_the_first_up_to_ten():
    columns = [column(2.0 * k, 5.1, k) for k in (1, 2, 6, 11, 12)]
    image = count_image(np.concatenate(columns))
    found = [int(image[75 - 5 * k, 75 - 12]) for k in (1, 2, 6, 11, 12)]
    assert found[:2] == [0, round(25.5)]
    assert found[2] == pytest.approx(127.5, abs=0.5)
    assert found[3:] == [255, 255]


def test_points_out_of_reach_are_left_out():
    far = [column(x, y, 5) for x, y in ((25.3, 0.0), (0.0, -25.3))]
    high = column(3.0, 3.0, 5) + np.array([0.0, 0.0, 30.0])
    assert not count_image(np.concatenate([*far, high])).any()
    assert not count_image(np.zeros((0, 3))).any()


@pytest.mark.slow
def test_the_descriptor_by_definition():
    weights = random_weights()
    found, other = (describe_image(weights, picture(k)) for k in (3, 9))
    assert found.dtype == np.float32
    wanted = reference(weights, picture(3))
    # Random weights see little in an image, but far more than this.
    assert np.linalg.norm(found - wanted) < 1e-6
    assert np.linalg.norm(found - other) > 3e-4
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-5)


def channels(image):
    """The three channels of an image, as the weights expect them."""
    mean = np.array([0.485, 0.456, 0.406])
    deviation = np.array([0.229, 0.224, 0.225])
    scaled = (image[..., None] / 255.0 - mean) / deviation * 255.0
    return (scaled - 127.0) / 128.0


def test_quarter_turns_move_pixels_only():
    image = picture()
    turned = list(itertools.islice(_turned_images(image), 5))
    np.testing.assert_allclose(turned[2][0], channels(image), atol=1e-5)
    grid = turned[2][1].astype(int)
    for number in (0, 4):
        pixels, points = turned[number]
        # Points move with their pixels, and to other places.
        wanted = channels(image)[grid[:, 1], grid[:, 0]]
        column, row = np.rint(points).astype(int).T
        np.testing.assert_allclose(pixels[row, column], wanted, atol=1e-4)
    # Indices turn about the corner of a pixel: (x, y) becomes (y, S - x).
    np.testing.assert_allclose(
        turned[0][1], np.stack([grid[:, 1], SIZE - grid[:, 0]], 1), atol=1e-4
    )


def test_turns_by_half_a_quarter():
    image = picture()
    pixels, points = list(itertools.islice(_turned_images(image), 5))[1]
    assert pixels.shape == (89, 89, 3)
    # From the points, which are known in both images, the map follows.
    grid = np.stack(np.meshgrid(*[np.arange(5, SIZE - 5, 5)] * 2), axis=-1)
    ones = np.c_[points.astype(float), np.ones(len(points))]
    back = np.linalg.lstsq(ones, grid.reshape(-1, 2), rcond=None)[0]
    column, row = np.meshgrid(np.arange(89), np.arange(89))
    at = np.stack([column, row, np.ones_like(row)], axis=-1) @ back
    for channel in range(3):
        padded = np.pad(channels(image)[..., channel], 99)
        wanted = map_coordinates(
            padded, at.transpose(2, 0, 1)[::-1] + 99, order=1
        )
        gap = np.abs(pixels[..., channel] - wanted)
        # Positions are rounded to 1/32 pixel; a step is at most that of a wall.
        step = np.ptp(channels(image)[..., channel])
        assert gap.max() < 2.0 * step / 32.0
    # Far from the image is the border, which is 0.
    assert not pixels[0, 0].any()


@pytest.mark.slow
def test_the_method(tmp_path):
    weights = random_weights()
    path = tmp_path / "w.npz"
    np.savez(path, **weights, **{"netvlad.wq.bias": np.zeros(64, np.float32)})
    method = make_method("bevplace", {"weights": path})
    cloud = np.concatenate([column(3.0 * k, 9.0 - k, k) for k in range(2, 8)])
    described = method.describe(cloud)
    np.testing.assert_array_equal(
        described, describe_image(weights, count_image(cloud))
    )
    nothing = method.describe(np.zeros((0, 3)))
    # A descriptor has length 1, and its opposite lies 2 away.
    database = method.build_database([described, -described, nothing])
    scores = method.score(described, database)
    assert scores[0] == pytest.approx(0.0, abs=1e-3)
    assert scores[1] == pytest.approx(-2.0, rel=1e-4)
    # A place without a pixel is no candidate, and a query finds none.
    assert np.isnan(scores[2])
    assert np.isnan(method.score(nothing, database)).all()
    assert method.relative_pose(described, database, 0) is None


@pytest.mark.slow
@pytest.mark.night
def test_it_keeps_the_interface(tmp_path):
    np.savez(tmp_path / "w.npz", **random_weights())
    check_method(make_method("bevplace", {"weights": tmp_path / "w.npz"}))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (None, "netvlad.centroids is missing"),
        (np.ones((2, 2), np.float32), r"\(2, 2\) instead of \(64, 128\)"),
        (np.full((64, 128), np.nan, np.float32), "not all are finite"),
        (np.full((64, 128), 1e300), "not all are finite"),
        (np.ones((64, 128), np.complex64), "not all are finite"),
    ],
)
def test_other_weights(tmp_path, change, message):
    values = random_weights() | {"netvlad.centroids": change}
    if change is None:
        del values["netvlad.centroids"]
    path = tmp_path / "w.npz"
    np.savez(path, **values)
    with pytest.raises(InputError, match=rf"w\.npz: .*{message}") as error:
        make_method("bevplace", {"weights": path})
    assert "\n" not in str(error.value)


def test_names_with_a_prefix(tmp_path):
    """As those of a network that was trained on several devices."""
    weights = {f"module.{k}": v for k, v in random_weights().items()}
    np.savez(tmp_path / "w.npz", **weights)
    with pytest.raises(InputError, match=r"no prefix, such as module\."):
        make_method("bevplace", {"weights": tmp_path / "w.npz"})


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
        InputError, match=rf"{name}: no \.npz .*docs/notes/bevplace"
    ) as error:
        make_method("bevplace", {"weights": path})
    assert "\n" not in str(error.value)
    assert not Ran.ran


@pytest.mark.slow
def test_weights_can_run_no_code(tmp_path):
    path = tmp_path / "w.npz"
    name = "netvlad.centroids"
    np.savez(path, **random_weights() | {name: np.array([Ran()], object)})
    with pytest.raises(InputError, match=r"w\.npz: .*pickle"):
        make_method("bevplace", {"weights": path})
    assert not Ran.ran


def test_weights_must_be_given(tmp_path):
    with pytest.raises(InputError, match=r"w\.npz: No such file"):
        make_method("bevplace", {"weights": tmp_path / "w.npz"})
    with pytest.raises(InputError, match="bevplace: weights: Field required"):
        choose_methods(["bevplace"])


def test_two_files_of_weights_are_two_methods(tmp_path):
    digests = set()
    for seed in (1, 2):
        path = tmp_path / "w.npz"
        np.savez(path, **random_weights(seed))
        chosen = choose_methods(["bevplace"], [f"bevplace.weights={path}"])[-1]
        digests.add(chosen.identity()["parameters"]["digest"])
    assert len(digests) == 2
    assert {len(one) for one in digests} == {16}
