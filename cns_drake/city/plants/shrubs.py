"""Low greenery: shrubs, flower beds, planters."""

from __future__ import annotations

from functools import cache, partial
import string

import numpy as np

from cns_drake.city.geometry.lofts import lathe, loft, rectangle, tube
from cns_drake.city.geometry.mesh import Mesh, box_mesh, boxes, merge_meshes
from cns_drake.city.geometry.object_parts import (
    ROOT_DEPTH,
    Builder,
    assemble,
    triple,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part
from cns_drake.city.plants.foliage import keep_above, tufts

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
    name, mesh = _draw_shrub(rng)
    across = height**0.8 * rng.uniform(0.85, 1.2, 2)
    part = _leafy(rng, "leaves", name, (*across, height), (0.0, 0.0, 0.0))
    return assemble(part, meshes={name: mesh})


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
    parts = (
        Part("edge", MeshShape("flower_bed_edge", scale), rgb=_STONE),
        Part(
            "plants",
            MeshShape("flower_bed_plants", scale),
            rgb=colours[int(rng.integers(3))],
        ),
    )
    return assemble(
        *parts,
        meshes={
            "flower_bed_edge": _bed_edge(),
            "flower_bed_plants": _bed_plants(),
        },
    )


def round_planter(rng: np.random.Generator) -> Model:
    """Returns a round concrete pot with a shrub."""
    size = round(float(rng.uniform(0.9, 1.2)), 3)
    name, mesh = _draw_shrub(rng)
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
        meshes={"round_pot": _round_pot(), name: mesh},
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
    meshes = {"planter_box": _planter_box()}
    parts = [
        Part(
            "box",
            MeshShape("planter_box", (round(length / 2.0, 4), 1.0, 1.0)),
            rgb=(0.45, 0.38, 0.3),
        )
    ]
    for k in range(count):
        name, mesh = _draw_shrub(rng)
        meshes[name] = mesh
        x = (k + 0.5) * length / count - length / 2
        tall = float(rng.uniform(0.6, 1.0))
        parts.append(
            _leafy(rng, f"leaves_{k}", name, (0.6, 0.55, tall), (x, 0.0, 0.45))
        )
    return assemble(*parts, meshes=meshes)


def _draw_shrub(rng: np.random.Generator) -> tuple[str, Mesh]:
    variant = int(rng.integers(_SHRUB_VARIANTS))
    return f"shrub_{string.ascii_lowercase[variant]}", _shrub(variant)


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


@cache
def _shrub(variant: int) -> Mesh:
    """Returns a shrub 1 m high and about 1.1 m across."""
    rng = np.random.default_rng([7003, variant])
    n = 34
    direction = rng.standard_normal((n, 3))
    direction[:, 2] = np.abs(direction[:, 2])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    lobe = 1 + 0.2 * np.sin(
        3 * np.arctan2(direction[:, 1], direction[:, 0]) + variant
    )
    reach = lobe * np.cbrt(rng.uniform(0.25, 1.0, n))
    points = direction * reach[:, None] * (0.42, 0.42, 0.62)
    points[:, 2] += 0.18
    foliage = tufts(rng, points, direction, 4, 0.25, 0.18)
    stems = [tube([(0, 0, -0.15), p], (0.02, 0.008), 3) for p in points[::7]]
    return merge_meshes(keep_above(foliage, 0.0), *stems)


@cache
def _bed_edge() -> Mesh:
    """Returns a kerb around earth, 4 m by 1.5 m."""
    tall, z = 0.15 + ROOT_DEPTH, 0.075 - ROOT_DEPTH / 2
    pieces = boxes((4.0, 0.1, tall), (0,), (-0.7, 0.7), (z,))
    pieces += boxes((0.1, 1.3, tall), (-1.95, 1.95), (0,), (z,))
    pieces.append(box_mesh((3.8, 1.3, 0.2), (0, 0, 0.0)))
    return merge_meshes(*pieces)


@cache
def _bed_plants() -> Mesh:
    rng = np.random.default_rng([7004])
    n = 60
    points = np.column_stack(
        [rng.uniform(-1.75, 1.75, n), rng.uniform(-0.5, 0.5, n), np.zeros(n)]
    )
    points[:, 2] = 0.12 + 0.12 * np.cos(points[:, 1] * 2.5)
    up = np.tile((0.0, 0.0, 1.0), (n, 1))
    return keep_above(tufts(rng, points, up, 4, 0.22, 0.12, 0.9), 0.1)


@cache
def _round_pot() -> Mesh:
    return lathe(
        [
            (0.38, -0.02),
            (0.55, 0.5),
            (0.6, 0.52),
            (0.6, 0.6),
            (0.48, 0.6),
            (0.47, 0.52),
        ],
        12,
    )


@cache
def _planter_box() -> Mesh:
    """Returns a tapered box, 2 m by 0.7 m, with slats."""
    body = loft(
        [
            rectangle(x, y, z)
            for x, y, z in ((0.92, 0.28, -0.02), (0.98, 0.33, 0.5))
        ]
    )
    rim = boxes((2.0, 0.06, 0.08), (0,), (-0.32, 0.32), (0.54,))
    rim += boxes((0.06, 0.58, 0.08), (-0.97, 0.97), (0,), (0.54,))
    return merge_meshes(body, *rim)


SHRUBS = {
    "shrub": Builder("vegetation", shrub),
    "low_shrub": Builder("vegetation", partial(shrub, height=0.6)),
    "flower_bed": Builder("vegetation", flower_bed),
    "round_planter": Builder("vegetation", round_planter),
    "box_planter": Builder("vegetation", box_planter),
}
