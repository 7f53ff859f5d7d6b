"""A tower crane of lattice sections, for the construction sites."""

from __future__ import annotations

from functools import cache

import numpy as np

from cns_drake.city.geometry.lofts import beam
from cns_drake.city.geometry.mesh import Mesh, box_mesh, merge_meshes
from cns_drake.city.geometry.object_parts import Builder, assemble, bar, block
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_YELLOW = (0.84, 0.66, 0.16)
_CONCRETE = (0.62, 0.61, 0.58)
_SECTION = 4.0
_MAST_WIDTH = 1.6


def tower_crane(
    rng: np.random.Generator,
    *,
    height: float | None = None,
    reach: float | None = None,
) -> Model:
    """Returns a tower crane whose jib points along a drawn heading.

    Args:
        rng: draws the heading and whatever is not given.
        height: of the jib, made up of whole mast sections of 4 m [m].
        reach: of the jib, made up of whole sections of 4 m [m].
    """
    drawn_height, drawn_reach = rng.uniform(36.0, 56.0), rng.uniform(28, 44)
    heading = round(float(rng.uniform(-np.pi, np.pi)), 3)
    height = drawn_height if height is None else height
    reach = drawn_reach if reach is None else reach
    storeys = max(3, round(height / _SECTION))
    bays = max(3, round(reach / _SECTION))
    top = storeys * _SECTION
    parts = [block("base", (5.0, 5.0, 1.0), (0, 0, 0.2), rgb=_CONCRETE)]
    parts += [
        Part(
            f"mast_{k:02d}",
            MeshShape("crane_mast"),
            xyz=(0.0, 0.0, k * _SECTION),
            rgb=_YELLOW,
        )
        for k in range(storeys)
    ]
    turned = (0.0, 0.0, heading)
    c, s = float(np.cos(heading)), float(np.sin(heading))

    def at(along: float, z: float) -> tuple[float, float, float]:
        return (along * c, along * s, z)

    for k in range(-3, bays):
        parts.append(
            Part(
                f"jib_{k + 3:02d}",
                MeshShape("crane_jib"),
                xyz=at(k * _SECTION, top + 0.6),
                rpy=turned,
                rgb=_YELLOW,
            )
        )
    peak = at(0.0, top + 7.5)
    trolley = 0.6 * bays * _SECTION
    hook = top - 0.45 * top
    parts += [
        Part("cab", MeshShape("crane_cab"), (0, 0, top), turned, _YELLOW),
        bar("peak", at(0, top), peak, 0.25, _YELLOW),
        bar("stay", peak, at(0.7 * bays * _SECTION, top + 1.8), 0.06),
        bar("back_stay", peak, at(-2.8 * _SECTION, top + 1.8), 0.06),
        block(
            "counterweight",
            (2.2, 1.6, 2.4),
            at(-2.6 * _SECTION, top + 0.2),
            heading,
            _CONCRETE,
        ),
        bar("rope", at(trolley, hook), at(trolley, top + 0.6), 0.04),
        block("hook", (0.4, 0.5, 0.9), at(trolley, hook), heading, _YELLOW),
    ]
    return assemble(*parts, meshes={
        "crane_mast": _mast(),
        "crane_jib": _jib(),
        "crane_cab": _cab(),
    })  # fmt: skip


@cache
def _mast() -> Mesh:
    """Returns one section of a square lattice mast."""
    h, z = _MAST_WIDTH / 2, _SECTION
    corners = [(h, h), (-h, h), (-h, -h), (h, -h)]
    pieces = [beam((x, y, 0), (x, y, z), 0.16, 0.16) for x, y in corners]
    for k, (a, b) in enumerate(
        zip(corners, corners[1:] + corners[:1], strict=True)
    ):
        pieces.append(beam((*a, 0), (*b, 0), 0.09, 0.09))
        low, high = (a, b) if k % 2 else (b, a)
        pieces.append(beam((*low, 0), (*high, z / 2), 0.08, 0.08))
        pieces.append(beam((*high, z / 2), (*low, z), 0.08, 0.08))
    return merge_meshes(*pieces)


@cache
def _jib() -> Mesh:
    """Returns one section of a three-boom lattice jib, from x = 0."""
    x, w, tall = _SECTION, 0.65, 1.3
    booms = [(-w, 0.0), (w, 0.0), (0.0, tall)]
    pieces = [beam((0, y, z), (x, y, z), 0.12, 0.12) for y, z in booms]
    for y in (-w, w):
        pieces += [
            beam((0, y, 0), (x / 2, 0, tall), 0.07, 0.07),
            beam((x / 2, 0, tall), (x, y, 0), 0.07, 0.07),
        ]
    pieces.append(beam((0, -w, 0), (x, w, 0), 0.06, 0.06))
    return merge_meshes(*pieces)


@cache
def _cab() -> Mesh:
    """Returns the slewing ring and the driver's cab."""
    return merge_meshes(
        box_mesh((2.0, 2.0, 0.6), (0, 0, 0.3)),
        box_mesh((1.8, 1.2, 1.9), (1.6, -1.2, -0.4)),
    )


CRANES = {"tower_crane": Builder("other-structure", tower_crane)}
