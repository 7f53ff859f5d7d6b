"""Polar images of scans: what a learned method sees, and is trained with.

Seen from above, rings and sectors around the sensor make the pixels. A turn of
the sensor by a whole number of sectors only shifts the columns.
"""

import math

import numpy as np

RINGS = 64
SECTORS = 192
# Occupied bands of height, then greatest height, thickness, and lowest height.
CHANNELS = 8
# Range of the outermost ring [m].
REACH = 64.0
# Lower ends of the bands, above the ground below the sensor [m].
_BANDS = np.array([0.35, 1.0, 2.0, 4.0, 8.0])
# Heights at which the channels end [m].
_HIGHEST = 16.0
_THICKEST = 0.5
_LOWEST = 3.0


def polar_image(points: np.ndarray, sensor_height: float) -> np.ndarray:
    """Returns the polar image of a scan.

    Args:
        points: (N, 3) in the frame of the sensor [m].
        sensor_height: height of the sensor above the ground [m].

    Returns:
        (RINGS, SECTORS, CHANNELS) uint8, 0 where there is no point. The first
        five channels say which bands of height have points: from 0.35, 1, 2, 4
        and 8 m on. The others are the greatest height (0 to 16 m), the greatest
        less the lowest (0 to 0.5 m), and the lowest (-3 to 3 m).
    """
    x, y, z = points.T
    ring = np.hypot(x, y) * (RINGS / REACH)
    near = ring < RINGS
    x, y, ring = x[near], y[near], ring[near].astype(np.int64)
    height = z[near] + sensor_height
    sector = np.arctan2(y, x) * (SECTORS / (2.0 * math.pi))
    cell = ring * SECTORS + np.floor(sector).astype(np.int64) % SECTORS
    band = np.searchsorted(_BANDS, height, side="right")
    counts = np.bincount(
        cell * (len(_BANDS) + 1) + band,
        minlength=RINGS * SECTORS * (len(_BANDS) + 1),
    ).reshape(RINGS * SECTORS, -1)
    greatest = np.full(RINGS * SECTORS, -np.inf)
    np.maximum.at(greatest, cell, height)
    least = np.full(RINGS * SECTORS, np.inf)
    np.minimum.at(least, cell, height)
    filled = np.isfinite(least)
    greatest, least = greatest[filled], least[filled]
    image = np.zeros((RINGS * SECTORS, CHANNELS), np.uint8)
    image[:, :5] = np.where(counts[:, 1:] > 0, 255, 0)
    shares = (
        greatest / _HIGHEST,
        (greatest - least) / _THICKEST,
        (least + _LOWEST) / (2.0 * _LOWEST),
    )
    for channel, share in enumerate(shares, start=5):
        # Zero is kept for empty cells.
        image[filled, channel] = 1.0 + 254.0 * np.clip(share, 0.0, 1.0)
    return image.reshape(RINGS, SECTORS, CHANNELS)
