"""Small buildings of a street: bus shelter, kiosk, pillar, cafe tables.

The front of each faces +x; in a row they stand along y.
"""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.object_parts import (
    Builder,
    assemble,
    one_mesh,
    post,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_DARK = (0.2, 0.22, 0.24)
_STEEL = (0.45, 0.47, 0.49)
_GLASS = (0.55, 0.65, 0.68)
_PILLAR = (0.6, 0.62, 0.55)
_KIOSKS = ((0.2, 0.33, 0.28), (0.5, 0.22, 0.18), (0.3, 0.34, 0.42))
_PHONE_BOXES = ((0.68, 0.14, 0.13), (0.3, 0.4, 0.5))


def bus_shelter(rng: np.random.Generator) -> Model:
    """Returns a bus shelter, 4 m by 1.5 m, open towards +x, with a stop."""
    advert = (1, -1)[int(rng.integers(2))]
    # The mirror image is a mesh of its own: a mirrored mesh would be inside
    # out.
    side = "left" if advert > 0 else "right"
    return assemble(
        Part("frame", MeshShape(f"shelter_{side}_frame"), rgb=_DARK),
        Part("panes", MeshShape(f"shelter_{side}_panes"), rgb=_GLASS),
        post("stop", 0.03, 2.9, (0.9, -2.6 * advert), _STEEL),
    )


def cafe_table(rng: np.random.Generator) -> Model:
    """Returns a table with four chairs under an umbrella."""
    colours = ((0.82, 0.78, 0.68), (0.6, 0.2, 0.18), (0.25, 0.4, 0.35))
    height = float(rng.uniform(2.5, 2.75))
    turn = round(float(rng.uniform(-np.pi, np.pi)), 3)
    return assemble(
        Part(
            "table",
            MeshShape("cafe_set"),
            rpy=(0.0, 0.0, turn),
            rgb=(0.5, 0.42, 0.34),
        ),
        post("pole", 0.025, height, rgb=_STEEL),
        Part(
            "umbrella",
            MeshShape("cafe_umbrella"),
            xyz=(0.0, 0.0, height),
            rpy=(0.0, 0.0, turn / 3),
            rgb=colours[int(rng.integers(3))],
        ),
    )


def market_stall(rng: np.random.Generator) -> Model:
    """Returns a market stall with goods under a sloping awning."""
    colours = ((0.72, 0.3, 0.25), (0.3, 0.45, 0.62), (0.8, 0.76, 0.6))
    wide = round(float(rng.uniform(0.9, 1.2)), 3)
    scale = (1.0, wide, 1.0)
    return assemble(
        Part("stall", MeshShape("market_stall", scale), rgb=(0.5, 0.38, 0.26)),
        Part(
            "awning",
            MeshShape("market_awning", scale),
            rgb=colours[int(rng.integers(3))],
        ),
    )


PAVILIONS = {
    "bus_shelter": Builder("other-structure", bus_shelter),
    "kiosk": one_mesh("kiosk", _KIOSKS, "other-structure", y=(0.9, 1.25)),
    "advertising_pillar": one_mesh(
        "advertising_pillar", [_PILLAR], z=(0.95, 1.1)
    ),
    "advertising_panel": one_mesh("advertising_panel", [_DARK], z=(0.92, 1.08)),
    "phone_box": one_mesh("phone_box", _PHONE_BOXES),
    "cafe_table": Builder("other-object", cafe_table),
    "market_stall": Builder("other-structure", market_stall),
}
