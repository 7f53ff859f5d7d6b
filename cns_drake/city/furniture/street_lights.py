"""Lamp posts and lanterns; arms reach along +x, over the road."""

from __future__ import annotations

from functools import partial

import numpy as np

from cns_drake.city.geometry.object_parts import (
    Builder,
    assemble,
    bar,
    block,
    post,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_STEEL = (0.42, 0.44, 0.46)
_DARK = (0.20, 0.22, 0.24)
_GREEN = (0.16, 0.26, 0.22)
_LAMP = (0.85, 0.84, 0.78)


def straight_lamp(
    rng: np.random.Generator, *, height: float | None = None, arms: int = 1
) -> Model:
    """Returns a mast with one or two straight, slightly rising arms.

    Args:
        rng: draws the height if it is not given.
        height: of the lamps [m].
        arms: 1, or 2 for a mast between two carriageways (along +-x).
    """
    drawn = float(rng.uniform(8.0, 9.5))
    height = drawn if height is None else height
    reach, rise = 1.9, 0.25
    parts = [
        post("base", 0.14, 0.9, rgb=_STEEL),
        post("mast", 0.085, height, rgb=_STEEL),
    ]
    for k, side in enumerate((1, -1)[:arms]):
        end = (side * reach, 0.0, height + rise)
        parts += [
            bar(f"arm_{k}", (0, 0, height - 0.15), end, 0.045, _STEEL),
            block(
                f"lamp_{k}",
                (0.75, 0.3, 0.12),
                (side * (reach + 0.2), 0, height + rise),
                rgb=_LAMP,
            ),
        ]
    if arms == 2:
        parts.pop(0)
    return assemble(*parts)


def curved_lamp(
    rng: np.random.Generator, *, height: float | None = None, arms: int = 1
) -> Model:
    """Returns a dark mast whose arm sweeps over in a quarter circle.

    Args:
        rng: draws the height if it is not given.
        height: of the lamps [m].
        arms: 1 or 2, along +x and -x.
    """
    drawn = float(rng.uniform(7.0, 8.5))
    height = drawn if height is None else height
    straight = height - 1.2
    parts = [
        post("base", 0.13, 1.1, rgb=_DARK),
        post("mast", 0.075, straight, rgb=_DARK),
    ]
    for k in range(arms):
        parts.append(
            Part(
                f"arm_{k}",
                MeshShape("lamp_curved_arm"),
                xyz=(0.0, 0.0, straight),
                rpy=(0.0, 0.0, k * np.pi),
                rgb=_DARK,
            )
        )
    return assemble(*parts)


def lantern(rng: np.random.Generator, *, height: float | None = None) -> Model:
    """Returns a low park lamp: a slim post with a glass lantern on top.

    Args:
        rng: draws the height if it is not given.
        height: of the top of the lantern [m].
    """
    drawn = float(rng.uniform(3.8, 4.4))
    height = drawn if height is None else height
    return assemble(
        post("base", 0.11, 0.7, rgb=_GREEN),
        post("mast", 0.05, height - 0.7, rgb=_GREEN),
        Part(
            "lantern",
            MeshShape("lamp_lantern"),
            xyz=(0.0, 0.0, height - 0.75),
            rgb=_LAMP,
        ),
    )


STREET_LIGHTS = {
    "lamp_post": Builder("pole", straight_lamp),
    "lamp_post_double": Builder("pole", partial(straight_lamp, arms=2)),
    "lamp_post_curved": Builder("pole", curved_lamp),
    "lamp_post_curved_double": Builder("pole", partial(curved_lamp, arms=2)),
    "lantern": Builder("pole", lantern),
}
