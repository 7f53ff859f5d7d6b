"""Objects on construction sites and at roadworks."""

from collections.abc import Iterator
import functools
import math

import numpy as np

from worlds.shapes.dice import Dice
from worlds.shapes.models import Model, Part
from worlds.shapes.object_models import (
    Builder,
    assemble,
    bar,
    block,
    in_a_row,
    mesh_part,
)
from worlds.shapes.objects.object_data import CHOICES, COLOURS

# Length of a section of a crane's mast or jib [m].
_SECTION_M = 4
# Height of the mast's peak, to which the stays lead, above the cab's floor [m].
_PEAK_M = 7.5
# Height of the jib's axis above the mast's top [m].
_JIB_M = 0.6
# Height of the ends of the stays on the jib above the mast's top [m].
_STAY_END_M = 1.8
# Distance of the end of the rear stay behind the mast [m].
_REAR_STAY_M = 11.2
# Distance of the counterweight behind the mast [m].
_COUNTERWEIGHT_M = 10.4
# Distance of the front stay's end along the jib, for each section [m].
_STAY_PER_SECTION_M = 2.8
# Distance of the hook along the jib, for each section [m].
_HOOK_PER_SECTION_M = 2.4
# Height of a site cabin [m].
_CABIN_M = 2.75
# Distance between cones or pallets in a row [m].
_ROW_PITCH_M = 1.5
# Number of sections that carry the counterweight behind the mast.
_REAR_SECTIONS = 3


def site_cabin(rng: np.random.Generator, *, storeys: int = 1) -> Model:
    """Returns site offices along x, one on top of the other."""
    paint = Dice(rng).pick(CHOICES["site_cabin"])
    return assemble(
        *(
            mesh_part(
                f"cabin_{k}",
                "site_cabin",
                at=(0, 0, round(_CABIN_M * k, 3)),
                rgb=paint,
            )
            for k in range(storeys)
        )
    )


def skip(rng: np.random.Generator) -> Model:
    """Returns a skip half full of rubble."""
    dice = Dice(rng)
    at = (0, 0, dice.uniform(0.7, 0.95, digits=3))
    yaw = dice.uniform(0.0, 0.2, digits=3)
    earth = COLOURS["earth"]
    scale = (0.3, 0.2, 0.25)
    return assemble(
        mesh_part("shell", "skip_shell", rgb=COLOURS["machine"]),
        mesh_part("load", "heap", at=at, yaw=yaw, rgb=earth, scale=scale),
    )


def soil_heap(rng: np.random.Generator) -> Model:
    """Returns a heap of earth or sand, 4 to 8 m across."""
    dice = Dice(rng)
    long = dice.uniform(0.55, 1.1)
    wide = dice.uniform(0.55, 1.1)
    tall = (long + wide) / 2
    scale = (round(long, 3), round(wide, 3), round(tall, 3))
    yaw = dice.uniform(-3.0, 3.0, digits=3)
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
        at = (
            dice.uniform(-0.2, 0.2, digits=3),
            in_a_row(k, distance=_ROW_PITCH_M, count=count),
            0,
        )
        yaw = dice.uniform(-0.15, 0.15, digits=3)
        scale = (1.0, 1.0, 0.6 if k % 2 == 0 else 1.0)
        name = f"pallet_{k}"
        brick = COLOURS["brick"]
        parts.append(
            mesh_part(
                name, "brick_pallet", at=at, yaw=yaw, rgb=brick, scale=scale
            )
        )
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
    """Returns traffic cones in a loose row along x."""
    dice = Dice(rng)
    return assemble(
        *(
            mesh_part(
                f"cone_{k}",
                "traffic_cone",
                at=(
                    in_a_row(k, distance=_ROW_PITCH_M, count=count),
                    dice.uniform(-0.15, 0.15, digits=3),
                    0,
                ),
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
        yaw: heading of the jib [rad].
    """
    crane = COLOURS["crane"]
    for k in range(storeys):
        foot = (0, 0, _SECTION_M * k)
        yield mesh_part(f"mast_{k:02d}", "crane_mast", at=foot, rgb=crane)
    z = _SECTION_M * storeys + _JIB_M
    for k in range(bays + _REAR_SECTIONS):
        start = _on_jib(yaw, _SECTION_M * (k - _REAR_SECTIONS), z)
        yield mesh_part(
            f"jib_{k:02d}", "crane_jib", at=start, yaw=yaw, rgb=crane
        )


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
    yaw = dice.uniform(-math.pi, math.pi, digits=3)
    storeys = max(3, round(height / _SECTION_M))
    bays = max(3, round(reach / _SECTION_M))
    top = _SECTION_M * storeys
    mast_top, peak = (0, 0, top), (0, 0, top + _PEAK_M)
    crane, concrete = COLOURS["crane"], COLOURS["concrete"]
    along = functools.partial(_on_jib, yaw)
    stay_end = along(_STAY_PER_SECTION_M * bays, top + _STAY_END_M)
    rear_stay_end = along(-_REAR_STAY_M, top + _STAY_END_M)
    # The hook hangs a little above the middle of the mast.
    hook_at = along(_HOOK_PER_SECTION_M * bays, top - 0.45 * top)
    rope_end = along(_HOOK_PER_SECTION_M * bays, top + _JIB_M)
    return assemble(
        block("base", size=(5, 5, 1), center=(0, 0, 0.2), rgb=concrete),
        *_crane_sections(storeys, bays, yaw),
        mesh_part("cab", "crane_cab", at=mast_top, yaw=yaw, rgb=crane),
        bar("peak", start=mast_top, end=peak, radius=0.25, rgb=crane),
        bar("stay", start=peak, end=stay_end, radius=0.06),
        bar("back_stay", start=peak, end=rear_stay_end, radius=0.06),
        block(
            "counterweight",
            size=(2.2, 1.6, 2.4),
            center=along(-_COUNTERWEIGHT_M, top + 0.2),
            yaw=yaw,
            rgb=concrete,
        ),
        bar("rope", start=hook_at, end=rope_end, radius=0.04),
        block("hook", size=(0.4, 0.5, 0.9), center=hook_at, yaw=yaw, rgb=crane),
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
