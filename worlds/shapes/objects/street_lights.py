"""Street lights; their arms reach along +x, over the road, and along -x."""

from functools import partial
import math

import numpy as np

from worlds.shapes.dice import Dice
from worlds.shapes.models import Model
from worlds.shapes.object_models import (
    Builder,
    assemble,
    bar,
    block,
    mesh_part,
    post,
)
from worlds.shapes.objects.object_data import COLOURS

# Distance of the ends of straight arms from the mast [m].
_ARM_M = 1.9
# Distance of the middles of the lamps on straight arms from the mast [m].
_LAMP_M = 2.1
# Height of a curved arm, from its foot to the lamp [m].
_CURVED_ARM_M = 1.2


def lamp_post(
    rng: np.random.Generator, *, height: float | None = None, arms: int = 1
) -> Model:
    """Returns a lamp post with straight arms.

    Args:
        rng: random generator for the height.
        height: height of the mast [m]; by default sampled from `rng`.
        arms: number of arms, 1 or 2.
    """
    drawn = Dice(rng).uniform(8.0, 9.5)
    height = drawn if height is None else height
    steel = COLOURS["lamp_steel"]
    parts = []
    if arms != 2:
        parts.append(post("base", radius=0.14, height=0.9, rgb=steel))
    parts.append(post("mast", radius=0.085, height=height, rgb=steel))
    foot, lamp_z = (0, 0, height - 0.15), height + 0.25
    for k in range(arms):
        # The first arm points to +x, the second to -x.
        side = 1 - 2 * k
        arm = bar(
            f"arm_{k}",
            start=foot,
            end=(side * _ARM_M, 0, lamp_z),
            radius=0.045,
            rgb=steel,
        )
        lamp = block(
            f"lamp_{k}",
            size=(0.75, 0.3, 0.12),
            center=(side * _LAMP_M, 0, lamp_z),
            rgb=COLOURS["lamp"],
        )
        parts += [arm, lamp]
    return assemble(*parts)


def lamp_post_curved(
    rng: np.random.Generator, *, height: float | None = None, arms: int = 1
) -> Model:
    """Returns a lamp post with curved arms.

    Args:
        rng: random generator for the height.
        height: height of the lamps [m]; by default sampled from `rng`.
        arms: number of arms, 1 or 2.
    """
    drawn = Dice(rng).uniform(7.0, 8.5)
    height = drawn if height is None else height
    dark = COLOURS["dark"]
    mast = height - _CURVED_ARM_M
    at = (0, 0, mast)
    return assemble(
        post("base", radius=0.13, height=1.1, rgb=dark),
        post("mast", radius=0.075, height=mast, rgb=dark),
        *(
            mesh_part(
                f"arm_{k}", "lamp_curved_arm", at=at, yaw=k * math.pi, rgb=dark
            )
            for k in range(arms)
        ),
    )


def lantern(rng: np.random.Generator, *, height: float | None = None) -> Model:
    """Returns a low post with a lantern on top.

    Args:
        rng: random generator for the height.
        height: height of the lantern's top [m]; by default sampled from `rng`.
    """
    drawn = Dice(rng).uniform(3.8, 4.4)
    height = drawn if height is None else height
    green = COLOURS["lamp_green"]
    at = (0, 0, height - 0.75)
    return assemble(
        post("base", radius=0.11, height=0.7, rgb=green),
        post("mast", radius=0.05, height=height - 0.7, rgb=green),
        mesh_part("lantern", "lamp_lantern", at=at, rgb=COLOURS["lamp"]),
    )


STREET_LIGHTS = {
    "lamp_post": Builder("pole", lamp_post),
    "lamp_post_double": Builder("pole", partial(lamp_post, arms=2)),
    "lamp_post_curved": Builder("pole", lamp_post_curved),
    "lamp_post_curved_double": Builder(
        "pole", partial(lamp_post_curved, arms=2)
    ),
    "lantern": Builder("pole", lantern),
}
