"""Things on a sidewalk: benches, bins, lamp posts, traffic lights, signs.

The front of each faces +x; arms reach along it, over the road.
"""

from functools import partial

import numpy as np

from cns_drake.city.geometry.structures import (
    ROOT_DEPTH,
    Builder,
    CylinderShape,
    MeshShape,
    Model,
    Part,
    Shape,
    SphereShape,
    assemble,
    bar,
    block,
    one_mesh,
    post,
)

_STEEL = (0.45, 0.47, 0.49)
_DARK = (0.2, 0.22, 0.24)
_WOOD = (0.52, 0.37, 0.24)
_STONE = (0.66, 0.64, 0.6)
_RED = (0.7, 0.16, 0.14)
_YELLOW = (0.85, 0.7, 0.15)
_GREEN = (0.16, 0.3, 0.2)


def stone_bench(rng: np.random.Generator) -> Model:
    """Returns a stone slab on two feet."""
    length = float(rng.uniform(1.6, 2.4))
    feet = [
        block(
            f"foot_{k}",
            (0.4, 0.35, 0.4 + ROOT_DEPTH),
            (0, side * 0.35 * length, (0.4 - ROOT_DEPTH) / 2),
            rgb=_STONE,
        )
        for k, side in enumerate((-1, 1))
    ]
    slab = block("seat", (0.5, length, 0.12), (0, 0, 0.46), rgb=_STONE)
    return assemble(*feet, slab)


def recycling_bins(rng: np.random.Generator) -> Model:
    """Returns a row of two to four wheeled rubbish containers along y."""
    count = int(rng.integers(2, 5))
    colours = ((0.25, 0.3, 0.28), (0.2, 0.34, 0.55), (0.3, 0.45, 0.25))
    parts = [
        Part(
            f"container_{k}",
            MeshShape("rubbish_container"),
            xyz=(0.0, 1.5 * (k - (count - 1) / 2), 0.0),
            rpy=(0.0, 0.0, round(float(rng.uniform(-0.08, 0.08)), 3)),
            rgb=colours[int(rng.integers(3))],
        )
        for k in range(count)
    ]
    return assemble(*parts)


def bollard(rng: np.random.Generator) -> Model:
    """Returns a bollard with a round head."""
    height = float(rng.uniform(0.8, 0.95))
    head = Part("head", SphereShape(0.08), xyz=(0.0, 0.0, height), rgb=_DARK)
    return assemble(post("shaft", 0.06, height, rgb=_DARK), head)


def bicycle_rack(rng: np.random.Generator) -> Model:
    """Returns a rack of hoops along y with a few bicycles in it."""
    hoops = int(rng.integers(4, 8))
    parts = []
    for k in range(hoops):
        y = 0.8 * (k - (hoops - 1) / 2)
        parts.append(
            Part(f"hoop_{k}", MeshShape("rack_hoop"), (0.0, y, 0.0), rgb=_STEEL)
        )
        if rng.uniform() < 0.55:
            lean = round(float(rng.uniform(-0.08, 0.08)), 3)
            parts.append(
                Part(
                    f"bicycle_{k}",
                    MeshShape("bicycle"),
                    (float(rng.uniform(-0.1, 0.1)), y + 0.17, 0.0),
                    (lean, 0.0, float(np.pi * rng.integers(2))),
                    tuple(rng.uniform(0.15, 0.6, 3).round(3).tolist()),
                )
            )
    return assemble(*parts)


def bicycle(rng: np.random.Generator) -> Model:
    """Returns a parked bicycle along x."""
    colour = tuple(rng.uniform(0.15, 0.6, 3).round(3).tolist())
    return assemble(Part("body", MeshShape("bicycle"), rgb=colour))


def parking_meter(rng: np.random.Generator) -> Model:
    """Returns a parking meter on a post."""
    height = float(rng.uniform(1.15, 1.3))
    return assemble(
        post("post", 0.035, height, rgb=_STEEL),
        block("head", (0.16, 0.22, 0.36), (0, 0, height + 0.1), rgb=_DARK),
    )


