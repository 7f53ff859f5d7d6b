"""Small things on a sidewalk: benches, bins, bollards, boxes, racks.

The front of each faces +x.
"""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.object_parts import (
    ROOT_DEPTH,
    Builder,
    assemble,
    block,
    one_mesh,
    post,
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
