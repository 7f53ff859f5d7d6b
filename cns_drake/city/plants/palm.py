"""Growth of a palm: a slender stem under a head of arching fronds."""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.lofts import tube
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.plants.foliage import leaves, unit

_HEIGHT = 8.5
_STEM = 7.0
_FRONDS = 22
_LEAFLETS = 10


def grow_palm(rng: np.random.Generator) -> tuple[Mesh, Mesh]:
    """Returns the stem and the fronds of a palm 8.5 m high."""
    z = np.array([-0.5, 0.0, 0.5, 2.5, 4.5, 6.2, _STEM])
    t = np.clip(z / _STEM, 0, 1)
    bend = rng.uniform(-0.7, 0.7, 2)
    stem = np.column_stack([np.outer(t**1.6, bend), z])
    wood = [
        tube(stem, (0.26, 0.24, 0.18, 0.15, 0.14, 0.16, 0.2), 8),
        tube(
            [stem[-1] - (0, 0, 0.3), stem[-1] + (0, 0, 0.25)], (0.24, 0.12), 7
        ),
    ]
    ribs, rows = [], []
    for k in range(_FRONDS):
        angle = 2.399963 * k + rng.uniform(-0.25, 0.25)
        # Golden-angle order: the inner fronds rise, the outer ones hang.
        rise = np.interp(k, [0, _FRONDS - 1], [1.35, 0.0])
        rise += rng.uniform(-0.15, 0.15)
        length = rng.uniform(2.1, 2.7)
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        s = np.linspace(0, 1, 7)
        run = length * (np.cos(rise) * s + 0.12 * s**2)
        fall = length * (np.sin(rise) * s - (0.55 + 0.25 * np.cos(rise)) * s**2)
        rib = stem[-1] + np.outer(run, out)
        rib[:, 2] += 0.15 + fall
        ribs += [
            tube(rib[[a, b]], (0.03 - 0.004 * a, 0.03 - 0.004 * b), 3)
            for a, b in ((0, 2), (2, 4), (4, 6))
        ]
        rows.append(_leaflets(rng, rib, out))
    merged = [np.concatenate(column) for column in zip(*rows, strict=True)]
    fronds = merge_meshes(leaves(*merged), *ribs)
    return merge_meshes(*wood), fronds


def _leaflets(
    rng: np.random.Generator, rib: np.ndarray, out: np.ndarray
) -> list[np.ndarray]:
    """Returns the leaflets along one rib, as the arguments of `leaves`."""
    at = np.linspace(0.2, 0.99, _LEAFLETS)
    base = np.column_stack(
        [
            np.interp(at, np.linspace(0, 1, len(rib)), rib[:, k])
            for k in range(3)
        ]
    )
    along = unit(rib[-1] - rib[0])
    across = np.array([-out[1], out[0], 0.0])
    length = 0.85 * np.sin(np.pi * (0.15 + 0.75 * at)) ** 0.7
    columns = []
    for side in (-1.0, 1.0):
        droop = -0.35 - 0.3 * rng.uniform(size=(len(at), 1))
        direction = side * across + 0.75 * along + droop * (0.0, 0.0, 1.0)
        normal = np.tile((0.0, 0.0, 1.0), (len(at), 1)) + 0.5 * side * across
        width = np.full(len(at), 0.22)
        columns.append((base, direction, normal, length, width))
    return [np.concatenate(column) for column in zip(*columns, strict=True)]