def ticket_machine(rng: np.random.Generator) -> Model:
    """Returns a parking ticket machine with a small solar roof."""
    turn = float(rng.uniform(-0.1, 0.1))
    return assemble(
        block(
            "case",
            (0.28, 0.36, 1.5 + ROOT_DEPTH),
            (0, 0, (1.5 - ROOT_DEPTH) / 2),
            turn,
            (0.35, 0.4, 0.5),
        ),
        block("roof", (0.5, 0.46, 0.06), (0.05, 0, 1.56), turn, _DARK),
    )


def newspaper_boxes(rng: np.random.Generator) -> Model:
    """Returns two to four newspaper boxes side by side along y."""
    count = int(rng.integers(2, 5))
    colours = (_RED, (0.2, 0.35, 0.6), _YELLOW, _DARK, _STONE)
    parts = [
        Part(
            f"box_{k}",
            MeshShape("newspaper_box"),
            xyz=(0.0, 0.55 * (k - (count - 1) / 2), 0.0),
            rgb=colours[int(rng.integers(len(colours)))],
        )
        for k in range(count)
    ]
    return assemble(*parts)


STREET_FURNITURE = {
    "bench": one_mesh("bench", [_WOOD], y=(0.9, 1.15)),
    "stone_bench": Builder("other-object", stone_bench),
    "litter_bin": one_mesh("litter_bin", [_DARK, _GREEN, _STEEL], z=(0.9, 1.1)),
    "recycling_bins": Builder("other-object", recycling_bins),
    "bollard": Builder("pole", bollard),
    "hydrant": one_mesh("hydrant", [_RED], z=(0.95, 1.1)),
    "bicycle_rack": Builder("bicycle", bicycle_rack),
    "bicycle": Builder("bicycle", bicycle),
    "parking_meter": Builder("pole", parking_meter),
    "ticket_machine": Builder("other-object", ticket_machine),
    "post_box": one_mesh("post_box", [_RED, _YELLOW], z=(0.96, 1.06)),
    "cabinet": one_mesh(
        "cabinet", [(0.52, 0.55, 0.5)], y=(0.8, 1.6), z=(0.85, 1.15)
    ),
    "newspaper_boxes": Builder("other-object", newspaper_boxes),
}
_LAMP_STEEL = (0.42, 0.44, 0.46)
_LAMP_GREEN = (0.16, 0.26, 0.22)
_LAMP = (0.85, 0.84, 0.78)


def straight_lamp(
    rng: np.random.Generator, *, height: float | None = None, arms: int = 1
) -> Model:
    """Returns a mast with one or two straight, slightly rising arms.

    Args:
        rng: draws the height if it is not given.
        height: height of the lamps [m].
        arms: 1, or 2 for a mast between two carriageways (along +-x).
    """
    drawn = float(rng.uniform(8.0, 9.5))
    height = drawn if height is None else height
    reach, rise = 1.9, 0.25
    parts = [
        post("base", 0.14, 0.9, rgb=_LAMP_STEEL),
        post("mast", 0.085, height, rgb=_LAMP_STEEL),
    ]
    for k, side in enumerate((1, -1)[:arms]):
        end = (side * reach, 0.0, height + rise)
        parts += [
            bar(
                f"arm_{k}",
                (0, 0, height - 0.15),
                end,
                0.045,
                _LAMP_STEEL,
            ),
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
        height: height of the lamps [m].
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
        height: height of the top of the lantern [m].
    """
    drawn = float(rng.uniform(3.8, 4.4))
    height = drawn if height is None else height
    return assemble(
        post("base", 0.11, 0.7, rgb=_LAMP_GREEN),
        post("mast", 0.05, height - 0.7, rgb=_LAMP_GREEN),
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
_BLACK = (0.12, 0.13, 0.13)
_SIGN_RED = (0.75, 0.15, 0.15)
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
    rgb = (_SIGN_RED, _BLUE)[int(rng.integers(2))]
    return _sign(height, CylinderShape(0.32, 0.03), 0.32, rgb, rpy=_TO_X)


def triangular_sign(rng: np.random.Generator) -> Model:
    """Returns a triangular sign that faces +x."""
    height = float(rng.uniform(2.6, 3.0))
    return _sign(height, MeshShape("sign_triangle"), 0.45, _SIGN_RED)


def stop_sign(rng: np.random.Generator) -> Model:
    """Returns an eight-cornered stop sign that faces +x."""
    height = float(rng.uniform(2.5, 2.9))
    return _sign(height, MeshShape("sign_octagon"), 0.4, _SIGN_RED)


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
