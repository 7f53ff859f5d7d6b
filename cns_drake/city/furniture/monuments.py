"""Monuments for squares: statue, obelisk, fountain, flags."""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.object_parts import (
    Builder,
    assemble,
    post,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_STONE = (0.7, 0.67, 0.61)
_BRONZE = (0.28, 0.34, 0.28)
_WATER = (0.35, 0.5, 0.6)
_WHITE = (0.85, 0.85, 0.85)


def statue(rng: np.random.Generator) -> Model:
    """Returns a bronze figure, arm raised, on a stepped pedestal."""
    size = round(float(rng.uniform(0.9, 1.2)), 3)
    turn = round(float(rng.uniform(-0.4, 0.4)), 3)
    scale = (size, size, size)
    return assemble(
        Part("pedestal", MeshShape("statue_pedestal", scale), rgb=_STONE),
        Part(
            "figure",
            MeshShape("statue_figure", scale),
            xyz=(0.0, 0.0, round(2.9 * size, 3)),
            rpy=(0.0, 0.0, turn),
            rgb=_BRONZE,
        ),
    )


def obelisk(rng: np.random.Generator, *, height: float | None = None) -> Model:
    """Returns a stepped obelisk.

    Args:
        rng: draws the height if it is not given.
        height: of the tip [m].
    """
    drawn = float(rng.uniform(9.0, 14.0))
    height = drawn if height is None else height
    tall = round(height / 10.0, 3)
    wide = round(tall**0.5, 3)
    return assemble(
        Part("body", MeshShape("obelisk", (wide, wide, tall)), rgb=_STONE),
    )


def fountain(rng: np.random.Generator, *, radius: float | None = None) -> Model:
    """Returns a round fountain: basin, water, two bowls on a stem.

    Args:
        rng: draws the radius if it is not given.
        radius: of the basin [m].
    """
    drawn = float(rng.uniform(2.5, 3.6))
    radius = drawn if radius is None else radius
    wide = round(radius / 3.0, 3)
    scale = (wide, wide, round(wide**0.5, 3))
    return assemble(
        Part("stone", MeshShape("fountain_stone", scale), rgb=_STONE),
        Part("water", MeshShape("fountain_water", scale), rgb=_WATER),
    )


def flag_poles(
    rng: np.random.Generator, *, count: int = 3, spacing: float = 2.5
) -> Model:
    """Returns a row of flag poles along y, with waving flags.

    Args:
        rng: draws height, wind and colours.
        count: number of poles.
        spacing: between neighbours [m].
    """
    height = float(rng.uniform(7.5, 9.5))
    wind = float(rng.uniform(-np.pi, np.pi))
    parts = []
    for k in range(count):
        y = spacing * (k - (count - 1) / 2)
        turn = round(wind + float(rng.uniform(-0.15, 0.15)), 3)
        parts += [
            post(f"pole_{k}", 0.05, height, (0.0, y), _WHITE),
            Part(
                f"flag_{k}",
                MeshShape("flag"),
                xyz=(0.0, y, height - 0.1),
                rpy=(0.0, 0.0, turn),
                rgb=tuple(rng.uniform(0.15, 0.85, 3).round(3).tolist()),
            ),
        ]
    return assemble(*parts)


MONUMENTS = {
    "statue": Builder("other-structure", statue),
    "obelisk": Builder("other-structure", obelisk),
    "fountain": Builder("other-structure", fountain),
    "flag_poles": Builder("pole", flag_poles),
}
