"""Traffic signals, which face +y.

Traffic that drives towards -y has the mast on its right.
"""

import numpy as np

from worlds.shapes.dice import Dice
from worlds.shapes.models import Model, Part
from worlds.shapes.object_models import (
    Builder,
    assemble,
    bar,
    block,
    mesh_part,
    post,
)
from worlds.shapes.objects.object_data import COLOURS

# Height of the mast that carries an arm [m].
_MAST_M = 6.3
# Height of the arm's foot [m].
_ARM_FOOT_M = 6
# Height of the arm's end [m].
_ARM_END_M = 6.15


def _signal(name: str, *, lamps: int, at: tuple[float, float, float]) -> Part:
    """Returns a signal head with 2 or 3 lamps, at a place (x, y, z) [m]."""
    return mesh_part(
        name,
        f"signal_head_{lamps}",
        at=at,
        rgb=COLOURS["black"],
        material="signals",
    )


def traffic_light(
    rng: np.random.Generator, *, arm: float | None = None
) -> Model:
    """Returns traffic lights on a mast, and on an arm along +x.

    Args:
        rng: random generator.
        arm: length of the arm [m]; by default sampled from `rng`.
    """
    drawn = Dice(rng).uniform(5.0, 6.5)
    arm = drawn if arm is None else arm
    steel = COLOURS["steel"]
    return assemble(
        post("mast", radius=0.11, height=_MAST_M, rgb=steel),
        bar(
            "arm",
            start=(0, 0, _ARM_FOOT_M),
            end=(arm, 0, _ARM_END_M),
            radius=0.06,
            rgb=steel,
        ),
        _signal("signal_0", lamps=3, at=(arm - 0.3, 0.1, 5.65)),
        _signal("signal_1", lamps=3, at=(0.45 * arm, 0.1, 5.6)),
        _signal("signal_2", lamps=3, at=(0.0, 0.15, 3.0)),
    )


def traffic_light_post(rng: np.random.Generator) -> Model:
    """Returns a traffic light on a post."""
    height = Dice(rng).uniform(3.3, 3.6)
    return assemble(
        post("mast", radius=0.06, height=height, rgb=COLOURS["steel"]),
        _signal("signal", lamps=3, at=(0.0, 0.1, height - 0.5)),
    )


def pedestrian_light(rng: np.random.Generator) -> Model:
    """Returns a light for pedestrians on a post, with a button."""
    height = Dice(rng).uniform(2.7, 3.0)
    size, center = (0.12, 0.1, 0.2), (0, 0.08, 1.1)
    return assemble(
        post("mast", radius=0.05, height=height, rgb=COLOURS["steel"]),
        _signal("signal", lamps=2, at=(0.0, 0.1, height - 0.4)),
        block("button", size=size, center=center, rgb=COLOURS["button"]),
    )


TRAFFIC_SIGNALS = {
    "traffic_light": Builder("pole", traffic_light),
    "traffic_light_post": Builder("pole", traffic_light_post),
    "pedestrian_light": Builder("pole", pedestrian_light),
}
