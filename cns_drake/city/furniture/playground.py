"""What stands in parks and yards: swings, slides, picnic tables, hoops."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np

from cns_drake.city.geometry.lofts import beam, loft, rectangle, tube
from cns_drake.city.geometry.mesh import Mesh, box_mesh, boxes, merge_meshes
from cns_drake.city.geometry.object_parts import (
    ROOT_DEPTH,
    Builder,
    assemble,
    block,
    one_mesh,
    post,
)
from cns_drake.city.geometry.structures import Model

_COLOURS = ((0.7, 0.2, 0.16), (0.2, 0.38, 0.62), (0.78, 0.62, 0.18))
_WOOD = (0.52, 0.38, 0.25)


def basketball_hoop(rng: np.random.Generator) -> Model:
    """Returns a basketball hoop on a post; its board faces +x."""
    height = float(rng.uniform(3.4, 3.7))
    steel = (0.35, 0.37, 0.4)
    return assemble(
        post("post", 0.07, height, rgb=steel),
        block("arm", (0.9, 0.1, 0.1), (0.4, 0, height - 0.3), rgb=steel),
        block("board", (0.05, 1.8, 1.05), (0.85, 0, height), rgb=_COLOURS[0]),
        block("rim", (0.46, 0.46, 0.03), (1.12, 0, height - 0.4)),
    )


@cache
def _swing() -> Mesh:
    """Returns a swing for two along y, 3.4 m wide and 2.5 m high."""
    pieces = [tube([(0, -1.7, 2.45), (0, 1.7, 2.45)], (0.06, 0.06), 6)]
    pieces += [
        tube([(x, y, -ROOT_DEPTH), (0, 0.9 * y, 2.45)], (0.05, 0.05), 5)
        for x in (-0.9, 0.9)
        for y in (-1.75, 1.75)
    ]
    for y in (-0.7, 0.7):
        lag = 0.25 * y
        pieces.append(box_mesh((0.2, 0.5, 0.04), (lag, y, 0.55)))
        pieces += [
            beam((lag, y + side, 0.55), (0, y + side, 2.43), 0.02, 0.02)
            for side in (-0.22, 0.22)
        ]
    return merge_meshes(*pieces)


@cache
def _slide() -> Mesh:
    """Returns a slide with a roofed tower; it runs out towards +x."""
    pieces = [
        beam((x, y, -ROOT_DEPTH), (x, y, 2.7), 0.1, 0.1)
        for x in (-0.55, 0.55)
        for y in (-0.55, 0.55)
    ]
    pieces.append(box_mesh((1.2, 1.2, 0.08), (0, 0, 1.4)))
    pieces += [box_mesh((1.1, 0.05, 0.5), (0, y, 1.75)) for y in (-0.56, 0.56)]
    pieces.append(
        loft(
            [
                rectangle(h, h, z)
                for h, z in ((0.8, 2.65), (0.78, 2.72), (0.08, 3.4))
            ]
        )
    )
    pieces += [
        beam((-1.3 + 0.12 * k, 0, 0.25 * k), (-1.24 + 0.12 * k, 0, 0.25 * k),
             0.5, 0.06)
        for k in range(1, 6)
    ]  # fmt: skip
    pieces += [
        beam((-1.35, y, 0.0), (-0.55, y, 1.75), 0.05, 0.08)
        for y in (-0.28, 0.28)
    ]
    chute = [(0.55, 1.4), (2.4, 0.35), (3.1, 0.25)]
    for (xa, za), (xb, zb) in pairwise(chute):
        pieces.append(beam((xa, 0, za), (xb, 0, zb), 0.6, 0.04))
        pieces += [
            beam((xa, y, za + 0.1), (xb, y, zb + 0.1), 0.05, 0.22)
            for y in (-0.3, 0.3)
        ]
    pieces.append(beam((2.9, 0, -0.1), (2.9, 0, 0.25), 0.4, 0.08))
    return merge_meshes(*pieces)


@cache
def _picnic_table() -> Mesh:
    """Returns a table with two benches along y."""
    pieces = boxes((0.24, 1.8, 0.05), (-0.26, 0, 0.26), (0,), (0.75,))
    pieces += boxes((0.28, 1.8, 0.05), (-0.7, 0.7), (0,), (0.45,))
    for y in (-0.6, 0.6):
        pieces += [
            beam((-0.6, y, 0.0), (-0.2, y, 0.73), 0.06, 0.1),
            beam((0.6, y, 0.0), (0.2, y, 0.73), 0.06, 0.1),
            beam((-0.75, y, 0.4), (0.75, y, 0.4), 0.06, 0.1),
        ]
    return merge_meshes(*pieces)


PLAYGROUND = {
    "swing": one_mesh("swing", _swing, _COLOURS, y=(0.92, 1.12)),
    "slide": one_mesh("slide", _slide, _COLOURS, z=(0.9, 1.1)),
    "picnic_table": one_mesh(
        "picnic_table", _picnic_table, [_WOOD], y=(0.9, 1.15)
    ),
    "basketball_hoop": Builder("pole", basketball_hoop),
}
