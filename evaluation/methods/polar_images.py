"""Polar images of scans, from above: the input of the learned descriptor."""

import math

import numpy as np

from evaluation.maps import extremes

RINGS = 64
SECTORS = 192
# Channels: occupied bands of height, then greatest height, thickness and lowest
# height.
CHANNELS = 8
# Range of the outermost ring [m].
REACH = 64.0
# Lower ends of the bands, above the ground below the sensor [m].
_BANDS = np.array([0.35, 1.0, 2.0, 4.0, 8.0])
# Heights at which the last three channels saturate [m].
_HIGHEST = 16.0
_THICKEST = 0.5
_LOWEST = 3.0


def polar_image(points: np.ndarray, sensor_height: float) -> np.ndarray:
    """Returns the polar image of a scan.

    The image shows the scan from above. The rows of the image are rings around
    the sensor, and the columns are sectors. A rotation of the sensor by a whole
    number of sectors only shifts the columns.

    Args:
        points: (N, 3) in the frame of the sensor [m].
        sensor_height: height of the sensor above the ground [m].

    Returns:
        (RINGS, SECTORS, CHANNELS) uint8, 0 where there is no point. The first
        five channels say which bands of height contain points; the bands begin
        at 0.35, 1, 2, 4 and 8 m. The other three channels are the greatest
        height (0 to 16 m), the difference between greatest and lowest height (0
        to 0.5 m), and the lowest height (-3 to 3 m).
    """
    x, y, z = points.T
    ring = np.hypot(x, y) * (RINGS / REACH)
    near = ring < RINGS
    x = x[near]
    y = y[near]
    ring = ring[near].astype(np.int64)
    height = z[near] + sensor_height
    sector = np.arctan2(y, x) * (SECTORS / (2.0 * math.pi))
    cell = ring * SECTORS + np.floor(sector).astype(np.int64) % SECTORS
    band = np.searchsorted(_BANDS, height, side="right")
    counts = np.bincount(
        cell * (len(_BANDS) + 1) + band,
        minlength=RINGS * SECTORS * (len(_BANDS) + 1),
    ).reshape(RINGS * SECTORS, -1)
    least, greatest = extremes(height, cell, RINGS * SECTORS)
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
        # Zero is reserved for empty cells.
        image[filled, channel] = 1.0 + 254.0 * np.clip(share, 0.0, 1.0)
    return image.reshape(RINGS, SECTORS, CHANNELS)


def share_of_seen_sectors(image: np.ndarray) -> float:
    """Returns the share of a polar image's sectors with at least one point."""
    return float(image.any(axis=(0, 2)).mean())
