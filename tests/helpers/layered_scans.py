"""Scans for layered overlap, and pictures of them by brute force."""

import math

import numpy as np


def some_cells(seed, sizes=(60, 50, 40, 9, 20)):
    """Returns a scan's cells at random, layer by layer."""
    rng = np.random.default_rng(seed)
    cells = [
        np.sort(rng.choice(256 * 256, size, replace=False)) for size in sizes
    ]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    return np.concatenate(cells).astype(np.uint16), starts


def town(seed, number=45):
    """Returns walls, poles and ground around a sensor at 1.6 m, (N, 3)."""
    rng = np.random.default_rng([seed, 7])
    parts = [np.zeros((0, 3))]
    for _ in range(number):
        centre = rng.uniform(-55.0, 55.0, 2)
        if np.hypot(*centre) < 5.0:
            continue
        length = rng.uniform(0.2, 14.0, 2) * [1.0, 0.02]
        turn = rng.choice([0.0, 0.5 * math.pi, 0.7])
        box = rng.uniform(-0.5, 0.5, (400, 2)) * length @ matrix(turn)[:2, :2].T
        height = rng.uniform(0.0, rng.choice([1.0, 3.0, 12.0]), (400, 1))
        parts.append(np.hstack([box + centre, height - 1.6]))
    for _ in range(25):
        centre = rng.uniform(-40.0, 40.0, 2)
        z = np.linspace(-1.6, 3.0, 40)
        parts.append(np.column_stack([np.tile(centre, (40, 1)), z]))
    # Each ring of each sector has ground where the method needs it.
    r, turn = np.meshgrid(np.arange(0.5, 90.0), np.arange(0.5, 360.0))
    x, y = (r * f(np.radians(turn)) for f in (np.cos, np.sin))
    parts.append(np.stack([x, y, np.full(x.shape, -1.6)], -1).reshape(-1, 3))
    return np.concatenate(parts)


def matrix(yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def seen_from(points, yaw, x, y):
    """Returns points in the frame of a sensor with that pose."""
    return (points - [x, y, 0.0]) @ matrix(yaw)


# The oracle has no words of bits and no compiled loops.


def image(cells, starts, layer, turn, halvings):
    """Returns a layer as a turned picture (n, n) of bool."""
    n = 256 >> halvings
    picture = np.zeros((n, n), dtype=bool)
    for number in cells[starts[layer] : starts[layer + 1]].tolist():
        u, v = 2 * (number // 256) + 1 - 256, 2 * (number % 256) + 1 - 256
        unit = 2 * 2**14 << halvings
        row = (int(turn[0]) * u - int(turn[1]) * v + (256 << 14)) // unit
        column = (int(turn[1]) * u + int(turn[0]) * v + (256 << 14)) // unit
        if 0 <= row < n and 0 <= column < n:
            picture[row, column] = True
    return picture


def shifted(picture, right, up):
    n = len(picture)
    result = np.zeros_like(picture)
    for row, column in np.argwhere(picture).tolist():
        if 0 <= row + right < n and 0 <= column + up < n:
            result[row + right, column + up] = True
    return result
