"""Traffic lights and road signs."""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.object_parts import (
    Builder,
    assemble,
    bar,
    block,
    post,
)
from cns_drake.city.geometry.structures import (
    CylinderShape,
    MeshShape,
    Model,
    Part,
    Shape,
)

_STEEL = (0.45, 0.47, 0.49)
_BLACK = (0.12, 0.13, 0.13)
_RED = (0.75, 0.15, 0.15)
_BLUE = (0.15, 0.32, 0.65)
_WHITE = (0.88, 0.88, 0.86)
_TO_X = (0.0, np.pi / 2, 0.0)


def mast_arm_light(
    rng: np.random.Generator, *, arm: float | None = None
) -> Model:
    """Returns a traffic light with a mast arm over the lanes.

    The arm reaches along +x, the signals face +y: traffic that drives
    towards -y has the mast on its right-hand side.

    Args:
        rng: draws the arm if it is not given.
        arm: length of the arm [m].
    """
    drawn = float(rng.uniform(5.0, 6.5))
    arm = drawn if arm is None else arm
    height = 6.0
    head = MeshShape("signal_head_3")
    return assemble(
        post("mast", 0.11, height + 0.3, rgb=_STEEL),
        bar("arm", (0, 0, height), (arm, 0, height + 0.15), 0.06, _STEEL),
        Part("signal_0", head, xyz=(arm - 0.3, 0.1, height - 0.35), rgb=_BLACK),
        Part("signal_1", head, xyz=(0.45 * arm, 0.1, height - 0.4), rgb=_BLACK),
        Part("signal_2", head, xyz=(0.0, 0.15, 3.0), rgb=_BLACK),
    )


def post_light(rng: np.random.Generator) -> Model:
    """Returns a traffic light on a post; the signals face +y."""
    height = float(rng.uniform(3.3, 3.6))
    return _light(post("mast", 0.06, height, rgb=_STEEL), 3, height - 0.5)


def pedestrian_light(rng: np.random.Generator) -> Model:
    """Returns a pedestrian light: two lamps and a push button, face +y."""
    height = float(rng.uniform(2.7, 3.0))
    mast = post("mast", 0.05, height, rgb=_STEEL)
    size, center = (0.12, 0.1, 0.2), (0, 0.08, 1.1)
    button = block("button", size, center, rgb=(0.8, 0.7, 0.2))
    return _light(mast, 2, height - 0.4, button)


def _light(mast: Part, lamps: int, z: float, *others: Part) -> Model:
    """Returns a head of `lamps` at a mast, its middle at height z [m]."""
    name = f"signal_head_{lamps}"
    head = Part("signal", MeshShape(name), xyz=(0.0, 0.1, z), rgb=_BLACK)
    return assemble(mast, head, *others)


def round_sign(rng: np.random.Generator) -> Model:
    """Returns a round sign that faces +x."""
    height = float(rng.uniform(2.5, 2.9))
    rgb = (_RED, _BLUE)[int(rng.integers(2))]
    return _sign(height, CylinderShape(0.32, 0.03), 0.32, rgb, rpy=_TO_X)


def triangular_sign(rng: np.random.Generator) -> Model:
    """Returns a triangular sign that faces +x."""
    height = float(rng.uniform(2.6, 3.0))
    return _sign(height, MeshShape("sign_triangle"), 0.45, _RED)


def stop_sign(rng: np.random.Generator) -> Model:
    """Returns an eight-cornered stop sign that faces +x."""
    height = float(rng.uniform(2.5, 2.9))
    return _sign(height, MeshShape("sign_octagon"), 0.4, _RED)


def _sign(
    height: float,
    shape: Shape,
    drop: float,
    rgb: tuple[float, float, float],
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Model:
    """Returns a plate on a mast, its middle `drop` below the top [m]."""
    plate = Part("plate", shape, (0.05, 0.0, height - drop), rpy, rgb)
    return assemble(post("mast", 0.035, height, rgb=_STEEL), plate)


def rectangular_sign(rng: np.random.Generator) -> Model:
    """Returns a rectangular sign that faces +x."""
    height = float(rng.uniform(2.6, 3.0))
    width = float(rng.uniform(0.45, 0.65))
    tall = float(rng.uniform(0.6, 0.9))
    return assemble(
        post("mast", 0.035, height, rgb=_STEEL),
        block(
            "plate",
            (0.03, width, tall),
            (0.05, 0, height - 0.5 * tall),
            rgb=(_BLUE, _WHITE)[int(rng.integers(2))],
        ),
    )


def street_name_sign(rng: np.random.Generator) -> Model:
    """Returns two crossed street name blades on a post."""
    height = float(rng.uniform(3.0, 3.3))
    return assemble(
        post("mast", 0.03, height, rgb=_STEEL),
        block("blade_x", (1.1, 0.03, 0.22), (0.4, 0, height - 0.12), rgb=_BLUE),
        block(
            "blade_y",
            (0.03, 1.0, 0.22),
            (0, 0.35, height - 0.36),
            rgb=_BLUE,
        ),
    )


def direction_board(rng: np.random.Generator) -> Model:
    """Returns a large direction board on two posts; it faces +x."""
    width = float(rng.uniform(2.4, 3.4))
    height = 4.6
    side = 0.35 * width
    return assemble(
        post("mast_0", 0.06, height, (0.0, side), _STEEL),
        post("mast_1", 0.06, height, (0.0, -side), _STEEL),
        block("plate", (0.05, width, 1.7), (0.09, 0, 3.75), rgb=_BLUE),
    )


TRAFFIC_SIGNALS = {
    "traffic_light": Builder("pole", mast_arm_light),
    "traffic_light_post": Builder("pole", post_light),
    "pedestrian_light": Builder("pole", pedestrian_light),
    "sign_round": Builder("traffic-sign", round_sign),
    "sign_triangular": Builder("traffic-sign", triangular_sign),
    "sign_stop": Builder("traffic-sign", stop_sign),
    "sign_rectangular": Builder("traffic-sign", rectangular_sign),
    "sign_street_name": Builder("traffic-sign", street_name_sign),
    "sign_direction": Builder("traffic-sign", direction_board),
}
