"""Trees: their species, random single trees, and plants at other sizes."""

from dataclasses import dataclass, replace
from functools import partial
import math
import string
from typing import Any

import numpy as np

from worlds.shapes.models import (
    BoxShape,
    MeshShape,
    Model,
    Part,
    part_mesh,
    triple,
)
from worlds.shapes.object_models import Builder, assemble, object_mesh

# Tall trees are also wider, but less than in proportion: the width grows with
# this power of the height.
_WIDTH_POWER = 0.7


@dataclass(frozen=True)
class Species:
    """A species of tree.

    Attributes:
        variants: number of shapes, each with meshes of its own.
        height_range: least and greatest height of a tree [m].
        leaf_rgb: colour of the leaves.
        bark_rgb: colour of the wood.
    """

    variants: int
    height_range: tuple[float, float]
    leaf_rgb: tuple[float, float, float]
    bark_rgb: tuple[float, float, float] = (0.42, 0.34, 0.26)


# Name of a species, with which the names of its meshes begin -> the species.
SPECIES = {
    "plane_tree": Species(5, (8.5, 13.0), (0.36, 0.50, 0.24)),
    "lime_tree": Species(4, (7.8, 10.5), (0.30, 0.47, 0.22)),
    "poplar": Species(3, (12.0, 18.0), (0.38, 0.52, 0.25)),
    "spruce": Species(3, (8.0, 16.0), (0.20, 0.34, 0.22)),
    "pine": Species(3, (9.0, 14.0), (0.26, 0.39, 0.23), (0.48, 0.34, 0.25)),
    "young_tree": Species(3, (5.2, 6.2), (0.42, 0.56, 0.28)),
    "palm": Species(4, (6.5, 11.0), (0.38, 0.50, 0.26), (0.50, 0.42, 0.33)),
    "willow": Species(3, (7.5, 11.0), (0.44, 0.54, 0.28)),
}


def mesh_names(species: str, variant: int) -> tuple[str, str]:
    """Returns the names of two meshes of a tree: the wood and the crown.

    `variant` is the number of the tree's shape, from 0.
    """
    stem = f"{species}_{string.ascii_lowercase[variant]}"
    return f"{stem}_wood", f"{stem}_crown"


def tree(
    rng: np.random.Generator,
    *,
    species: str,
    height: float | None = None,
    variant: int | None = None,
) -> Model:
    """Returns one tree; parameters that are not given are random.

    Args:
        rng: random generator.
        species: a key of `SPECIES`.
        height: height of the tree's top [m]; it should be within the range of
            the species, so that people can walk below the crowns of street
            trees.
        variant: number of the tree's shape, from 0.
    """
    kind = SPECIES[species]
    drawn_height = rng.uniform(*kind.height_range)
    drawn_variant = int(rng.integers(kind.variants))
    stretch = rng.uniform(0.88, 1.14, 2)
    yaw = float(rng.uniform(-np.pi, np.pi))
    tint = rng.uniform(0.82, 1.15) * rng.uniform(0.94, 1.06, 3)
    if height is None:
        height = drawn_height
    if variant is None:
        variant = drawn_variant
    names = wood, crown = mesh_names(species, variant)
    up = height / max(object_mesh(n).vertices[:, 2].max() for n in names)
    across = math.pow(up, _WIDTH_POWER) * stretch
    scale = triple(round(float(s), 3) for s in (*across, up))
    rgb = np.clip(kind.leaf_rgb * tint, 0, 1)
    rpy = (0.0, 0.0, round(yaw, 3))
    return assemble(
        Part(
            "wood",
            MeshShape(wood, scale),
            rpy=rpy,
            rgb=kind.bark_rgb,
            material="bark",
        ),
        Part(
            "crown",
            MeshShape(crown, scale),
            rpy=rpy,
            rgb=triple(round(float(c), 3) for c in rgb),
        ),
    )


TREES = {
    name: Builder("vegetation", partial(tree, species=name)) for name in SPECIES
}


def younger_plant(model: Model, height: float) -> Model:
    """Returns a plant scaled down to a height above z = 0 [m].

    A plant that is not higher than this is returned unchanged.
    """
    meshes = (part_mesh(part, model.meshes) for part in model.parts)
    top = max(mesh.vertices[:, 2].max() for mesh in meshes)
    if top <= height:
        return model
    return scaled_plant(model, round(height / float(top), 4))


def scaled_plant(model: Model, factor: float) -> Model:
    """Returns a plant scaled about its origin by a factor."""

    def times(values: tuple[float, ...], digits: int) -> list[float]:
        return np.round(np.multiply(values, factor), digits).tolist()

    def scaled(part: Part) -> Part:
        shape: Any = part.shape
        if isinstance(shape, MeshShape):
            shape = replace(shape, scale=triple(times(shape.scale, 5)))
        elif isinstance(shape, BoxShape):
            shape = BoxShape(triple(times(shape.size, 5)))
        else:
            sizes = {k: round(v * factor, 4) for k, v in vars(shape).items()}
            shape = replace(shape, **sizes)
        return replace(part, shape=shape, xyz=triple(times(part.xyz, 4)))

    return replace(model, parts=tuple(map(scaled, model.parts)))
