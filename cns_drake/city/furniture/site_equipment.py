"""Objects on construction sites and at roadworks."""

from collections.abc import Iterator
import functools
import math

import numpy as np

from cns_drake.city.dice import Dice
from cns_drake.city.furniture.object_data import CHOICES, COLOURS
from cns_drake.city.geometry import (
    Builder,
    Model,
    Part,
    assemble,
    bar,
    block,
    in_a_row,
    mesh_part,
)

# Length of a section of a crane's mast or jib [m].
_SECTION_M = 4
# Number of sections that carry the counterweight behind the mast.
_REAR_SECTIONS = 3


def site_cabin(rng: np.random.Generator, *, storeys: int = 1) -> Model:
    """Returns site offices along x, one on top of the other.

    Args:
        rng: random generator for the colour.
        storeys: number of cabins.
    """
    paint = Dice(rng).pick(CHOICES["site_cabin"])
    return assemble(
        *(
            mesh_part(
                f"cabin_{k}",
                "site_cabin",
                (0, 0, round(2.75 * k, 3)),
                rgb=paint,
            )
            for k in range(storeys)
        )
    )


def skip(rng: np.random.Generator) -> Model:
    """Returns a skip half full of rubble."""
    dice = Dice(rng)
    at = (0, 0, dice.uniform(0.7, 0.95, 3))
    yaw = dice.uniform(0.0, 0.2, 3)
    earth = COLOURS["earth"]
    scale = (0.3, 0.2, 0.25)
    return assemble(
        mesh_part("shell", "skip_shell", rgb=COLOURS["machine"]),
        mesh_part("load", "heap", at, yaw, earth, scale),
    )


def soil_heap(rng: np.random.Generator) -> Model:
    """Returns a heap of earth or sand, 4 to 8 m across."""
    dice = Dice(rng)
    a = dice.uniform(0.55, 1.1)
    b = dice.uniform(0.55, 1.1)
    scale = (round(a, 3), round(b, 3), round((a + b) / 2, 3))
    yaw = dice.uniform(-3.0, 3.0, 3)
    rgb = dice.pick(CHOICES["heap"])
    return assemble(mesh_part("heap", "heap", yaw=yaw, rgb=rgb, scale=scale))


def brick_pallets(rng: np.random.Generator) -> Model:
    """Returns two to five pallets of bricks in a loose row along y.

    Every other pallet is half empty.
    """
    dice = Dice(rng)
    count = dice.whole(2, 6)
    parts = []
    for k in range(count):
        at = (dice.uniform(-0.2, 0.2, 3), in_a_row(k, 1.5, count), 0)
        yaw = dice.uniform(-0.15, 0.15, 3)
        scale = (1.0, 1.0, 0.6 if k % 2 == 0 else 1.0)
        name = f"pallet_{k}"
        brick = COLOURS["brick"]
        parts.append(mesh_part(name, "brick_pallet", at, yaw, brick, scale))
    return assemble(*parts)


def excavator(rng: np.random.Generator) -> Model:
    """Returns an excavator whose arm is stretched out, roughly along +x."""
    yaw = Dice(rng).uniform(-0.6, 0.6, 3)
    rgb = COLOURS["machine"]
    return assemble(
        mesh_part("tracks", "excavator_tracks", rgb=COLOURS["rubber"]),
        mesh_part("upper", "excavator_upper", yaw=yaw, rgb=rgb),
    )


def traffic_cones(rng: np.random.Generator, *, count: int = 5) -> Model:
    """Returns traffic cones in a loose row along x.

    Args:
        rng: random generator for their places.
        count: number of cones.
    """
    dice = Dice(rng)
    return assemble(
        *(
            mesh_part(
                f"cone_{k}",
                "traffic_cone",
                (in_a_row(k, 1.5, count), dice.uniform(-0.15, 0.15, 3), 0),
                rgb=COLOURS["cone"],
            )
            for k in range(count)
        )
    )


def _on_jib(
    yaw: float, distance: float, z: float
) -> tuple[float, float, float]:
    """Returns a point at a height z, at a distance along a crane's jib [m]."""
    return (distance * math.cos(yaw), distance * math.sin(yaw), z)


def _crane_sections(storeys: int, bays: int, yaw: float) -> Iterator[Part]:
    """Yields the sections of a crane's mast and jib.

    Args:
        storeys: number of sections of the mast.
        bays: number of sections of the jib in front of the mast.
        yaw: heading of the jib [rad].
    """
    crane = COLOURS["crane"]
    for k in range(storeys):
        foot = (0, 0, _SECTION_M * k)
        yield mesh_part(f"mast_{k:02d}", "crane_mast", foot, rgb=crane)
    z = _SECTION_M * storeys + 0.6
    for k in range(bays + _REAR_SECTIONS):
        start = _on_jib(yaw, _SECTION_M * (k - _REAR_SECTIONS), z)
        yield mesh_part(f"jib_{k:02d}", "crane_jib", start, yaw, crane)


def tower_crane(
    rng: np.random.Generator,
    *,
    height: float | None = None,
    reach: float | None = None,
) -> Model:
    """Returns a tower crane, whose mast and jib consist of whole sections.

    Args:
        rng: random generator for sizes and heading.
        height: height of the mast [m]; by default sampled from `rng`.
        reach: length of the jib in front of the mast [m]; by default sampled
            from `rng`.
    """
    dice = Dice(rng)
    drawn_height = dice.uniform(36.0, 56.0)
    drawn_reach = dice.uniform(28.0, 44.0)
    height = drawn_height if height is None else height
    reach = drawn_reach if reach is None else reach
    yaw = dice.uniform(-math.pi, math.pi, 3)
    storeys = max(3, round(height / _SECTION_M))
    bays = max(3, round(reach / _SECTION_M))
    top = _SECTION_M * storeys
    peak = (0, 0, top + 7.5)
    hook = top - 0.45 * top
    crane, concrete = COLOURS["crane"], COLOURS["concrete"]
    along = functools.partial(_on_jib, yaw)
    return assemble(
        block("base", (5, 5, 1), (0, 0, 0.2), rgb=concrete),
        *_crane_sections(storeys, bays, yaw),
        mesh_part("cab", "crane_cab", (0, 0, top), yaw, crane),
        bar("peak", (0, 0, top), peak, 0.25, crane),
        bar("stay", peak, along(2.8 * bays, top + 1.8), 0.06),
        bar("back_stay", peak, along(-11.2, top + 1.8), 0.06),
        block(
            "counterweight",
            (2.2, 1.6, 2.4),
            along(-10.4, top + 0.2),
            yaw,
            concrete,
        ),
        bar(
            "rope", along(2.4 * bays, hook), along(2.4 * bays, top + 0.6), 0.04
        ),
        block("hook", (0.4, 0.5, 0.9), along(2.4 * bays, hook), yaw, crane),
    )


SITE_EQUIPMENT = {
    "brick_pallets": Builder("other-object", brick_pallets),
    "excavator": Builder("other-vehicle", excavator),
    "site_cabin": Builder("other-structure", site_cabin),
    "skip": Builder("other-object", skip),
    "soil_heap": Builder("terrain", soil_heap),
    "tower_crane": Builder("other-structure", tower_crane),
    "traffic_cones": Builder("other-object", traffic_cones),
}
