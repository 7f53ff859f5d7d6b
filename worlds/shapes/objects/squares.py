"""Objects in squares, parks and yards: monuments, shelters, stalls."""

import math

import numpy as np

from worlds.shapes.dice import Dice
from worlds.shapes.models import Model
from worlds.shapes.object_models import (
    Builder,
    assemble,
    block,
    in_a_row,
    mesh_part,
    post,
)
from worlds.shapes.objects.object_data import CHOICES, COLOURS


def statue(rng: np.random.Generator) -> Model:
    """Returns a bronze figure, arm raised, on a stepped pedestal."""
    dice = Dice(rng)
    size = dice.uniform(0.9, 1.2, digits=3)
    yaw = dice.uniform(-0.4, 0.4, digits=3)
    marble, bronze = COLOURS["marble"], COLOURS["bronze"]
    scale, top = (size, size, size), (0, 0, round(2.9 * size, 3))
    return assemble(
        mesh_part("pedestal", "statue_pedestal", rgb=marble, scale=scale),
        mesh_part(
            "figure", "statue_figure", at=top, yaw=yaw, rgb=bronze, scale=scale
        ),
    )


def obelisk(rng: np.random.Generator, *, height: float | None = None) -> Model:
    """Returns a stepped obelisk.

    Args:
        rng: random generator for the height.
        height: height of the tip [m]; by default sampled from `rng`.
    """
    drawn = Dice(rng).uniform(9.0, 14.0)
    tall = round((drawn if height is None else height) / 10, 3)
    wide = round(tall**0.5, 3)
    scale = (wide, wide, tall)
    marble = COLOURS["marble"]
    return assemble(mesh_part("body", "obelisk", rgb=marble, scale=scale))


def fountain(rng: np.random.Generator, *, radius: float | None = None) -> Model:
    """Returns a round fountain.

    Args:
        rng: random generator for the radius.
        radius: radius of the basin [m]; by default sampled from `rng`.
    """
    drawn = Dice(rng).uniform(2.5, 3.6)
    wide = round((drawn if radius is None else radius) / 3, 3)
    scale = (wide, wide, round(wide**0.5, 3))
    marble, water = COLOURS["marble"], COLOURS["water"]
    return assemble(
        mesh_part("stone", "fountain_stone", rgb=marble, scale=scale),
        mesh_part(
            "water", "fountain_water", rgb=water, scale=scale, material="basin"
        ),
    )


def flag_poles(
    rng: np.random.Generator, *, count: int = 3, spacing: float = 2.5
) -> Model:
    """Returns poles in a row along y, with waving flags.

    Args:
        rng: random generator for height, wind and colours.
        count: number of poles.
        spacing: distance from one pole to the next [m].
    """
    dice = Dice(rng)
    height = dice.uniform(7.5, 9.5)
    wind = dice.uniform(-math.pi, math.pi)
    parts = []
    for k in range(count):
        y = in_a_row(k, distance=spacing, count=count)
        parts.append(
            post(
                f"pole_{k}",
                radius=0.05,
                height=height,
                xy=(0, y),
                rgb=COLOURS["white"],
            )
        )
        yaw = round(wind + dice.uniform(-0.15, 0.15), 3)
        rgb = dice.tinted((1.0, 1.0, 1.0), 0.15, 0.85)
        at = (0, y, height - 0.1)
        parts.append(mesh_part(f"flag_{k}", "flag", at=at, yaw=yaw, rgb=rgb))
    return assemble(*parts)


def garage(rng: np.random.Generator) -> Model:
    """Returns a garage for one car, with its door at -y."""
    dice = Dice(rng)
    walls = dice.pick(CHOICES["garage_walls"])
    door = dice.pick(CHOICES["garage_door"])
    tall = dice.uniform(2.3, 2.8, digits=3)
    # The walls begin 0.3 m below the ground.
    return assemble(
        block(
            "walls",
            size=(3, 5.8, tall + 0.3),
            center=(0, 0, tall / 2 - 0.15),
            rgb=walls,
        ),
        block(
            "roof",
            size=(3.2, 6.1, 0.16),
            center=(0, 0, tall + 0.08),
            rgb=COLOURS["concrete"],
        ),
        block("door", size=(2.4, 0.06, 2.1), center=(0, -2.92, 1.05), rgb=door),
    )


def bus_shelter(rng: np.random.Generator) -> Model:
    """Returns a bus shelter and the post of the bus stop beside it.

    The shelter is 4 m by 1.5 m, and open towards +x.
    """
    # Which end has the advertisement: 1 for +y. The mirror image has meshes of
    # its own: a mirrored mesh would be inside out.
    advert = Dice(rng).pick((1, -1))
    mesh = f"shelter_{'left' if advert > 0 else 'right'}"
    return assemble(
        mesh_part("frame", f"{mesh}_frame", rgb=COLOURS["dark"]),
        mesh_part(
            "panes", f"{mesh}_panes", rgb=COLOURS["pane"], material="glass"
        ),
        post(
            "stop",
            radius=0.03,
            height=2.9,
            xy=(0.9, -2.6 * advert),
            rgb=COLOURS["steel"],
        ),
    )


def cafe_table(rng: np.random.Generator) -> Model:
    """Returns a table with four chairs under an umbrella."""
    dice = Dice(rng)
    height = dice.uniform(2.5, 2.75)
    yaw = dice.uniform(-math.pi, math.pi, digits=3)
    rgb = dice.pick(CHOICES["cafe_umbrella"])
    top = (0, 0, height)
    return assemble(
        mesh_part("table", "cafe_set", yaw=yaw, rgb=COLOURS["cafe_table"]),
        post("pole", radius=0.025, height=height, rgb=COLOURS["steel"]),
        mesh_part("umbrella", "cafe_umbrella", at=top, yaw=yaw / 3, rgb=rgb),
    )


def market_stall(rng: np.random.Generator) -> Model:
    """Returns a market stall under an awning."""
    dice = Dice(rng)
    scale = (1.0, dice.uniform(0.9, 1.2, digits=3), 1.0)
    stall = COLOURS["stall"]
    awning = dice.pick(CHOICES["market_awning"])
    return assemble(
        mesh_part("stall", "market_stall", rgb=stall, scale=scale),
        mesh_part("awning", "market_awning", rgb=awning, scale=scale),
    )


def basketball_hoop(rng: np.random.Generator) -> Model:
    """Returns a basketball hoop on a post; its board faces +x."""
    height = Dice(rng).uniform(3.4, 3.7)
    grey = COLOURS["grey"]
    red = CHOICES["play"][0]
    board = (0.05, 1.8, 1.05)
    return assemble(
        post("post", radius=0.07, height=height, rgb=grey),
        block(
            "arm", size=(0.9, 0.1, 0.1), center=(0.4, 0, height - 0.3), rgb=grey
        ),
        block("board", size=board, center=(0.85, 0, height), rgb=red),
        block("rim", size=(0.46, 0.46, 0.03), center=(1.12, 0, height - 0.4)),
    )


SQUARES = {
    "basketball_hoop": Builder("pole", basketball_hoop),
    "bus_shelter": Builder("other-structure", bus_shelter),
    "cafe_table": Builder("other-object", cafe_table),
    "flag_poles": Builder("pole", flag_poles),
    "fountain": Builder("other-structure", fountain),
    "garage": Builder("other-structure", garage),
    "market_stall": Builder("other-structure", market_stall),
    "obelisk": Builder("other-structure", obelisk),
    "statue": Builder("other-structure", statue),
}
