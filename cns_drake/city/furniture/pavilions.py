"""Small buildings of a street: bus shelter, kiosk, pillar, cafe tables.

The front of each faces +x; in a row they stand along y.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from cns_drake.city.geometry.lofts import (
    beam,
    lathe,
    loft,
    prism,
    rectangle,
    side_prism,
    tube,
)
from cns_drake.city.geometry.mesh import Mesh, box_mesh, boxes, merge_meshes
from cns_drake.city.geometry.object_parts import (
    ROOT_DEPTH,
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
    advert = float((1, -1)[int(rng.integers(2))])
    scale = (1.0, advert, 1.0)
    # The mirror image is a mesh of its own: a mirrored mesh would be inside
    # out.
    side = "left" if advert > 0 else "right"
    frame, panes = _shelter(advert)
    return assemble(
        Part("frame", MeshShape(f"shelter_{side}_frame"), rgb=_DARK),
        Part("panes", MeshShape(f"shelter_{side}_panes"), rgb=_GLASS),
        post("stop", 0.03, 2.9, (0.9, -2.6 * scale[1]), _STEEL),
        meshes={f"shelter_{side}_frame": frame, f"shelter_{side}_panes": panes},
    )


def cafe_table(rng: np.random.Generator) -> Model:
    """Returns a table with four chairs under an umbrella."""
    colours = ((0.82, 0.78, 0.68), (0.6, 0.2, 0.18), (0.25, 0.4, 0.35))
    height = float(rng.uniform(2.5, 2.75))
    turn = round(float(rng.uniform(-np.pi, np.pi)), 3)
    parts = (
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
    return assemble(
        *parts, meshes={"cafe_set": _cafe_set(), "cafe_umbrella": _umbrella()}
    )


def market_stall(rng: np.random.Generator) -> Model:
    """Returns a market stall with goods under a sloping awning."""
    colours = ((0.72, 0.3, 0.25), (0.3, 0.45, 0.62), (0.8, 0.76, 0.6))
    wide = round(float(rng.uniform(0.9, 1.2)), 3)
    scale = (1.0, wide, 1.0)
    parts = (
        Part("stall", MeshShape("market_stall", scale), rgb=(0.5, 0.38, 0.26)),
        Part(
            "awning",
            MeshShape("market_awning", scale),
            rgb=colours[int(rng.integers(3))],
        ),
    )
    stall, awning = _market_stall()
    return assemble(
        *parts, meshes={"market_stall": stall, "market_awning": awning}
    )


@cache
def _shelter(advert: float) -> tuple[Mesh, Mesh]:
    """Returns the frame and the panes; `advert` is +1 or -1, its y side."""
    corners = [(x, y) for x in (-0.62, 0.3) for y in (-1.95, 1.95)]
    frame = [
        beam((x, y, -ROOT_DEPTH), (x, y, 2.45), 0.07, 0.07) for x, y in corners
    ]
    frame += [
        side_prism(
            [(-0.8, 2.42), (0.85, 2.5), (0.85, 2.58), (-0.8, 2.56)], -2.1, 2.1
        ),
        box_mesh((0.05, 3.9, 0.06), (-0.62, 0, 0.25)),
        box_mesh((0.42, 2.4, 0.05), (-0.38, -0.3 * advert, 0.47)),
        box_mesh((1.0, 0.16, 2.0), (-0.15, 1.95 * advert, 1.15)),
    ]
    frame += [
        beam((-0.45, y, -0.1), (-0.45, y, 0.46), 0.05, 0.05)
        for y in (-1.2 * advert, 0.6 * advert)
    ]
    panes = boxes((0.02, 1.24, 2.0), (-0.62,), (-1.28, 0, 1.28), (1.35,))
    panes.append(box_mesh((0.85, 0.02, 2.0), (-0.16, -1.95 * advert, 1.35)))
    return merge_meshes(*frame), merge_meshes(*panes)


@cache
def _kiosk() -> Mesh:
    """Returns a kiosk with a counter and an awning, 2.2 m by 3 m."""
    roof = loft(
        [
            rectangle(1.5, 1.9, 2.7),
            rectangle(1.5, 1.9, 2.85),
            rectangle(0.5, 0.9, 3.4),
        ]
    )
    return merge_meshes(
        *[
            box_mesh(
                (2.2, 3.0, 1.0 + ROOT_DEPTH), (0, 0, 0.5 - ROOT_DEPTH / 2)
            ),
            box_mesh((2.0, 2.8, 1.7), (-0.05, 0, 1.85)),
            box_mesh((0.35, 2.6, 0.06), (1.2, 0, 1.03)),
            side_prism(
                [(1.0, 2.55), (1.95, 2.15), (1.97, 2.18), (1.0, 2.62)],
                -1.4,
                1.4,
            ),
            roof,
            lathe([(0.08, 3.35), (0.04, 3.8)], 6),
        ]
        + [
            box_mesh((0.12, 0.12, 1.7), (1.0, y, 1.85))
            for y in (-1.4, -0.5, 0.5, 1.4)
        ]
    )


@cache
def _advertising_pillar() -> Mesh:
    """Returns a round pillar with a domed cap."""
    return lathe(
        [
            (0.75, -ROOT_DEPTH),
            (0.75, 0.35),
            (0.65, 0.4),
            (0.65, 3.0),
            (0.82, 3.05),
            (0.82, 3.2),
            (0.7, 3.3),
            (0.35, 3.6),
            (0.08, 3.7),
            (0.05, 3.95),
        ],
        14,
    )


@cache
def _advertising_panel() -> Mesh:
    """Returns a free-standing poster case; its sides face +x and -x."""
    return merge_meshes(
        box_mesh((0.16, 1.3, 2.1), (0, 0, 1.45)),
        box_mesh((0.24, 1.4, 0.1), (0, 0, 2.5)),
        box_mesh((0.24, 1.4, 0.08), (0, 0, 0.4)),
        box_mesh((0.14, 0.5, 0.4 + ROOT_DEPTH), (0, 0, 0.2 - ROOT_DEPTH / 2)),
    )


@cache
def _phone_box() -> Mesh:
    """Returns a phone box with a recessed door towards +x."""
    pieces = [
        box_mesh(
            (0.95, 0.95, 0.15 + ROOT_DEPTH), (0, 0, 0.075 - ROOT_DEPTH / 2)
        ),
        box_mesh((0.78, 0.78, 2.0), (0, 0, 1.1)),
        box_mesh((0.98, 0.98, 0.22), (0, 0, 2.2)),
        loft(
            [
                rectangle(0.45, 0.45, 2.31),
                rectangle(0.32, 0.32, 2.42),
                rectangle(0.1, 0.1, 2.47),
            ]
        ),
    ]
    pieces += boxes((0.1, 0.1, 2.0), (-0.41, 0.41), (-0.41, 0.41), (1.1,))
    for z in (0.45, 0.95, 1.45, 1.85):
        pieces += [
            box_mesh((0.86, 0.74, 0.05), (0, 0, z)),
            box_mesh((0.74, 0.86, 0.05), (0, 0, z)),
        ]
    return merge_meshes(*pieces)


@cache
def _cafe_set() -> Mesh:
    """Returns a round table and four chairs."""
    pieces = [
        lathe([(0.42, 0.71), (0.42, 0.75)], 10),
        lathe([(0.22, 0.0), (0.06, 0.06), (0.05, 0.71)], 6),
    ]
    chair = [
        box_mesh((0.4, 0.42, 0.04), (0, 0, 0.45)),
        beam((0.19, 0, 0.62), (0.24, 0, 0.9), 0.4, 0.03),
    ]
    for x in (-0.17, 0.19):
        for y in (-0.18, 0.18):
            top = 0.7 if x > 0 else 0.44
            chair.append(tube([(x, y, 0), (x, y, top)], (0.018, 0.018), 3))
    seat = merge_meshes(*chair)
    for k, radius in enumerate((0.72, 0.8, 0.7, 0.86)):
        turn = k * np.pi / 2 + (0.1, -0.25, 0.2, 0.0)[k]
        away = (radius * np.cos(turn), radius * np.sin(turn), 0.0)
        pieces.append(seat.moved(away, turn + (0.2, 0.0, -0.3, 0.1)[k]))
    return merge_meshes(*pieces)


@cache
def _umbrella() -> Mesh:
    """Returns a thin eight-sided canopy; its top is the origin."""
    return lathe(
        [(1.38, -0.6), (1.4, -0.58), (1.42, -0.42), (0.7, -0.2), (0.06, 0.0)], 8
    )


@cache
def _market_stall() -> tuple[Mesh, Mesh]:
    stall = [
        box_mesh((1.0, 2.6, 0.08), (0.1, 0, 0.85)),
        box_mesh((0.8, 2.5, 0.82), (0.0, 0, 0.4)),
        box_mesh((0.4, 2.6, 0.3), (-0.25, 0, 1.0)),
    ]
    stall += [
        tube([(x, y, -ROOT_DEPTH), (x, y, z)], (0.03, 0.03), 4)
        for x, z in ((-0.85, 2.75), (0.75, 2.3))
        for y in (-1.4, 1.4)
    ]
    stall += [
        lathe([(0.2, 0.89), (0.24, 1.08)], 6).moved((0.35, y, 0))
        for y in (-1.0, -0.45, 0.1, 0.65, 1.1)
    ]
    awning = side_prism(
        [(-1.0, 2.76), (1.1, 2.2), (1.12, 2.23), (-1.0, 2.82)], -1.55, 1.55
    )
    valance = prism(
        [(1.09, -1.55), (1.12, -1.55), (1.12, 1.55), (1.09, 1.55)], 2.0, 2.22
    )
    return merge_meshes(*stall), merge_meshes(awning, valance)


PAVILIONS = {
    "bus_shelter": Builder("other-structure", bus_shelter),
    "kiosk": one_mesh(
        "kiosk", _kiosk, _KIOSKS, "other-structure", y=(0.9, 1.25)
    ),
    "advertising_pillar": one_mesh(
        "advertising_pillar", _advertising_pillar, [_PILLAR], z=(0.95, 1.1)
    ),
    "advertising_panel": one_mesh(
        "advertising_panel", _advertising_panel, [_DARK], z=(0.92, 1.08)
    ),
    "phone_box": one_mesh("phone_box", _phone_box, _PHONE_BOXES),
    "cafe_table": Builder("other-object", cafe_table),
    "market_stall": Builder("other-structure", market_stall),
}
