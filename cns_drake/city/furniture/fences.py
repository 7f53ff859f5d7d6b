"""Things in runs of any length: fences, railings, walls, barriers, hedges.

A run lies along x, centred on the origin; its front is +y. It is put together
from a few shared meshes of 1, 2, 4 and 8 panels, stretched a little to give
the exact length.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from cns_drake.city.geometry.lofts import along_x, loft, prism, side_prism, tube
from cns_drake.city.geometry.mesh import Mesh, box_mesh, merge_meshes
from cns_drake.city.geometry.object_parts import (
    ROOT_DEPTH,
    Builder,
    assemble,
    block,
)
from cns_drake.city.geometry.structures import MeshShape, Model, Part

_LONGEST = 8

# Deep enough for a low fence too: meshes are scaled to the asked height.
_ROOT = -1.5 * ROOT_DEPTH


@dataclass(frozen=True)
class RunKind:
    """A kind of fence.

    Attributes:
        name: stem of the mesh names.
        panel: nominal length of a panel [m].
        height: nominal height [m].
        colours: to choose from.
        pieces: `pieces(x)` returns what each panel, from x on, has of its
            own; it starts with its post.
        rails: y from, y to, z from, z to of what runs through all panels
            [m].
        end_post: x size, y from, y to, z to of the post that ends the run
            [m], or None.
    """

    name: str
    panel: float
    height: float
    colours: tuple[tuple[float, float, float], ...]
    pieces: Callable[[float], list[Mesh]] = lambda x: []
    rails: tuple[tuple[float, float, float, float], ...] = ()
    end_post: tuple[float, float, float, float] | None = None

    def make(self, count: int) -> Mesh:
        """Returns `count` panels in a row from x = 0."""
        end = self.panel * count
        meshes = [_box(0, end, *rail) for rail in self.rails]
        for k in range(count):
            meshes += self.pieces(self.panel * k)
        return merge_meshes(*meshes)


def run(
    rng: np.random.Generator,
    kind: RunKind,
    length: float,
    height: float | None = None,
) -> Model:
    """Returns a run of panels.

    Args:
        rng: draws the colour.
        kind: what it is made of.
        length: of the run [m]; positive.
        height: [m], positive; the nominal one if not given.
    """
    height = kind.height if height is None else height
    if not (length > 0 and height > 0):
        raise ValueError(
            f"{kind.name}: length {length}, height {height}: not positive"
        )
    colour = kind.colours[int(rng.integers(len(kind.colours)))]
    tall = round(height / kind.height, 4)
    total = max(1, round(length / kind.panel))
    stretch = round(length / (total * kind.panel), 4)
    parts: list[Part] = []
    meshes: dict[str, Mesh] = {}
    done = 0
    while done < total:
        count = _LONGEST
        while count > total - done:
            count //= 2
        name = f"{kind.name}_x{count}"
        meshes[name] = _panels(kind, count)
        parts.append(
            Part(
                f"run_{len(parts):02d}",
                MeshShape(name, (stretch, 1.0, tall)),
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
    return assemble(*parts, meshes=meshes)


@cache
def _panels(kind: RunKind, count: int) -> Mesh:
    return kind.make(count)


def _box(
    x0: float, x1: float, y0: float, y1: float, z0: float, z1: float
) -> Mesh:
    return box_mesh(
        (x1 - x0, y1 - y0, z1 - z0),
        ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2),
    )


def _railing(x: float) -> list[Mesh]:
    """Returns upright bars between two rails, 1.05 m high."""
    bars = [x + 0.03 + m * 2.0 / 14 for m in range(1, 14)]
    return [
        _box(x, x + 0.06, -0.03, 0.03, _ROOT, 1.1),
        *(tube([(p, 0, 0.14), (p, 0, 1.02)], (0.014, 0.014), 3) for p in bars),
    ]


def _picket(x: float) -> list[Mesh]:
    """Returns pointed boards of a wooden garden fence, 1.2 m high."""
    pieces = [_box(x, x + 0.1, -0.12, -0.05, _ROOT, 1.1)]
    for m in range(12):
        p = x + 0.02 + m * 2.0 / 12
        outline = [(p, 0.08), (p + 0.1, 0.08), (p + 0.1, 1.12),
                   (p + 0.05, 1.2), (p, 1.12)]  # fmt: skip
        pieces.append(side_prism(outline, -0.01, 0.015))
    return pieces


def _garden_wall(x: float) -> list[Mesh]:
    """Returns a pier of a brick wall, 1.7 m high."""
    # The coping, too, keeps within the length, or the next wall in a row
    # would have no room.
    return [
        _box(x + 0.04, x + 0.44, -0.2, 0.2, _ROOT, 1.62),
        _box(x, x + 0.48, -0.24, 0.24, 1.62, 1.7),
    ]


def _hoarding(x: float) -> list[Mesh]:
    """Returns a post and a rear strut of a construction hoarding."""
    strut = [(x + 0.05, -0.95, 0.04), (x + 0.05, -0.1, 1.7)]
    return [
        _box(x, x + 0.1, -0.14, 0.05, _ROOT, 2.2),
        _box(x, x + 0.1, -1.0, -0.12, 0.0, 0.08),
        tube(strut, (0.04, 0.04), 4),
    ]


def _site_fence(x: float) -> list[Mesh]:
    """Returns a temporary fence of tubes and wires on a foot, 2 m."""
    a, b = x + 0.06, x + 3.44
    wires = np.linspace(a, b, 20)[1:-1]
    return [
        *(tube([(p, 0, 0.0), (p, 0, 2.0)], (0.02, 0.02), 4) for p in (a, b)),
        *(
            tube([(a, 0, z), (b, 0, z)], (0.016, 0.016), 3)
            for z in (0.15, 1.1, 1.98)
        ),
        *(tube([(p, 0, 0.15), (p, 0, 1.98)], (0.006, 0.006), 3) for p in wires),
        _box(x + 0.02, x + 0.26, -0.35, 0.35, -0.02, 0.13),
    ]


def _concrete_barrier(x: float) -> list[Mesh]:
    """Returns a concrete safety barrier, 0.81 m high."""
    right = [(0.3, _ROOT), (0.3, 0.08), (0.12, 0.33), (0.075, 0.81)]
    profile = np.array([*right, *((-y, z) for y, z in reversed(right))])
    # Convex pieces, from the foot to the stem.
    return [
        along_x(prism(profile[list(rows)], x + 0.01, x + 1.97))
        for rows in ((0, 1, 6, 7), (1, 2, 5, 6), (2, 3, 4, 5))
    ]


class _Hedge(RunKind):
    """A clipped hedge with a rough skin, 1.4 m high, 0.9 m deep."""

    def make(self, count: int) -> Mesh:
        """Returns a hedge as long as `count` panels."""
        rng = np.random.default_rng([7002, count])
        step = 0.25
        side = [(0.40, _ROOT), (0.44, 0.35), (0.45, 0.75), (0.43, 1.1),
                (0.33, 1.35)]  # fmt: skip
        ring = [*side, (0.0, 1.42), *((-y, z) for y, z in reversed(side))]
        num = round(2.0 * count / step) + 1
        section = np.zeros((num, len(ring), 3))
        section[:, :, 0] = (step * np.arange(num))[:, None]
        section[:, :, 1:] = ring
        noise = rng.uniform(-1, 1, section.shape) * (0.08, 0.09, 0.07)
        # The ends keep the plain outline, so that neighbours meet.
        noise[[0, -1]] = 0.0
        noise[:, [0, -1]] = 0.0
        return loft(section + noise)


RUN_KINDS = {
    kind.name: kind
    for kind in (
        RunKind(
            "railing",
            panel=2.0,
            height=1.1,
            rails=((-0.025, 0.025, 0.12, 0.16), (-0.03, 0.03, 1.0, 1.05)),
            pieces=_railing,
            colours=((0.15, 0.17, 0.18), (0.35, 0.37, 0.4), (0.16, 0.27, 0.22)),
            end_post=(0.06, -0.03, 0.03, 1.1),
        ),
        RunKind(
            "picket_fence",
            panel=2.0,
            height=1.2,
            rails=((-0.05, -0.01, 0.3, 0.38), (-0.05, -0.01, 0.85, 0.93)),
            pieces=_picket,
            colours=((0.85, 0.84, 0.8), (0.5, 0.36, 0.24), (0.42, 0.42, 0.4)),
            end_post=(0.1, -0.12, -0.05, 1.1),
        ),
        RunKind(
            "garden_wall",
            panel=3.0,
            height=1.7,
            rails=((-0.12, 0.12, _ROOT, 1.4), (-0.17, 0.17, 1.4, 1.48)),
            pieces=_garden_wall,
            colours=((0.6, 0.38, 0.3), (0.7, 0.64, 0.54), (0.58, 0.56, 0.53)),
            end_post=(0.4, -0.2, 0.2, 1.7),
        ),
        RunKind(
            "hoarding",
            panel=2.4,
            height=2.26,
            rails=((-0.03, 0.03, 0.05, 2.2), (-0.05, 0.07, 2.2, 2.26)),
            pieces=_hoarding,
            colours=((0.75, 0.72, 0.66), (0.2, 0.36, 0.58), (0.34, 0.5, 0.36)),
            end_post=(0.1, -0.14, 0.05, 2.2),
        ),
        RunKind(
            "site_fence",
            panel=3.5,
            height=2.0,
            pieces=_site_fence,
            colours=((0.6, 0.62, 0.63),),
        ),
        RunKind(
            "concrete_barrier",
            panel=2.0,
            height=0.81,
            pieces=_concrete_barrier,
            colours=((0.55, 0.55, 0.54),),
        ),
        _Hedge(
            "hedge",
            panel=2.0,
            height=1.4,
            colours=((0.24, 0.4, 0.19), (0.3, 0.44, 0.22), (0.2, 0.34, 0.2)),
        ),
    )
}


def _builder(kind: RunKind) -> Builder:
    def build(
        rng: np.random.Generator,
        *,
        length: float = 10.0,
        height: float | None = None,
    ) -> Model:
        return run(rng, kind, length, height)

    semantic_class = "vegetation" if kind.name == "hedge" else "fence"
    return Builder(semantic_class, build)


FENCES = {name: _builder(kind) for name, kind in RUN_KINDS.items()}
