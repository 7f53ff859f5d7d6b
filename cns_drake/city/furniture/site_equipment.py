"""Objects on construction sites and at roadworks."""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.object_parts import (
    Builder,
    assemble,
    one_mesh,
    triple,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_STEEL_COLOURS = (
    (0.25, 0.38, 0.52),
    (0.55, 0.24, 0.18),
    (0.42, 0.44, 0.42),
    (0.24, 0.4, 0.32),
)
_YELLOW = (0.82, 0.62, 0.14)
_ORANGE = (0.86, 0.4, 0.12)
_EARTH = (0.46, 0.38, 0.28)
_DARK = (0.2, 0.21, 0.22)
_PIPE = (0.6, 0.58, 0.54)
_TOILETS = ((0.2, 0.4, 0.55), (0.25, 0.45, 0.3))


def site_cabin(rng: np.random.Generator, *, storeys: int = 1) -> Model:
    """Returns site offices along x, one on top of the other.

    Args:
        rng: draws the colour.
        storeys: number of cabins.
    """
    colours = ((0.75, 0.75, 0.72), (0.3, 0.44, 0.58), (0.72, 0.6, 0.25))
    colour = colours[int(rng.integers(3))]
    parts = [
        Part(
            f"cabin_{k}",
            MeshShape("site_cabin"),
            xyz=(0.0, 0.0, round(2.75 * k, 3)),
            rgb=colour,
        )
        for k in range(storeys)
    ]
    return assemble(*parts)


def skip(rng: np.random.Generator) -> Model:
    """Returns a skip half full of rubble, along x."""
    return assemble(
        Part("shell", MeshShape("skip_shell"), rgb=_YELLOW),
        Part(
            "load",
            MeshShape("heap", (0.3, 0.2, 0.25)),
            xyz=(0.0, 0.0, round(float(rng.uniform(0.7, 0.95)), 3)),
            rpy=(0.0, 0.0, round(float(rng.uniform(0, 0.2)), 3)),
            rgb=_EARTH,
        ),
    )


def soil_heap(rng: np.random.Generator) -> Model:
    """Returns a heap of earth or sand, 4 to 8 m across."""
    size = rng.uniform(0.55, 1.1, 2)
    scale = triple(round(float(s), 3) for s in (*size, size.mean()))
    part = Part(
        "heap",
        MeshShape("heap", scale),
        rpy=(0.0, 0.0, round(float(rng.uniform(-3, 3)), 3)),
        rgb=(_EARTH, (0.72, 0.63, 0.46))[int(rng.integers(2))],
    )
    return assemble(part)


def brick_pallets(rng: np.random.Generator) -> Model:
    """Returns two to five pallets of bricks in a loose row along y."""
    count = int(rng.integers(2, 6))
    parts = [
        Part(
            f"pallet_{k}",
            MeshShape("brick_pallet", (1.0, 1.0, (0.6, 1.0)[k % 2])),
            xyz=(
                round(float(rng.uniform(-0.2, 0.2)), 3),
                round(1.5 * (k - (count - 1) / 2), 3),
                0.0,
            ),
            rpy=(0.0, 0.0, round(float(rng.uniform(-0.15, 0.15)), 3)),
            rgb=(0.62, 0.34, 0.26),
        )
        for k in range(count)
    ]
    return assemble(*parts)


def excavator(rng: np.random.Generator) -> Model:
    """Returns a tracked excavator, its arm stretched out along +x."""
    turn = round(float(rng.uniform(-0.6, 0.6)), 3)
    return assemble(
        Part("tracks", MeshShape("excavator_tracks"), rgb=_DARK),
        Part(
            "upper",
            MeshShape("excavator_upper"),
            rpy=(0.0, 0.0, turn),
            rgb=_YELLOW,
        ),
    )


def traffic_cones(rng: np.random.Generator, *, count: int = 5) -> Model:
    """Returns a row of traffic cones along x, 1.5 m apart.

    Args:
        rng: sets each cone a little off the line.
        count: number of cones.
    """
    parts = [
        Part(
            f"cone_{k}",
            MeshShape("traffic_cone"),
            xyz=(
                round(1.5 * (k - (count - 1) / 2), 3),
                round(float(rng.uniform(-0.15, 0.15)), 3),
                0.0,
            ),
            rgb=_ORANGE,
        )
        for k in range(count)
    ]
    return assemble(*parts)


SITE_EQUIPMENT = {
    "container": one_mesh("container", _STEEL_COLOURS, "other-structure"),
    "site_cabin": Builder("other-structure", site_cabin),
    "skip": Builder("other-object", skip),
    "soil_heap": Builder("terrain", soil_heap),
    "pipe_stack": one_mesh("pipe_stack", [_PIPE], x=(0.8, 1.3)),
    "brick_pallets": Builder("other-object", brick_pallets),
    "excavator": Builder("other-vehicle", excavator),
    "portable_toilet": one_mesh("portable_toilet", _TOILETS),
    "traffic_cones": Builder("other-object", traffic_cones),
}
