"""Small things on a sidewalk: benches, bins, bollards, boxes, racks.

The front of each faces +x.
"""

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
    tube,
)
from cns_drake.city.geometry.mesh import Mesh, box_mesh, boxes, merge_meshes
from cns_drake.city.geometry.object_parts import (
    ROOT_DEPTH,
    Builder,
    assemble,
    block,
    one_mesh,
    post,
    single,
)
from cns_drake.city.geometry.structures import (
    MeshShape,
    Model,
    Part,
    SphereShape,
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
    return assemble(*parts, meshes={"rubbish_container": _rubbish_container()})


def bollard(rng: np.random.Generator) -> Model:
    """Returns a bollard with a round head."""
    height = float(rng.uniform(0.8, 0.95))
    head = Part("head", SphereShape(0.08), xyz=(0.0, 0.0, height), rgb=_DARK)
    return assemble(post("shaft", 0.06, height, rgb=_DARK), head)


def bicycle_rack(rng: np.random.Generator) -> Model:
    """Returns a rack of hoops along y with a few bicycles in it."""
    hoops = int(rng.integers(4, 8))
    parts, meshes = [], {"rack_hoop": _rack_hoop()}
    for k in range(hoops):
        y = 0.8 * (k - (hoops - 1) / 2)
        parts.append(
            Part(f"hoop_{k}", MeshShape("rack_hoop"), (0.0, y, 0.0), rgb=_STEEL)
        )
        if rng.uniform() < 0.55:
            meshes["bicycle"] = _bicycle()
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
    return assemble(*parts, meshes=meshes)


def bicycle(rng: np.random.Generator) -> Model:
    """Returns a parked bicycle along x."""
    colour = tuple(rng.uniform(0.15, 0.6, 3).round(3).tolist())
    return single("bicycle", _bicycle(), colour)


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
    return assemble(*parts, meshes={"newspaper_box": _newspaper_box()})


@cache
def _bench() -> Mesh:
    """Returns a bench 1.8 m long on two cast frames."""
    pieces = boxes((0.11, 1.8, 0.04), (0.16, 0.02, -0.12), (0,), (0.45,))
    pieces += [
        beam((x, -0.9, z), (x, 0.9, z), 0.04, 0.11)
        for x, z in ((-0.24, 0.6), (-0.3, 0.76))
    ]
    for y in (-0.7, 0.7):
        pieces += [
            beam((0.2, y, -ROOT_DEPTH), (0.18, y, 0.43), 0.05, 0.05),
            beam((-0.22, y, -ROOT_DEPTH), (-0.2, y, 0.43), 0.05, 0.05),
            beam((-0.18, y, 0.43), (-0.34, y, 0.84), 0.05, 0.04),
            beam((-0.26, y, 0.66), (0.2, y, 0.66), 0.05, 0.04),
            beam((0.2, y, 0.43), (0.2, y, 0.66), 0.05, 0.04),
        ]
    return merge_meshes(*pieces)


@cache
def _litter_bin() -> Mesh:
    return merge_meshes(
        lathe([(0.16, -ROOT_DEPTH), (0.16, 0.08), (0.24, 0.7)], 10),
        lathe([(0.27, 0.7), (0.27, 0.76)], 10),
        lathe([(0.03, 0.76), (0.03, 0.95)], 4),
        lathe([(0.28, 0.92), (0.24, 1.0), (0.06, 1.05)], 10),
    )


@cache
def _rubbish_container() -> Mesh:
    """Returns a four-wheeled container with a sloping lid, 1.3 m wide."""
    body = loft(
        [
            [(x1, w, z), (x0, w, z), (x0, -w, z), (x1, -w, z)]
            for x0, x1, w, z in (
                (-0.36, 0.4, 0.58, 0.18),
                (-0.45, 0.48, 0.66, 1.02),
            )
        ]
    )
    lid = side_prism(
        [(-0.48, 1.02), (0.52, 1.02), (0.52, 1.08), (0.1, 1.32), (-0.48, 1.34)],
        -0.68,
        0.68,
    )
    wheels = boxes((0.16, 0.06, 0.2), (-0.3, 0.3), (-0.5, 0.5), (0.1,))
    return merge_meshes(body, lid, *wheels)


@cache
def _hydrant() -> Mesh:
    side = lathe([(0.07, -0.2), (0.07, 0.2)], 6)
    return merge_meshes(
        lathe(
            [
                (0.16, -ROOT_DEPTH),
                (0.16, 0.06),
                (0.11, 0.08),
                (0.11, 0.5),
                (0.14, 0.52),
                (0.13, 0.62),
                (0.05, 0.72),
            ],
            8,
        ),
        along_y(side).moved((0, 0, 0.42)),
        along_x(side).moved((0.08, 0, 0.4)),
    )


@cache
def _rack_hoop() -> Mesh:
    """Returns an inverted U of tube, 0.7 m long, 0.8 m high."""
    corners = [
        (-0.35, 0, -ROOT_DEPTH),
        (-0.35, 0, 0.72),
        (-0.25, 0, 0.8),
        (0.25, 0, 0.8),
        (0.35, 0, 0.72),
        (0.35, 0, -ROOT_DEPTH),
    ]
    return merge_meshes(
        *(
            tube(corners[k : k + 2], (0.025, 0.025), 5)
            for k in range(len(corners) - 1)
        )
    )


@cache
def _bicycle() -> Mesh:
    """Returns a bicycle along x, wheels 0.7 m across."""
    hubs = {"rear": (-0.52, 0.0, 0.34), "front": (0.55, 0.0, 0.34)}
    crank, seat, head = (-0.08, 0, 0.3), (-0.25, 0, 0.88), (0.4, 0, 0.86)
    pieces = []
    for hub in hubs.values():
        angle = 2 * np.pi * np.arange(11) / 10
        rim = np.column_stack(
            [np.cos(angle), 0 * angle, np.sin(angle)]
        ) * 0.33 + np.asarray(hub)
        pieces += [tube(rim[k : k + 2], (0.02, 0.02), 3) for k in range(10)]
        pieces += [beam(rim[k], rim[k + 5], 0.01, 0.01) for k in range(5)]
    pieces += [
        tube(line, (0.02, 0.02), 4)
        for line in (
            (hubs["rear"], crank),
            (hubs["rear"], seat),
            (crank, seat),
            (crank, head),
            (seat, head),
            (head, hubs["front"]),
            (head, (0.33, 0, 1.0)),
        )
    ]
    pieces += [
        tube([(0.33, -0.28, 1.0), (0.33, 0.28, 1.0)], (0.018, 0.018), 4),
        box_mesh((0.26, 0.14, 0.06), (-0.27, 0, 0.95)),
    ]
    return merge_meshes(*pieces)


@cache
def _post_box() -> Mesh:
    return merge_meshes(
        lathe(
            [
                (0.27, -ROOT_DEPTH),
                (0.27, 0.12),
                (0.23, 0.14),
                (0.23, 1.3),
                (0.28, 1.33),
                (0.27, 1.42),
                (0.1, 1.55),
            ],
            10,
        ),
        box_mesh((0.06, 0.3, 0.05), (0.23, 0, 1.2)),
    )


@cache
def _cabinet() -> Mesh:
    return merge_meshes(
        box_mesh((0.4, 0.98, 0.4), (0, 0, -0.1)),
        box_mesh((0.34, 0.46, 1.0), (0, -0.24, 0.6)),
        box_mesh((0.34, 0.46, 1.0), (0, 0.24, 0.6)),
        box_mesh((0.44, 1.02, 0.06), (0, 0, 1.13)),
        box_mesh((0.05, 0.03, 0.16), (0.18, 0.06, 0.7)),
    )


@cache
def _newspaper_box() -> Mesh:
    outline = [
        (0.22, 0.35),
        (0.22, 0.95),
        (0.1, 1.1),
        (-0.2, 1.1),
        (-0.2, 0.35),
    ]
    return merge_meshes(
        side_prism(outline, -0.22, 0.22),
        box_mesh((0.3, 0.3, 0.4), (0, 0, 0.16)),
        box_mesh((0.04, 0.34, 0.3), (0.22, 0, 0.72)),
    )


STREET_FURNITURE = {
    "bench": one_mesh("bench", _bench, [_WOOD], y=(0.9, 1.15)),
    "stone_bench": Builder("other-object", stone_bench),
    "litter_bin": one_mesh(
        "litter_bin", _litter_bin, [_DARK, _GREEN, _STEEL], z=(0.9, 1.1)
    ),
    "recycling_bins": Builder("other-object", recycling_bins),
    "bollard": Builder("pole", bollard),
    "hydrant": one_mesh("hydrant", _hydrant, [_RED], z=(0.95, 1.1)),
    "bicycle_rack": Builder("bicycle", bicycle_rack),
    "bicycle": Builder("bicycle", bicycle),
    "parking_meter": Builder("pole", parking_meter),
    "ticket_machine": Builder("other-object", ticket_machine),
    "post_box": one_mesh(
        "post_box", _post_box, [_RED, _YELLOW], z=(0.96, 1.06)
    ),
    "cabinet": one_mesh(
        "cabinet", _cabinet, [(0.52, 0.55, 0.5)], y=(0.8, 1.6), z=(0.85, 1.15)
    ),
    "newspaper_boxes": Builder("other-object", newspaper_boxes),
}
