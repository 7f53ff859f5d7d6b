"""A street of points, with fronts and blocks."""

import numpy as np


def sheet(origin, u, v, seed, density=4.0):
    """Returns points (N, 3) drawn on a parallelogram, some for each m^2."""
    u, v = np.asarray(u, float), np.asarray(v, float)
    area = np.linalg.norm(np.cross(u, v))
    parts = np.random.default_rng(seed).uniform(size=(int(density * area), 2))
    return np.asarray(origin, float) + parts @ np.stack([u, v])


def street(seed=0, *, ends=True, density=4.0):
    """Returns a street along x between fronts, with ends and some blocks."""
    length, up = (60.0, 0.0, 0.0), (0.0, 0.0, 12.0)
    parts = [
        sheet((-30.0, -10.0, 0.0), length, (0.0, 20.0, 0.0), seed, density),
        sheet((-30.0, -10.0, 0.0), length, up, seed + 1, density),
        sheet((-30.0, 10.0, 0.0), length, up, seed + 2, density),
    ]
    if ends:
        for k, x in enumerate((-22.0, -9.0, 4.0, 15.0, 27.0)):
            side = (-1.0) ** k
            corner = x, 6.0 * side, 0.0
            parts.append(
                sheet(corner, (0.0, 4.0 * side, 0.0), up, 10 + k, density)
            )
    return np.concatenate(parts)
