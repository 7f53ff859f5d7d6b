"""Objects on a sidewalk; the front of each faces +x."""

import math

import numpy as np

from worlds.shapes.dice import Dice, Rgb
from worlds.shapes.models import MeshShape, Model, Part, SphereShape
from worlds.shapes.object_models import (
    Builder,
    assemble,
    block,
    in_a_row,
    mesh_part,
    pillar,
    post,
)
from worlds.shapes.objects.object_data import CHOICES, COLOURS

_PLAIN: Rgb = (1.0, 1.0, 1.0)


def stone_bench(rng: np.random.Generator) -> Model:
    """Returns a slab of stone on two feet, along y."""
    length = Dice(rng).uniform(1.6, 2.4)
    stone = COLOURS["stone"]
    feet = (
        pillar(f"foot_{k}", x=0.4, y=0.35, height=0.4, xy=(0.0, y), rgb=stone)
        for k, y in enumerate((-0.35 * length, 0.35 * length))
    )
    seat = block(
        "seat", size=(0.5, length, 0.12), center=(0, 0, 0.46), rgb=stone
    )
    return assemble(*feet, seat)


def recycling_bins(rng: np.random.Generator) -> Model:
    """Returns two to four containers in a row along y."""
    dice = Dice(rng)
    count = dice.whole(2, 5)
    return assemble(
        *(
            mesh_part(
                f"container_{k}",
                "rubbish_container",
                at=(0, in_a_row(k, distance=1.5, count=count), 0),
                yaw=dice.uniform(-0.08, 0.08, digits=3),
                rgb=dice.pick(CHOICES["recycling_bin"]),
            )
            for k in range(count)
        )
    )


def bollard(rng: np.random.Generator) -> Model:
    """Returns a bollard with a round head."""
    height = Dice(rng).uniform(0.8, 0.95)
    dark = COLOURS["dark"]
    head = Part("head", SphereShape(0.08), (0.0, 0.0, height), rgb=dark)
    return assemble(post("shaft", radius=0.06, height=height, rgb=dark), head)


def _bicycle_rgb(dice: Dice) -> Rgb:
    return dice.tinted(_PLAIN, 0.15, 0.6)


def bicycle(rng: np.random.Generator) -> Model:
    """Returns a parked bicycle along x."""
    rgb = _bicycle_rgb(Dice(rng))
    return assemble(mesh_part("body", "bicycle", rgb=rgb))


def bicycle_rack(rng: np.random.Generator) -> Model:
    """Returns four to seven hoops in a row along y; bicycles lean on some."""
    dice = Dice(rng)
    hoops = dice.whole(4, 8)
    parts = []
    for k in range(hoops):
        y = in_a_row(k, distance=0.8, count=hoops)
        hoop = mesh_part(
            f"hoop_{k}", "rack_hoop", at=(0, y, 0), rgb=COLOURS["steel"]
        )
        parts.append(hoop)
        if dice.chance(0.55):
            lean = dice.uniform(-0.08, 0.08, digits=3)
            x = dice.uniform(-0.1, 0.1)
            # Half of the bicycles point backwards.
            yaw = math.pi * dice.whole(0, 2)
            parts.append(
                Part(
                    f"bicycle_{k}",
                    MeshShape("bicycle"),
                    (x, y + 0.17, 0.0),
                    (lean, 0.0, yaw),
                    _bicycle_rgb(dice),
                )
            )
    return assemble(*parts)


def parking_meter(rng: np.random.Generator) -> Model:
    """Returns a parking meter on a post."""
    height = Dice(rng).uniform(1.15, 1.3)
    size, center = (0.16, 0.22, 0.36), (0, 0, height + 0.1)
    return assemble(
        post("post", radius=0.035, height=height, rgb=COLOURS["steel"]),
        block("head", size=size, center=center, rgb=COLOURS["dark"]),
    )


def ticket_machine(rng: np.random.Generator) -> Model:
    """Returns a ticket machine under a small roof, turned a little."""
    yaw = Dice(rng).uniform(-0.1, 0.1)
    rgb = COLOURS["ticket_machine"]
    size = (0.5, 0.46, 0.06)
    return assemble(
        pillar("case", x=0.28, y=0.36, height=1.5, yaw=yaw, rgb=rgb),
        block(
            "roof",
            size=size,
            center=(0.05, 0, 1.56),
            yaw=yaw,
            rgb=COLOURS["dark"],
        ),
    )


def newspaper_boxes(rng: np.random.Generator) -> Model:
    """Returns two to four newspaper boxes in a row along y."""
    dice = Dice(rng)
    count = dice.whole(2, 5)
    return assemble(
        *(
            mesh_part(
                f"box_{k}",
                "newspaper_box",
                at=(0, in_a_row(k, distance=0.55, count=count), 0),
                rgb=dice.pick(CHOICES["newspaper_box"]),
            )
            for k in range(count)
        )
    )


STREET_FURNITURE = {
    "bicycle": Builder("bicycle", bicycle),
    "bicycle_rack": Builder("bicycle", bicycle_rack),
    "bollard": Builder("pole", bollard),
    "newspaper_boxes": Builder("other-object", newspaper_boxes),
    "parking_meter": Builder("pole", parking_meter),
    "recycling_bins": Builder("other-object", recycling_bins),
    "stone_bench": Builder("other-object", stone_bench),
    "ticket_machine": Builder("other-object", ticket_machine),
}
