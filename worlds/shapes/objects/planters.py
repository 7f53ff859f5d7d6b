"""Shrubs, flower beds and planters."""

from functools import partial
import math

import numpy as np

from worlds.shapes.dice import Dice, Rgb
from worlds.shapes.models import Model
from worlds.shapes.object_models import Builder, assemble, mesh_part
from worlds.shapes.objects.object_data import CHOICES, COLOURS

# There are four meshes of shrubs.
_LETTERS = "abcd"
# Size of the mesh of a flower bed, along x and y [m].
_BED_MESH_M = (4, 1.5)
# Length of the mesh of a planter [m].
_BOX_MESH_M = 2
# Length of a planter for each shrub in it, approximately [m].
_SHRUB_PITCH_M = 0.8
# Tall shrubs are also wider, but less than in proportion: the width grows with
# this power of the height.
_WIDTH_POWER = 0.8


def _leaves(dice: Dice) -> Rgb:
    """Returns a random green of leaves."""
    return dice.tinted(COLOURS["grass"], 0.85, 1.15)


def shrub(rng: np.random.Generator, *, height: float | None = None) -> Model:
    """Returns a shrub.

    Args:
        rng: random generator.
        height: height of the shrub [m]; by default sampled from `rng`.
    """
    dice = Dice(rng)
    drawn = dice.uniform(0.8, 1.6)
    height = drawn if height is None else height
    mesh = f"shrub_{dice.pick(_LETTERS)}"
    wide = math.pow(height, _WIDTH_POWER) * dice.uniform(0.85, 1.2)
    deep = math.pow(height, _WIDTH_POWER) * dice.uniform(0.85, 1.2)
    scale = (round(wide, 3), round(deep, 3), round(height, 3))
    rgb = _leaves(dice)
    yaw = dice.uniform(-math.pi, math.pi, digits=3)
    return assemble(mesh_part("leaves", mesh, yaw=yaw, rgb=rgb, scale=scale))


def flower_bed(
    rng: np.random.Generator, *, length: float = 4.0, width: float = 1.5
) -> Model:
    """Returns a bed of flowers with an edge of stone.

    Args:
        rng: random generator for the colour of the flowers.
        length: length along x [m].
        width: length along y [m].
    """
    mesh_length, mesh_width = _BED_MESH_M
    scale = (round(length / mesh_length, 4), round(width / mesh_width, 4), 1.0)
    stone = COLOURS["stone"]
    rgb = Dice(rng).pick(CHOICES["flowers"])
    return assemble(
        mesh_part(
            "edge", "flower_bed_edge", rgb=stone, scale=scale, material="pot"
        ),
        mesh_part("plants", "flower_bed_plants", rgb=rgb, scale=scale),
    )


def round_planter(rng: np.random.Generator) -> Model:
    """Returns a shrub in a round pot."""
    dice = Dice(rng)
    size = dice.uniform(0.9, 1.2, digits=3)
    mesh = f"shrub_{dice.pick(_LETTERS)}"
    tall = dice.uniform(0.7, 1.1, digits=3)
    rgb = _leaves(dice)
    yaw = dice.uniform(-math.pi, math.pi, digits=3)
    pot = (size, size, size)
    wide = round(0.75 * size, 3)
    stone = COLOURS["stone"]
    at, scale = (0, 0, round(0.5 * size, 3)), (wide, wide, tall)
    return assemble(
        mesh_part("pot", "round_pot", rgb=stone, scale=pot, material="pot"),
        mesh_part("leaves", mesh, at=at, yaw=yaw, rgb=rgb, scale=scale),
    )


def box_planter(
    rng: np.random.Generator, *, length: float | None = None
) -> Model:
    """Returns shrubs in a row along x, in a box.

    Args:
        rng: random generator.
        length: length of the box [m]; by default sampled from `rng`.
    """
    dice = Dice(rng)
    drawn = dice.uniform(1.6, 3.0)
    length = drawn if length is None else length
    scale = (round(length / _BOX_MESH_M, 4), 1.0, 1.0)
    rgb = COLOURS["planter"]
    box = mesh_part("box", "planter_box", rgb=rgb, scale=scale, material="pot")
    parts = [box]
    count = max(1, round(length / _SHRUB_PITCH_M))
    for k in range(count):
        mesh = f"shrub_{dice.pick(_LETTERS)}"
        size = (0.6, 0.55, dice.uniform(0.6, 1.0, digits=3))
        rgb = _leaves(dice)
        at = ((k + 0.5) * length / count - length / 2, 0, 0.45)
        yaw = dice.uniform(-math.pi, math.pi, digits=3)
        parts.append(
            mesh_part(f"leaves_{k}", mesh, at=at, yaw=yaw, rgb=rgb, scale=size)
        )
    return assemble(*parts)


PLANTERS = {
    "box_planter": Builder("vegetation", box_planter),
    "flower_bed": Builder("vegetation", flower_bed),
    "low_shrub": Builder("vegetation", partial(shrub, height=0.6)),
    "round_planter": Builder("vegetation", round_planter),
    "shrub": Builder("vegetation", shrub),
}
