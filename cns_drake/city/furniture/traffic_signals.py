"""Traffic signals, which face +y.

Traffic that drives towards -y has the mast on its right.
"""

import numpy as np

from cns_drake.city.dice import Dice
from cns_drake.city.furniture.object_data import COLOURS
from cns_drake.city.geometry import (
    Builder,
    Model,
    Part,
    assemble,
    bar,
    block,
    mesh_part,
    post,
)


def _signal(name: str, lamps: int, x: float, y: float, z: float) -> Part:
    mesh = f"signal_head_{lamps}"
    at = (x, y, z)
    return mesh_part(name, mesh, at, rgb=COLOURS["black"], material="signals")


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
        post("mast", 0.11, 6.3, rgb=steel),
        bar("arm", (0, 0, 6), (arm, 0, 6.15), 0.06, steel),
        _signal("signal_0", 3, arm - 0.3, 0.1, 5.65),
        _signal("signal_1", 3, 0.45 * arm, 0.1, 5.6),
        _signal("signal_2", 3, 0.0, 0.15, 3.0),
    )


def traffic_light_post(rng: np.random.Generator) -> Model:
    """Returns a traffic light on a post."""
    height = Dice(rng).uniform(3.3, 3.6)
    return assemble(
        post("mast", 0.06, height, rgb=COLOURS["steel"]),
        _signal("signal", 3, 0.0, 0.1, height - 0.5),
    )


def pedestrian_light(rng: np.random.Generator) -> Model:
    """Returns a light for pedestrians on a post, with a button."""
    height = Dice(rng).uniform(2.7, 3.0)
    size, center = (0.12, 0.1, 0.2), (0, 0.08, 1.1)
    return assemble(
        post("mast", 0.05, height, rgb=COLOURS["steel"]),
        _signal("signal", 2, 0.0, 0.1, height - 0.4),
        block("button", size, center, rgb=COLOURS["button"]),
    )


TRAFFIC_SIGNALS = {
    "traffic_light": Builder("pole", traffic_light),
    "traffic_light_post": Builder("pole", traffic_light_post),
    "pedestrian_light": Builder("pole", pedestrian_light),
}
