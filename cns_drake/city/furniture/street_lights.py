"""Street lights; their arms reach along +x, over the road, and along -x."""

from functools import partial
import math

import numpy as np

from cns_drake.city.dice import Dice
from cns_drake.city.furniture.object_data import COLOURS
from cns_drake.city.geometry import (
    Builder,
    Model,
    assemble,
    bar,
    block,
    mesh_part,
    post,
)


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
    parts = [post("base", 0.14, 0.9, rgb=steel)] if arms != 2 else []
    parts.append(post("mast", 0.085, height, rgb=steel))
    for k in range(arms):
        side = 1 - 2 * k
        top = height + 0.25
        start, end = (0, 0, height - 0.15), (side * 1.9, 0, top)
        parts.append(bar(f"arm_{k}", start, end, 0.045, steel))
        size, center = (0.75, 0.3, 0.12), (side * 2.1, 0, top)
        parts.append(block(f"lamp_{k}", size, center, rgb=COLOURS["lamp"]))
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
    at = (0, 0, height - 1.2)
    return assemble(
        post("base", 0.13, 1.1, rgb=dark),
        post("mast", 0.075, height - 1.2, rgb=dark),
        *(
            mesh_part(f"arm_{k}", "lamp_curved_arm", at, k * math.pi, dark)
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
        post("base", 0.11, 0.7, rgb=green),
        post("mast", 0.05, height - 0.7, rgb=green),
        mesh_part("lantern", "lamp_lantern", at, rgb=COLOURS["lamp"]),
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
