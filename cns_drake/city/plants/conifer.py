"""Growth of a spruce: a straight stem and whorls of drooping branches."""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.lofts import tube
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.plants.foliage import keep_above, leaves

_HEIGHT = 12.0
_LOWEST_WHORL = 1.7
_REACH = 2.3
_WHORLS = 13
_CROWN_BASE = 0.9
_UP = np.array([0.0, 0.0, 1.0])


def grow_conifer(rng: np.random.Generator) -> tuple[Mesh, Mesh]:
    """Returns the wood and the needles of a spruce 12 m high."""
    lean = rng.uniform(-0.15, 0.15, 2)
    z = np.array([-0.5, 0.1, 0.35 * _HEIGHT, 0.7 * _HEIGHT, 0.96 * _HEIGHT])
    stem = np.column_stack([np.outer(np.clip(z / _HEIGHT, 0, 1) ** 2, lean), z])
    wood = [tube(stem, (0.24, 0.2, 0.14, 0.08, 0.02), 7)]
    base, direction, normal, length, width = [], [], [], [], []
    for k in range(_WHORLS):
        t = k / (_WHORLS - 1)
        level = _LOWEST_WHORL + t * (0.93 * _HEIGHT - _LOWEST_WHORL)
        reach = _REACH * (1 - t) ** 0.85 + 0.25
        count = round(8 - 3 * t)
        turn = rng.uniform(0, 2 * np.pi)
        for m in range(count):
            angle = turn + 2 * np.pi * (m + rng.uniform(-0.3, 0.3)) / count
            out = np.array([np.cos(angle), np.sin(angle), 0.0])
            reach_m = reach * rng.uniform(0.75, 1.15)
            height = level + rng.uniform(-0.2, 0.2)
            root = np.append(lean * (level / _HEIGHT) ** 2, height)
            # Old branches hang, young ones at the top rise.
            sag = np.interp(t, [0.0, 0.6, 1.0], [-0.32, -0.12, 0.5])
            tip = root + reach_m * (out + sag * _UP)
            if reach_m > 1.0 and m % 2 == 0:
                wood.append(tube([root, tip], (0.045, 0.012), 3))
            sprays = max(1, round(reach_m / 0.55))
            for s in range(sprays):
                share = (s + rng.uniform(0.5, 0.9)) / sprays
                spot = root + share * (tip - root)
                for side in (-1.0, 0.0, 1.0):
                    across = np.array([-out[1], out[0], 0.0]) * side
                    base.append(spot - 0.12 * out)
                    direction.append(
                        out
                        + 0.9 * across
                        + (sag - 0.25 + rng.uniform(-0.3, 0.2)) * _UP
                    )
                    normal.append(_UP + 0.45 * rng.standard_normal(3))
                    length.append(rng.uniform(0.55, 0.95) * (1.1 - 0.4 * t))
                    width.append(rng.uniform(0.26, 0.46))
    for _ in range(6):
        base.append(np.append(lean, _HEIGHT - 0.75))
        direction.append(_UP + 0.2 * rng.standard_normal(3))
        normal.append(rng.standard_normal(3) + np.array([1.3, 0.2, 0.0]))
        length.append(rng.uniform(0.5, 0.75))
        width.append(0.2)
    needles = leaves(base, direction, normal, length, width)
    return merge_meshes(*wood), keep_above(needles, _CROWN_BASE)
