"""Fences, walls and hedges: rows of equal panels."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from evaluation.base import parse_yaml
from worlds.shapes.dice import Dice, Rgb
from worlds.shapes.models import MeshShape, Model, Part
from worlds.shapes.object_models import ROOT_DEPTH, Builder, assemble, block

# Greatest number of panels in one mesh; there are meshes of 1, 2, 4 and 8.
_MOST_PANELS = 8


@dataclass(frozen=True)
class FenceKind:
    """A kind of fence, wall or hedge: one entry of `furniture/fences.yaml`.

    Attributes:
        panel: length of a panel [m].
        height: usual height [m].
        colours: colours; each fence has one of these colours.
        end_post: post after the last panel: size in x, least y, greatest y, and
            height [m]; None for no post.
        semantic_class: a key of `worlds.shapes.semantics.CLASS_IDS`.
        material: name of the material; by default the usual material of the
            class.
    """

    panel: float
    height: float
    colours: tuple[Rgb, ...]
    end_post: tuple[float, float, float, float] | None = None
    semantic_class: str = "fence"
    material: str | None = None


# Name of a kind, with which the names of its meshes begin -> the kind.
FENCE_KINDS = {
    name: FenceKind(**values)
    for name, values in parse_yaml(
        Path(__file__).with_name("fences.yaml").read_bytes()
    ).items()
}


def fence(
    name: str,
    rng: np.random.Generator,
    *,
    length: float = 10.0,
    height: float | None = None,
) -> Model:
    """Returns a fence, wall or hedge of equal panels, in a random colour.

    Args:
        name: kind of fence, a key of `FENCE_KINDS`.
        rng: random generator for the colour.
        length: length along x [m]; the panels are stretched to fit.
        height: height [m]; by default the usual height of this kind.

    Raises:
        ValueError: the length or the height is not positive.
    """
    kind = FENCE_KINDS[name]
    height = kind.height if height is None else height
    if not (length > 0 and height > 0):
        raise ValueError(
            f"{name}: length {length}, height {height}: not positive"
        )
    red, green, blue = Dice(rng).pick(kind.colours)
    rgb = (red, green, blue)
    tall = round(height / kind.height, 4)
    total = max(1, round(length / kind.panel))
    stretch = round(length / (total * kind.panel), 4)
    parts: list[Part] = []
    done = 0
    while done < total:
        count = _MOST_PANELS
        while count > total - done:
            count //= 2
        shape = MeshShape(f"{name}_x{count}", (stretch, 1.0, tall))
        x = done * kind.panel * stretch - length / 2
        part = f"run_{len(parts):02d}"
        parts.append(
            Part(part, shape, (x, 0.0, 0.0), rgb=rgb, material=kind.material)
        )
        done += count
    if kind.end_post:
        x, y0, y1, top = kind.end_post
        top *= tall
        size = (x, y1 - y0, top + ROOT_DEPTH)
        at = (
            length / 2 - x / 2,
            (y0 + y1) / 2,
            (top - ROOT_DEPTH) / 2,
        )
        parts.append(block("end", size=size, center=at, rgb=rgb))
    return assemble(*parts)


FENCES = {
    name: Builder(kind.semantic_class, partial(fence, name))
    for name, kind in FENCE_KINDS.items()
}
