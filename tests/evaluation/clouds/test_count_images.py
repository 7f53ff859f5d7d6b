"""Bird's-eye images of counted voxels: rules, inverse, damaged files."""

import numpy as np
from PIL import Image
import pytest

from cns_drake.base import InputError
from evaluation.clouds import check_image, count_image, image_points, read_image

# Pixels on a side of an image that is made here.
WIDTH = 151


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
    assert image.shape == (WIDTH, WIDTH)
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


@pytest.mark.parametrize("most", range(1, 11))
def test_images_are_recovered(most):
    rng = np.random.default_rng(most)
    counts = np.zeros((WIDTH, WIDTH), int)
    counts[13:138, 13:138] = rng.integers(0, most + 1, (125, 125))
    counts[75, 75] = most
    image = np.rint(counts * (255.0 / most)).astype(np.uint8)
    np.testing.assert_array_equal(count_image(image_points(image)), image)
    # A program that cuts off instead has nearly the same.
    cut = (counts * (255.0 / most)).astype(np.uint8)
    np.testing.assert_array_equal(count_image(image_points(cut)), image)


def save(path, pixels, **options):
    Image.fromarray(pixels).save(path, format="PNG", **options)
    return path


def test_files(tmp_path):
    pixels = np.arange(25, dtype=np.uint8).reshape(5, 5)
    good = save(tmp_path / "good.png", pixels)
    check_image(good)
    np.testing.assert_array_equal(read_image(good), pixels)
    deep = pixels.astype(np.uint16) * 300
    colour = np.stack([pixels] * 3, axis=2)
    for name, wrong, fault in (
        ("deep", deep, "an image of mode I;16, not of one channel of 8 bits"),
        ("colour", colour, "an image of mode RGB, not of one channel"),
        ("wide", pixels[:3], "5 x 3 pixels, not square"),
        ("even", pixels[:4, :4], "4 pixels on a side; it must be an odd"),
        ("large", np.zeros((1003, 1003), np.uint8), "1003 pixels on a side"),
    ):
        path = save(tmp_path / f"{name}.png", wrong)
        for function in (check_image, read_image):
            with pytest.raises(InputError) as caught:
                function(path)
            assert f"{name}.png: {fault}" in str(caught.value)
    whole = save(
        tmp_path / "whole.png",
        np.random.default_rng(1).integers(0, 256, (99, 99), np.uint8),
    ).read_bytes()
    for name, content in (
        ("empty", b""),
        ("text", b"no image"),
        ("cut", whole[: len(whole) // 2]),
        ("changed", whole[:3000] + b"\x00" * 99 + whole[3099:]),
    ):
        path = tmp_path / f"{name}.png"
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"no image \(PNG\), or damaged"):
            read_image(path)
    Image.fromarray(pixels).save(tmp_path / "b.png", format="BMP")
    with pytest.raises(InputError, match="no image"):
        check_image(tmp_path / "b.png")
    with pytest.raises(InputError, match=r"none\.png"):
        check_image(tmp_path / "none.png")
