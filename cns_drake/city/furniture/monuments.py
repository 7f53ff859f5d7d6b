"""What stands in the middle of a square: statue, obelisk, fountain, flags."""

from __future__ import annotations

from functools import cache

import numpy as np

from cns_drake.city.geometry.lofts import beam, lathe, loft, rectangle, tube
from cns_drake.city.geometry.mesh import Mesh, box_mesh, merge_meshes
from cns_drake.city.geometry.object_parts import (
    ROOT_DEPTH,
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
    parts = (
        Part("pedestal", MeshShape("statue_pedestal", scale), rgb=_STONE),
        Part(
            "figure",
            MeshShape("statue_figure", scale),
            xyz=(0.0, 0.0, round(2.9 * size, 3)),
            rpy=(0.0, 0.0, turn),
            rgb=_BRONZE,
        ),
    )
    return assemble(
        *parts,
        meshes={"statue_pedestal": _pedestal(), "statue_figure": _figure()},
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
    parts = (
        Part("body", MeshShape("obelisk", (wide, wide, tall)), rgb=_STONE),
    )
    return assemble(*parts, meshes={"obelisk": _obelisk()})


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
    parts = (
        Part("stone", MeshShape("fountain_stone", scale), rgb=_STONE),
        Part("water", MeshShape("fountain_water", scale), rgb=_WATER),
    )
    stone, water = _fountain()
    return assemble(
        *parts, meshes={"fountain_stone": stone, "fountain_water": water}
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
    return assemble(*parts, meshes={"flag": _flag()})


@cache
def _pedestal() -> Mesh:
    return merge_meshes(
        box_mesh((3.4, 3.4, 0.2 + ROOT_DEPTH), (0, 0, 0.1 - ROOT_DEPTH / 2)),
        box_mesh((2.8, 2.8, 0.2), (0, 0, 0.3)),
        box_mesh((2.0, 2.0, 0.35), (0, 0, 0.575)),
        box_mesh((1.5, 1.5, 1.85), (0, 0, 1.675)),
        box_mesh((1.8, 1.8, 0.3), (0, 0, 2.75)),
        box_mesh((0.06, 0.9, 0.6), (0.77, 0, 1.7)),
    )


@cache
def _figure() -> Mesh:
    """Returns a standing figure about 2.6 m high, facing +x."""
    coat = lathe(
        [(0.36, 0.75), (0.33, 1.2), (0.3, 1.5), (0.42, 2.0), (0.3, 2.18)], 8
    )
    flat = Mesh(coat.vertices * (0.72, 1.0, 1.0), coat.faces)
    return merge_meshes(
        lathe([(0.5, 0.0), (0.46, 0.1)], 8),
        tube([(0.12, 0.17, 0.05), (0.0, 0.15, 0.85)], (0.11, 0.16), 6),
        tube([(-0.1, -0.17, 0.05), (0.0, -0.15, 0.85)], (0.11, 0.16), 6),
        flat,
        tube([(0, 0, 2.1), (0.02, 0, 2.3)], (0.12, 0.1), 6),
        lathe([(0.08, 2.24), (0.16, 2.34), (0.17, 2.48), (0.08, 2.6)], 7).moved(
            (0.03, 0, 0)
        ),
        tube([(0, 0.36, 2.05), (0.15, 0.55, 1.7)], (0.12, 0.1), 6),
        tube([(0.15, 0.55, 1.7), (0.4, 0.4, 1.55)], (0.1, 0.07), 6),
        tube([(0, -0.36, 2.05), (0.3, -0.55, 2.25)], (0.12, 0.1), 6),
        tube([(0.3, -0.55, 2.25), (0.65, -0.5, 2.6)], (0.1, 0.06), 6),
        beam((-0.28, 0, 0.4), (-0.26, 0, 2.0), 0.7, 0.06),
    )


@cache
def _obelisk() -> Mesh:
    """Returns an obelisk 10 m high."""
    return merge_meshes(
        loft([rectangle(2.2, 2.2, -ROOT_DEPTH), rectangle(2.2, 2.2, 0.25)]),
        loft([rectangle(1.7, 1.7, 0.25), rectangle(1.7, 1.7, 0.5)]),
        loft([rectangle(1.05, 1.05, 0.5), rectangle(1.0, 1.0, 2.0)]),
        loft([rectangle(1.15, 1.15, 2.0), rectangle(1.15, 1.15, 2.2)]),
        loft(
            [
                rectangle(0.7, 0.7, 2.2),
                rectangle(0.45, 0.45, 9.2),
                rectangle(0.05, 0.05, 10.0),
            ]
        ),
    )


@cache
def _fountain() -> tuple[Mesh, Mesh]:
    """Returns stone and water of a fountain, 3 m in radius."""
    basin = lathe(
        [
            (3.0, -ROOT_DEPTH),
            (3.0, 0.45),
            (3.1, 0.5),
            (3.1, 0.6),
            (2.7, 0.6),
            (2.7, 0.15),
        ],
        16,
    )
    stem = lathe(
        [
            (0.55, 0.1),
            (0.4, 0.5),
            (0.25, 0.9),
            (0.3, 1.4),
            (1.25, 1.7),
            (1.3, 1.78),
            (1.2, 1.78),
            (0.25, 1.62),
            (0.18, 2.2),
            (0.22, 2.5),
            (0.6, 2.7),
            (0.62, 2.75),
            (0.15, 2.72),
            (0.04, 3.1),
        ],
        12,
    )
    water = merge_meshes(
        lathe([(2.72, 0.3), (2.72, 0.42)], 16),
        lathe([(1.15, 1.66), (1.22, 1.74)], 12),
    )
    return merge_meshes(basin, stem), water


@cache
def _flag() -> Mesh:
    """Returns a waving cloth, 1.8 m by 1.2 m, hung along +x from z = 0."""
    x = np.linspace(0.05, 1.85, 8)
    wave = 0.14 * np.sin(4.2 * x) * x
    droop = -0.1 * x
    sections = [
        [
            (x[k], wave[k] + side * 0.008, droop[k] + z)
            for side, z in ((1, -1.2), (1, 0), (-1, 0), (-1, -1.2))
        ]
        for k in range(len(x))
    ]
    return loft(sections)


MONUMENTS = {
    "statue": Builder("other-structure", statue),
    "obelisk": Builder("other-structure", obelisk),
    "fountain": Builder("other-structure", fountain),
    "flag_poles": Builder("pole", flag_poles),
}
