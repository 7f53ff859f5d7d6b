"""What stands on a construction site or at roadworks."""

from __future__ import annotations

from functools import cache

import numpy as np

from cns_drake.city.geometry.lofts import (
    along_x,
    along_y,
    beam,
    lathe,
    loft,
    side_prism,
)
from cns_drake.city.geometry.mesh import Mesh, box_mesh, boxes, merge_meshes
from cns_drake.city.geometry.object_parts import (
    Builder,
    assemble,
    one_mesh,
    triple,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_STEEL_COLOURS = (
    (0.25, 0.38, 0.52),
    (0.55, 0.24, 0.18),
    (0.42, 0.44, 0.42),
    (0.24, 0.4, 0.32),
)
_YELLOW = (0.82, 0.62, 0.14)
_ORANGE = (0.86, 0.4, 0.12)
_EARTH = (0.46, 0.38, 0.28)
_DARK = (0.2, 0.21, 0.22)
_PIPE = (0.6, 0.58, 0.54)
_TOILETS = ((0.2, 0.4, 0.55), (0.25, 0.45, 0.3))


def site_cabin(rng: np.random.Generator, *, storeys: int = 1) -> Model:
    """Returns site offices along x, one on top of the other.

    Args:
        rng: draws the colour.
        storeys: number of cabins.
    """
    colours = ((0.75, 0.75, 0.72), (0.3, 0.44, 0.58), (0.72, 0.6, 0.25))
    colour = colours[int(rng.integers(3))]
    parts = [
        Part(
            f"cabin_{k}",
            MeshShape("site_cabin"),
            xyz=(0.0, 0.0, round(2.75 * k, 3)),
            rgb=colour,
        )
        for k in range(storeys)
    ]
    return assemble(*parts, meshes={"site_cabin": _cabin()})


def skip(rng: np.random.Generator) -> Model:
    """Returns a skip half full of rubble, along x."""
    parts = (
        Part("shell", MeshShape("skip_shell"), rgb=_YELLOW),
        Part(
            "load",
            MeshShape("heap", (0.3, 0.2, 0.25)),
            xyz=(0.0, 0.0, round(float(rng.uniform(0.7, 0.95)), 3)),
            rpy=(0.0, 0.0, round(float(rng.uniform(0, 0.2)), 3)),
            rgb=_EARTH,
        ),
    )
    return assemble(*parts, meshes={"skip_shell": _skip(), "heap": _heap()})


def soil_heap(rng: np.random.Generator) -> Model:
    """Returns a heap of earth or sand, 4 to 8 m across."""
    size = rng.uniform(0.55, 1.1, 2)
    scale = triple(round(float(s), 3) for s in (*size, size.mean()))
    part = Part(
        "heap",
        MeshShape("heap", scale),
        rpy=(0.0, 0.0, round(float(rng.uniform(-3, 3)), 3)),
        rgb=(_EARTH, (0.72, 0.63, 0.46))[int(rng.integers(2))],
    )
    return assemble(part, meshes={"heap": _heap()})


def brick_pallets(rng: np.random.Generator) -> Model:
    """Returns two to five pallets of bricks in a loose row along y."""
    count = int(rng.integers(2, 6))
    parts = [
        Part(
            f"pallet_{k}",
            MeshShape("brick_pallet", (1.0, 1.0, (0.6, 1.0)[k % 2])),
            xyz=(
                round(float(rng.uniform(-0.2, 0.2)), 3),
                round(1.5 * (k - (count - 1) / 2), 3),
                0.0,
            ),
            rpy=(0.0, 0.0, round(float(rng.uniform(-0.15, 0.15)), 3)),
            rgb=(0.62, 0.34, 0.26),
        )
        for k in range(count)
    ]
    return assemble(*parts, meshes={"brick_pallet": _brick_pallet()})


def excavator(rng: np.random.Generator) -> Model:
    """Returns a tracked excavator, its arm stretched out along +x."""
    turn = round(float(rng.uniform(-0.6, 0.6)), 3)
    tracks, upper = _excavator()
    parts = (
        Part("tracks", MeshShape("excavator_tracks"), rgb=_DARK),
        Part(
            "upper",
            MeshShape("excavator_upper"),
            rpy=(0.0, 0.0, turn),
            rgb=_YELLOW,
        ),
    )
    return assemble(
        *parts, meshes={"excavator_tracks": tracks, "excavator_upper": upper}
    )


def traffic_cones(rng: np.random.Generator, *, count: int = 5) -> Model:
    """Returns a row of traffic cones along x, 1.5 m apart.

    Args:
        rng: sets each cone a little off the line.
        count: number of cones.
    """
    parts = [
        Part(
            f"cone_{k}",
            MeshShape("traffic_cone"),
            xyz=(
                round(1.5 * (k - (count - 1) / 2), 3),
                round(float(rng.uniform(-0.15, 0.15)), 3),
                0.0,
            ),
            rgb=_ORANGE,
        )
        for k in range(count)
    ]
    return assemble(*parts, meshes={"traffic_cone": _cone()})


@cache
def _container() -> Mesh:
    """Returns a ribbed container along x, 6.06 m by 2.44 m by 2.59 m."""
    pieces = [box_mesh((5.96, 2.36, 2.49), (0, 0, 1.3))]
    posts, rungs = (-2.95, 2.95), np.linspace(-2.6, 2.6, 14).tolist()
    pieces += boxes((0.16, 0.16, 2.59), posts, (-1.14, 1.14), (1.295,))
    pieces += boxes((5.74, 0.12, 0.14), (0,), (-1.16, 1.16), (0.07, 2.52))
    pieces += boxes((0.14, 0.05, 2.3), rungs, (-1.195, 1.195), (1.3,))
    bars = (-0.8, -0.35, 0.35, 0.8)
    pieces += boxes((0.05, 0.05, 2.3), (3.0,), bars, (1.3,))
    return merge_meshes(*pieces)


@cache
def _cabin() -> Mesh:
    """Returns a cabin 6 m by 2.5 m by 2.7 m with windows and a door."""
    pieces = [
        box_mesh((5.9, 2.4, 2.5), (0, 0, 1.35)),
        box_mesh((6.06, 2.5, 0.12), (0, 0, 0.16)),
        box_mesh((6.06, 2.5, 0.14), (0, 0, 2.63)),
    ]
    pieces += boxes((0.12, 0.12, 2.6), (-2.97, 2.97), (-1.19, 1.19), (1.3,))
    # Frames stand out, so that the panes between them look recessed.
    for x, width, low, high in (
        (-1.9, 1.4, 1.1, 2.1),
        (0.1, 1.4, 1.1, 2.1),
        (2.0, 0.95, 0.2, 2.2),
    ):
        middle, tall = (low + high) / 2, high - low
        pieces += boxes((width, 0.1, 0.08), (x,), (1.22,), (low, high))
        pieces += [
            box_mesh((0.08, 0.1, tall), (x + side * width / 2, 1.22, middle))
            for side in (-1, 1)
        ]
    return merge_meshes(*pieces)


@cache
def _skip() -> Mesh:
    """Returns an open steel skip, 3.2 m by 1.7 m, 1.2 m high."""
    walls = [
        side_prism(
            [(-1.05, 0.05), (1.05, 0.05), (1.6, 0.75), (1.6, 1.2), (-1.6, 1.2),
             (-1.6, 0.75)],
            y,
            y + 0.06,
        )
        for y in (-0.85, 0.79)
    ]  # fmt: skip
    ends = [
        beam((side * 1.05, 0, 0.1), (side * 1.57, 0, 0.75), 1.7, 0.06)
        for side in (-1, 1)
    ]
    ends += boxes((0.06, 1.7, 0.48), (-1.57, 1.57), (0,), (0.96,))
    rim = [box_mesh((3.3, 0.12, 0.08), (0, y, 1.2)) for y in (-0.85, 0.85)]
    floor = box_mesh((2.1, 1.7, 0.08), (0, 0, 0.09))
    return merge_meshes(*walls, *ends, *rim, floor)


@cache
def _heap() -> Mesh:
    """Returns a rough round heap, 7 m across and 2.4 m high."""
    rng = np.random.default_rng([7005])
    sides = 18
    angle = 2 * np.pi * np.arange(sides) / sides
    lobes = 1 + 0.12 * np.sin(2 * angle + 1) + 0.08 * np.sin(5 * angle)
    sections = []
    for radius, z in (
        (3.6, -0.3),
        (3.4, 0.0),
        (2.6, 0.75),
        (1.8, 1.4),
        (0.9, 2.05),
        (0.25, 2.4),
    ):
        rough = 1 + 0.09 * rng.standard_normal(sides) * (0 < z < 2.2)
        ring = radius * lobes * rough
        lift = 0.08 * rng.standard_normal(sides) * (0 < z < 2.2)
        sections.append(
            np.column_stack(
                [ring * np.cos(angle), ring * np.sin(angle), z + lift]
            )
        )
    return loft(sections)


@cache
def _pipe_stack() -> Mesh:
    """Returns ten closed pipes, 5 m long, in four layers."""
    radius = 0.3
    pipe = along_x(lathe([(radius, -2.5), (radius, 2.5)], 8))
    pieces = []
    for layer in range(4):
        for k in range(4 - layer):
            y = 2 * radius * (k - (3 - layer) / 2)
            z = radius * (1 + layer * np.sqrt(3))
            pieces.append(pipe.moved((0.08 * (k % 2), y, z)))
    pieces += [box_mesh((0.1, 2.5, 0.12), (x, 0, 0.0)) for x in (-1.6, 1.6)]
    return merge_meshes(*pieces)


@cache
def _brick_pallet() -> Mesh:
    """Returns bricks on a pallet, 1.2 m by 1 m by 1.1 m."""
    slats = boxes((1.2, 0.12, 0.12), (0,), (-0.44, 0, 0.44), (0.06,))
    return merge_meshes(
        *slats,
        box_mesh((1.2, 1.0, 0.04), (0, 0, 0.14)),
        box_mesh((1.1, 0.95, 0.55), (0, 0, 0.44)),
        box_mesh((1.0, 0.9, 0.38), (0.04, -0.02, 0.91)),
    )


@cache
def _excavator() -> tuple[Mesh, Mesh]:
    """Returns the tracks, and what turns on them."""
    outline = [
        (-1.5, 0.05),
        (1.5, 0.05),
        (1.85, 0.35),
        (1.6, 0.75),
        (-1.6, 0.75),
        (-1.85, 0.35),
    ]
    tracks = [side_prism(outline, y, y + 0.55) for y in (-1.35, 0.8)]
    tracks.append(box_mesh((1.6, 1.7, 0.4), (0, 0, 0.7)))
    house = side_prism(
        [(-2.0, 1.0), (0.9, 1.0), (0.9, 1.6), (0.3, 1.9), (-2.0, 2.0)],
        -1.2,
        1.2,
    )
    cab = side_prism(
        [(-0.4, 1.5), (1.2, 1.2), (1.3, 2.0), (0.9, 2.85), (-0.4, 2.85)],
        0.25,
        1.2,
    )
    wheel = along_y(lathe([(0.12, -0.3), (0.12, 0.3)], 6))
    arm = [
        beam((0.6, -0.2, 1.5), (2.3, -0.2, 3.9), 0.35, 0.5),
        beam((2.1, -0.2, 3.85), (3.9, -0.2, 3.5), 0.35, 0.45),
        beam((3.7, -0.2, 3.8), (4.4, -0.2, 1.4), 0.3, 0.35),
        beam((1.0, -0.2, 1.4), (2.5, -0.2, 3.3), 0.14, 0.14),
        wheel.moved((3.85, -0.2, 3.55)),
    ]
    bucket = side_prism(
        [(3.7, 0.55), (4.5, 0.5), (4.65, 1.35), (4.2, 1.55)], -0.75, 0.35
    )
    return merge_meshes(*tracks), merge_meshes(house, cab, *arm, bucket)


@cache
def _portable_toilet() -> Mesh:
    """Returns a portable toilet, its door towards +x."""
    return merge_meshes(
        box_mesh((1.1, 1.1, 2.1), (0, 0, 1.1)),
        box_mesh((1.2, 1.2, 0.12), (0, 0, 0.06)),
        box_mesh((0.06, 0.75, 1.8), (0.55, 0, 1.1)),
        side_prism(
            [(-0.6, 2.15), (0.6, 2.15), (0.3, 2.35), (-0.3, 2.35)],
            -0.6,
            0.6,
        ),
        lathe([(0.05, 0.3), (0.05, 2.55)], 5).moved((-0.6, 0.3, 0)),
    )


@cache
def _cone() -> Mesh:
    return merge_meshes(
        box_mesh((0.4, 0.4, 0.06), (0, 0, 0.02)),
        lathe([(0.15, 0.05), (0.03, 0.75)], 8),
    )


SITE_EQUIPMENT = {
    "container": one_mesh(
        "container", _container, _STEEL_COLOURS, "other-structure"
    ),
    "site_cabin": Builder("other-structure", site_cabin),
    "skip": Builder("other-object", skip),
    "soil_heap": Builder("terrain", soil_heap),
    "pipe_stack": one_mesh("pipe_stack", _pipe_stack, [_PIPE], x=(0.8, 1.3)),
    "brick_pallets": Builder("other-object", brick_pallets),
    "excavator": Builder("other-vehicle", excavator),
    "portable_toilet": one_mesh("portable_toilet", _portable_toilet, _TOILETS),
    "traffic_cones": Builder("other-object", traffic_cones),
}
