"""Growth of a weeping willow: a short trunk, a dome, hanging strands."""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.lofts import tube
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.plants.foliage import keep_above, leaves

_HEIGHT = 9.0
_RADIUS = 3.7
_STRANDS = 70
_NODE_STEP = 0.52
_CROWN_BASE = 1.1


def grow_willow(rng: np.random.Generator) -> tuple[Mesh, Mesh]:
    """Returns the wood and the leaves of a willow 9 m high."""
    lean = rng.uniform(-0.5, 0.5, 2)
    fork = np.append(0.5 * lean, 2.3)
    wood = [
        tube(
            np.array([(0, 0, -0.5), (0, 0, 0), (*(0.2 * lean), 1.2), fork]),
            (0.46, 0.42, 0.33, 0.36),
            8,
        )
    ]
    nodes_of_limbs = []
    for k in range(7):
        angle = 2 * np.pi * (k + rng.uniform(-0.25, 0.25)) / 7
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        inner = fork + 0.8 * out + (0, 0, rng.uniform(1.8, 2.6))
        outer = (
            np.append(lean, 0.0)
            + rng.uniform(1.5, 2.4) * out
            + (0, 0, rng.uniform(6.2, 7.6))
        )
        wood.append(tube([fork, inner, outer], (0.2, 0.13, 0.04), 5))
        nodes_of_limbs += [inner, 0.5 * (inner + outer), outer]
    limbs = np.array(nodes_of_limbs)
    base, direction, normal = [], [], []
    for k in range(_STRANDS):
        # Even over the dome: equal areas, golden angle.
        height = 1 - 0.72 * (k + 0.5) / _STRANDS
        angle = 2.399963 * k + rng.uniform(-0.4, 0.4)
        ring = np.sqrt(1 - height**2) * rng.uniform(0.75, 1.08)
        top = np.array(
            [
                lean[0] + _RADIUS * ring * np.cos(angle),
                lean[1] + _RADIUS * ring * np.sin(angle),
                4.2 + (_HEIGHT - 4.2) * height * rng.uniform(0.9, 1.0),
            ]
        )
        if k % 2 == 0:
            near = limbs[np.argmin(np.linalg.norm(limbs - top, axis=1))]
            wood.append(tube([near, top], (0.035, 0.012), 3))
        end = rng.uniform(1.2, 3.0) + 2.2 * height**2
        drift = 0.12 * rng.standard_normal(2)
        nodes = np.arange(0.0, top[2] - end, _NODE_STEP)
        for m, down in enumerate(nodes):
            spot = top + np.append(drift * down, -down)
            sway = 0.45 * rng.standard_normal(2)
            base.append(spot)
            direction.append((*sway, -1.0 if m else -0.2))
            normal.append((*rng.standard_normal(2), 0.3))
    n = len(base)
    foliage = leaves(
        base,
        direction,
        normal,
        rng.uniform(0.6, 1.0, n),
        rng.uniform(0.2, 0.36, n),
    )
    return merge_meshes(*wood), keep_above(foliage, _CROWN_BASE)
