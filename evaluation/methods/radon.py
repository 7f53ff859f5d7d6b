"""The Radon transform of a small image with several channels."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.base.compiled import compiled


@compiled
def radon(image: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Returns the integrals of an image along parallel rays.

    With u the column and v the row of a pixel, counted from the centre of
    the image, the ray s of angle t is u cos t - v sin t = s, where s counts
    pixels from the centre, too. Image and value follow torch-radon (Ronchetti
    2020): a ray samples the image once in each row (or each column, if it
    is closer to those), interpolates between the two nearest pixels, and its
    sum counts times the distance between samples; outside of the image
    everything is zero.

    A pixel at distance d from a ray contributes hat(d / w) / w with w =
    max(|cos t|, |sin t|) and hat(x) = max(1 - |x|, 0). Only pixels that are not
    zero are visited.

    Args:
        image: (n, n, C) rows, columns, channels.
        angles: (A,) [rad].

    Returns:
        (A, n, C) for each angle and s = -(n - 1) / 2, ..., (n - 1) / 2.
    """
    size, _, num_channels = image.shape
    centre = 0.5 * (size - 1)
    cosines, sines = np.cos(angles), np.sin(angles)
    result = np.zeros((len(angles), size, num_channels))
    for row in range(size):
        for column in range(size):
            if not image[row, column].any():
                continue
            for index in range(len(angles)):
                cosine, sine = cosines[index], sines[index]
                width = max(abs(cosine), abs(sine))
                place = (
                    centre + (column - centre) * cosine - (row - centre) * sine
                )
                # width <= 1, so that at most two rays pass near enough.
                left = math.floor(place)
                for ray in (left, left + 1):
                    # Nothing is added rather than left out: a branch would
                    # often be predicted wrongly.
                    share = max(1.0 - abs(ray - place) / width, 0.0)
                    if 0 <= ray < size:
                        for channel in range(num_channels):
                            result[index, ray, channel] += (
                                share / width * image[row, column, channel]
                            )
    return result
