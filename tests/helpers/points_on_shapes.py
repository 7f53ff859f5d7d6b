"""Points drawn on curved shapes."""

import numpy as np

from cns_drake.scene import CapsuleSurface, EllipsoidSurface


def points_on(surface, rng, num=3000):
    """Points on a shape, in its frame."""
    d = rng.normal(size=(num, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    if isinstance(surface, EllipsoidSurface):
        return d * surface.semi_axes
    if isinstance(surface, CapsuleSurface):
        side = np.sign(d[:, 2:]) * surface.length / 2.0
        return d * surface.radius + side * [0.0, 0.0, 1.0]
    around = rng.uniform(0.0, 2.0 * np.pi, num)
    r = surface.radius * np.where(np.arange(num) % 2, 1.0, rng.random(num))
    z = np.where(
        np.arange(num) % 2, rng.uniform(-1, 1, num), np.sign(d[:, 2])
    ) * (surface.length / 2.0)
    return np.column_stack([r * np.cos(around), r * np.sin(around), z])
