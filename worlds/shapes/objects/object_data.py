"""Colours of the small objects, and the objects that are one mesh each."""

from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, Field

from evaluation.base import parse_yaml
from worlds.shapes.dice import Dice, Rgb
from worlds.shapes.models import Model
from worlds.shapes.object_models import Builder, assemble, mesh_part


class _OneMesh(BaseModel, frozen=True, extra="forbid"):
    """An object that is one mesh.

    Attributes:
        semantic_class: a key of `worlds.shapes.semantics.CLASS_IDS`.
        colours: the colours, of which each object has one.
        stretch: axis -> least and greatest factor of the object's size.
    """

    semantic_class: str = Field("other-object", alias="class")
    colours: tuple[Rgb, ...]
    stretch: dict[Literal["x", "y", "z"], tuple[float, float]] = {}


class _ObjectData(BaseModel, frozen=True, extra="forbid"):
    """The contents of `objects.yaml`, which explains them."""

    colours: dict[str, Rgb]
    choices: dict[str, tuple[Rgb, ...]]
    one_mesh: dict[str, _OneMesh]


_DATA = _ObjectData.model_validate(
    parse_yaml(Path(__file__).with_name("objects.yaml").read_bytes())
)
# Name -> colour.
COLOURS = _DATA.colours
# Name -> colours, of which an object or a part of it draws one.
CHOICES = _DATA.choices


def _one_mesh(mesh: str, kind: _OneMesh, rng: np.random.Generator) -> Model:
    dice = Dice(rng)
    factors = {
        axis: dice.uniform(low, high, digits=3)
        for axis, (low, high) in kind.stretch.items()
    }
    scale = (
        factors.get("x", 1.0),
        factors.get("y", 1.0),
        factors.get("z", 1.0),
    )
    rgb = dice.pick(kind.colours)
    return assemble(mesh_part("body", mesh, rgb=rgb, scale=scale))


ONE_MESH = {
    name: Builder(kind.semantic_class, partial(_one_mesh, name, kind))
    for name, kind in _DATA.one_mesh.items()
}
