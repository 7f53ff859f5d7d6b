"""A tower crane of lattice sections, for the construction sites."""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.object_parts import Builder, assemble, bar, block
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_YELLOW = (0.84, 0.66, 0.16)
_CONCRETE = (0.62, 0.61, 0.58)
_SECTION = 4.0


def tower_crane(
    rng: np.random.Generator,
    *,
    height: float | None = None,
    reach: float | None = None,
) -> Model:
    """Returns a tower crane whose jib points along a drawn heading.

    Args:
        rng: draws the heading and each value that is not given.
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
    return assemble(*parts)


CRANES = {"tower_crane": Builder("other-structure", tower_crane)}
