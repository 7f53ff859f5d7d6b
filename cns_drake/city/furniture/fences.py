"""Things in runs of any length: fences, railings, walls, barriers, hedges.

A run lies along x, centred on the origin; its front is +y. It is put together
from a few shared meshes of 1, 2, 4 and 8 panels, stretched a little to give
the exact length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.city.geometry.object_parts import (
    ROOT_DEPTH,
    Builder,
    assemble,
    block,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_LONGEST = 8


@dataclass(frozen=True)
class RunKind:
    """A kind of fence.

    Attributes:
        panel: nominal length of a panel [m].
        height: nominal height [m].
        colours: to choose from.
        end_post: x size, y from, y to, z to of the post that ends the run
            [m], or None.
    """

    panel: float
    height: float
    colours: tuple[tuple[float, float, float], ...]
    end_post: tuple[float, float, float, float] | None = None


# By the stems of their meshes' names.
RUN_KINDS = {
    "railing": RunKind(
        panel=2.0,
        height=1.1,
        colours=((0.15, 0.17, 0.18), (0.35, 0.37, 0.4), (0.16, 0.27, 0.22)),
        end_post=(0.06, -0.03, 0.03, 1.1),
    ),
    "picket_fence": RunKind(
        panel=2.0,
        height=1.2,
        colours=((0.85, 0.84, 0.8), (0.5, 0.36, 0.24), (0.42, 0.42, 0.4)),
        end_post=(0.1, -0.12, -0.05, 1.1),
    ),
    "garden_wall": RunKind(
        panel=3.0,
        height=1.7,
        colours=((0.6, 0.38, 0.3), (0.7, 0.64, 0.54), (0.58, 0.56, 0.53)),
        end_post=(0.4, -0.2, 0.2, 1.7),
    ),
    "hoarding": RunKind(
        panel=2.4,
        height=2.26,
        colours=((0.75, 0.72, 0.66), (0.2, 0.36, 0.58), (0.34, 0.5, 0.36)),
        end_post=(0.1, -0.14, 0.05, 2.2),
    ),
    "site_fence": RunKind(panel=3.5, height=2.0, colours=((0.6, 0.62, 0.63),)),
    "concrete_barrier": RunKind(
        panel=2.0, height=0.81, colours=((0.55, 0.55, 0.54),)
    ),
    "hedge": RunKind(
        panel=2.0,
        height=1.4,
        colours=((0.24, 0.4, 0.19), (0.3, 0.44, 0.22), (0.2, 0.34, 0.2)),
    ),
}


def run(
    rng: np.random.Generator,
    name: str,
    length: float,
    height: float | None = None,
) -> Model:
    """Returns a run of panels.

    Args:
        rng: draws the colour.
        name: a key of `RUN_KINDS`.
        length: of the run [m]; positive.
        height: [m], positive; the nominal one if not given.
    """
    kind = RUN_KINDS[name]
    height = kind.height if height is None else height
    if not (length > 0 and height > 0):
        raise ValueError(
            f"{name}: length {length}, height {height}: not positive"
        )
    colour = kind.colours[int(rng.integers(len(kind.colours)))]
    tall = round(height / kind.height, 4)
    total = max(1, round(length / kind.panel))
    stretch = round(length / (total * kind.panel), 4)
    parts: list[Part] = []
    done = 0
    while done < total:
        count = _LONGEST
        while count > total - done:
            count //= 2
        parts.append(
            Part(
                f"run_{len(parts):02d}",
                MeshShape(f"{name}_x{count}", (stretch, 1.0, tall)),
                xyz=(done * kind.panel * stretch - length / 2, 0.0, 0.0),
                rgb=colour,
            )
        )
        done += count
    if kind.end_post:
        x, y0, y1, top = kind.end_post
        top *= tall
        parts.append(
            block(
                "end",
                (x, y1 - y0, top + ROOT_DEPTH),
                (length / 2 - x / 2, (y0 + y1) / 2, (top - ROOT_DEPTH) / 2),
                rgb=colour,
            )
        )
    return assemble(*parts)


def _builder(name: str) -> Builder:
    def build(
        rng: np.random.Generator,
        *,
        length: float = 10.0,
        height: float | None = None,
    ) -> Model:
        return run(rng, name, length, height)

    semantic_class = "vegetation" if name == "hedge" else "fence"
    return Builder(semantic_class, build)


FENCES = {name: _builder(name) for name in RUN_KINDS}
