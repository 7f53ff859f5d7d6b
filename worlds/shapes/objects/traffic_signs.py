"""Traffic signs, which face +x."""

import math

import numpy as np

from worlds.shapes.dice import Dice
from worlds.shapes.models import CylinderShape, Model, Part
from worlds.shapes.object_models import (
    Builder,
    assemble,
    block,
    mesh_part,
    post,
)
from worlds.shapes.objects.object_data import CHOICES, COLOURS

# Radius of a round sign [m].
_ROUND_RADIUS_M = 0.32
# Height of the masts of a sign with directions [m].
_DIRECTION_MAST_M = 4.6


def _sign_mast(height: float) -> Part:
    """Returns the mast of a small sign; `height` is its height [m]."""
    return post("mast", radius=0.035, height=height, rgb=COLOURS["steel"])


def sign_round(rng: np.random.Generator) -> Model:
    """Returns a round sign, red or blue."""
    dice = Dice(rng)
    height = dice.uniform(2.5, 2.9)
    rgb = dice.pick(CHOICES["sign_round"])
    plate = Part(
        "plate",
        CylinderShape(radius=_ROUND_RADIUS_M, length=0.03),
        xyz=(0.05, 0.0, height - _ROUND_RADIUS_M),
        rpy=(0.0, math.pi / 2, 0.0),
        rgb=rgb,
        material="way_sign" if rgb == COLOURS["blue"] else "stop_sign",
    )
    return assemble(_sign_mast(height), plate)


def sign_triangular(rng: np.random.Generator) -> Model:
    """Returns a warning sign."""
    height = Dice(rng).uniform(2.6, 3.0)
    at = (0.05, 0, height - 0.45)
    rgb = COLOURS["sign_red"]
    plate = mesh_part(
        "plate", "sign_triangle", at=at, rgb=rgb, material="yield_sign"
    )
    return assemble(_sign_mast(height), plate)


def sign_stop(rng: np.random.Generator) -> Model:
    """Returns a stop sign."""
    height = Dice(rng).uniform(2.5, 2.9)
    at = (0.05, 0, height - 0.4)
    rgb = COLOURS["sign_red"]
    plate = mesh_part(
        "plate", "sign_octagon", at=at, rgb=rgb, material="stop_sign"
    )
    return assemble(_sign_mast(height), plate)


def sign_rectangular(rng: np.random.Generator) -> Model:
    """Returns a rectangular sign, blue or white."""
    dice = Dice(rng)
    height = dice.uniform(2.6, 3.0)
    width = dice.uniform(0.45, 0.65)
    tall = dice.uniform(0.6, 0.9)
    rgb = dice.pick(CHOICES["sign_rectangular"])
    size, center = (0.03, width, tall), (0.05, 0, height - 0.5 * tall)
    material = "way_sign" if rgb == COLOURS["blue"] else "plain_sign"
    plate = block("plate", size=size, center=center, rgb=rgb, material=material)
    return assemble(_sign_mast(height), plate)


def sign_street_name(rng: np.random.Generator) -> Model:
    """Returns the names of two streets on a post, along x and along y."""
    height = Dice(rng).uniform(3.0, 3.3)
    blue = COLOURS["blue"]
    return assemble(
        post("mast", radius=0.03, height=height, rgb=COLOURS["steel"]),
        block(
            "blade_x",
            size=(1.1, 0.03, 0.22),
            center=(0.4, 0, height - 0.12),
            rgb=blue,
            material="name_sign",
        ),
        block(
            "blade_y",
            size=(0.03, 1, 0.22),
            center=(0, 0.35, height - 0.36),
            rgb=blue,
            material="name_sign",
        ),
    )


def sign_direction(rng: np.random.Generator) -> Model:
    """Returns a large sign with directions on two masts."""
    width = Dice(rng).uniform(2.4, 3.4)
    steel = COLOURS["steel"]
    masts = (
        post(
            f"mast_{k}",
            radius=0.06,
            height=_DIRECTION_MAST_M,
            xy=(0, side * width),
            rgb=steel,
        )
        for k, side in enumerate((0.35, -0.35))
    )
    plate = block(
        "plate",
        size=(0.05, width, 1.7),
        center=(0.09, 0, 3.75),
        rgb=COLOURS["blue"],
        material="way_sign",
    )
    return assemble(*masts, plate)


TRAFFIC_SIGNS = {
    "sign_round": Builder("traffic-sign", sign_round),
    "sign_triangular": Builder("traffic-sign", sign_triangular),
    "sign_stop": Builder("traffic-sign", sign_stop),
    "sign_rectangular": Builder("traffic-sign", sign_rectangular),
    "sign_street_name": Builder("traffic-sign", sign_street_name),
    "sign_direction": Builder("traffic-sign", sign_direction),
}
