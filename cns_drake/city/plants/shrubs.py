"""Low greenery: shrubs, flower beds, planters."""

from __future__ import annotations

from functools import partial
import string

import numpy as np

from cns_drake.city.geometry.object_parts import (
    Builder,
    assemble,
    triple,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_SHRUB_VARIANTS = 4
_STONE = (0.66, 0.64, 0.6)


def shrub(rng: np.random.Generator, *, height: float | None = None) -> Model:
    """Returns a shrub.

    Args:
        rng: draws variant, form and tint, and the height if not given.
        height: [m].
    """
    drawn = float(rng.uniform(0.8, 1.6))
    height = drawn if height is None else height
    name = _draw_shrub(rng)
    across = height**0.8 * rng.uniform(0.85, 1.2, 2)
    part = _leafy(rng, "leaves", name, (*across, height), (0.0, 0.0, 0.0))
    return assemble(part)


def flower_bed(
    rng: np.random.Generator, *, length: float = 4.0, width: float = 1.5
) -> Model:
    """Returns an edged bed along x with low plants.

    Args:
        rng: draws the plants.
        length: along x [m].
        width: along y [m].
    """
    scale = (round(length / 4.0, 4), round(width / 1.5, 4), 1.0)
    colours = ((0.6, 0.35, 0.4), (0.65, 0.58, 0.3), (0.38, 0.5, 0.28))
    return assemble(
        Part("edge", MeshShape("flower_bed_edge", scale), rgb=_STONE),
        Part(
            "plants",
            MeshShape("flower_bed_plants", scale),
            rgb=colours[int(rng.integers(3))],
        ),
    )


def round_planter(rng: np.random.Generator) -> Model:
    """Returns a round concrete pot with a shrub."""
    size = round(float(rng.uniform(0.9, 1.2)), 3)
    name = _draw_shrub(rng)
    tall = float(rng.uniform(0.7, 1.1))
    return assemble(
        Part("pot", MeshShape("round_pot", (size, size, size)), rgb=_STONE),
        _leafy(
            rng,
            "leaves",
            name,
            (0.75 * size, 0.75 * size, tall),
            (0.0, 0.0, round(0.5 * size, 3)),
        ),
    )


def box_planter(
    rng: np.random.Generator, *, length: float | None = None
) -> Model:
    """Returns a long planter box along x with a row of shrubs.

    Args:
        rng: draws the shrubs, and the length if it is not given.
        length: [m].
    """
    drawn = float(rng.uniform(1.6, 3.0))
    length = drawn if length is None else length
    count = max(1, round(length / 0.8))
    parts = [
        Part(
            "box",
            MeshShape("planter_box", (round(length / 2.0, 4), 1.0, 1.0)),
            rgb=(0.45, 0.38, 0.3),
        )
    ]
    for k in range(count):
        name = _draw_shrub(rng)
        x = (k + 0.5) * length / count - length / 2
        tall = float(rng.uniform(0.6, 1.0))
        parts.append(
            _leafy(rng, f"leaves_{k}", name, (0.6, 0.55, tall), (x, 0.0, 0.45))
        )
    return assemble(*parts)


def _draw_shrub(rng: np.random.Generator) -> str:
    variant = int(rng.integers(_SHRUB_VARIANTS))
    return f"shrub_{string.ascii_lowercase[variant]}"


def _leafy(
    rng: np.random.Generator,
    name: str,
    mesh_name: str,
    scale: tuple[float, float, float],
    xyz: tuple[float, float, float],
) -> Part:
    green = np.array((0.3, 0.44, 0.22)) * rng.uniform(0.85, 1.15, 3)
    return Part(
        name,
        MeshShape(mesh_name, triple(round(float(s), 3) for s in scale)),
        xyz=triple(xyz),
        rpy=(0.0, 0.0, round(float(rng.uniform(-np.pi, np.pi)), 3)),
        rgb=triple(green.round(3)),
    )


SHRUBS = {
    "shrub": Builder("vegetation", shrub),
    "low_shrub": Builder("vegetation", partial(shrub, height=0.6)),
    "flower_bed": Builder("vegetation", flower_bed),
    "round_planter": Builder("vegetation", round_planter),
    "box_planter": Builder("vegetation", box_planter),
}
