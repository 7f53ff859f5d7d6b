import math

import numpy as np
import pytest

from evaluation.methods.ringpp import radon


def dot(size, row, column, value=1.0):
    image = np.zeros((size, size, 1))
    image[row, column] = value
    return image


def sample(image, row, column):
    """Returns an image between its pixels, zero outside."""
    r0, c0 = math.floor(row), math.floor(column)
    total = 0.0
    for r in (r0, r0 + 1):
        for c in (c0, c0 + 1):
            if 0 <= r < image.shape[0] and 0 <= c < image.shape[1]:
                weight = (1.0 - abs(r - row)) * (1.0 - abs(c - column))
                total += weight * image[r, c]
    return total


def follow_rays(image, angle):
    """Returns the sums along rays, one sample for each row or column."""
    size = len(image)
    centre = (size - 1) / 2
    cosine, sine = math.cos(angle), math.sin(angle)
    sums = []
    for s in np.arange(size) - centre:
        total = 0.0
        for step in np.arange(size) - centre:
            if abs(cosine) >= abs(sine):
                v = step
                u = (s + v * sine) / cosine
            else:
                u = step
                v = (u * cosine - s) / sine
            total += sample(image, v + centre, u + centre)
        sums.append(total / max(abs(cosine), abs(sine)))
    return sums


@pytest.mark.parametrize("angle_deg", [0.0, 17.0, 45.0, 133.0, 200.0, 301.0])
def test_one_pixel_casts_a_hat(angle_deg):
    size = 15
    row = 4
    column = 9
    value = 2.5
    angle = math.radians(angle_deg)
    result = radon(dot(size, row, column, value), np.array([angle]))[0, :, 0]
    # Distance of the pixel from the ray through the centre.
    place = (column - 7) * math.cos(angle) - (row - 7) * math.sin(angle)
    width = max(abs(math.cos(angle)), abs(math.sin(angle)))
    s = np.arange(size) - 7
    hat = np.maximum(1.0 - np.abs(s - place) / width, 0.0) / width
    np.testing.assert_allclose(result, value * hat, atol=1e-12)


@pytest.mark.parametrize("angle_deg", [3.0, 44.9, 45.1, 90.0, 158.0, 333.0])
@pytest.mark.parametrize("size", [7, 8])
def test_against_following_rays(angle_deg, size):
    image = np.random.default_rng([size]).uniform(size=(size, size))
    angle = math.radians(angle_deg)
    result = radon(image[:, :, None], np.array([angle]))[0, :, 0]
    np.testing.assert_allclose(result, follow_rays(image, angle), atol=1e-9)


def test_a_turned_image_shifts_the_angles():
    image = np.random.default_rng([3]).uniform(size=(8, 8, 1))
    angles = np.arange(8) * (math.pi / 4)
    # From the axis of the rows to that of the columns.
    turned = np.rot90(image)
    shifted = np.roll(radon(image, angles), 2, axis=0)
    np.testing.assert_allclose(
        radon(np.ascontiguousarray(turned), angles), shifted, atol=1e-12
    )
