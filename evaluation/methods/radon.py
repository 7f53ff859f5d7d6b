"""The Radon transform of an image."""

import numpy as np
import scipy.sparse


def radon(image: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Returns the integrals of an image along parallel rays.

    Let u be the column and v the row of a pixel, counted from the centre of the
    image. The ray s of angle t is u cos t - v sin t = s, where s also counts
    pixels from the centre. Axes and values agree with torch-radon (Ronchetti
    2020). A ray within 45 degrees of the vertical samples the image once in
    each row, any other ray once in each column. Each sample interpolates
    between the two nearest pixels; a sample outside the image is zero. The sum
    of the samples is multiplied by the distance between samples.

    A pixel at distance d from a ray contributes hat(d / w) / w with w =
    max(|cos t|, |sin t|) and hat(x) = max(1 - |x|, 0).

    Args:
        image: (n, n, C) rows, columns, channels.
        angles: (A,) [rad].

    Returns:
        (A, n, C) for each angle and s = -(n - 1) / 2, ..., (n - 1) / 2.
    """
    size, _, num_channels = image.shape
    centre = 0.5 * (size - 1)
    flat = image.reshape(size * size, num_channels)
    pixels = np.flatnonzero(flat.any(axis=1))
    row, column = np.divmod(pixels, size)
    cosines, sines = np.cos(angles), np.sin(angles)
    width = np.maximum(np.abs(cosines), np.abs(sines))
    projected = (
        centre
        + (column - centre)[:, None] * cosines
        - (row - centre)[:, None] * sines
    )
    # width <= 1, so that at most two rays pass near enough.
    left = np.floor(projected)
    rays = np.stack([left, left + 1.0], axis=1)
    share = (
        np.maximum(1.0 - np.abs(rays - projected[:, None]) / width, 0.0) / width
    )
    share[(rays < 0.0) | (rays >= size)] = 0.0
    cells = np.arange(len(angles)) * size + np.clip(rays, 0.0, size - 1.0)
    # A column for each pixel, with two rays of each angle.
    shares = scipy.sparse.csc_array(
        (
            share.ravel(),
            cells.ravel().astype(np.int32),
            np.arange(len(pixels) + 1, dtype=np.int32) * 2 * len(angles),
        ),
        shape=(len(angles) * size, len(pixels)),
    )
    return (shares @ flat[pixels]).reshape(len(angles), size, num_channels)
