"""Trees: species, their mesh variants, and single trees made from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
import string

import numpy as np

from cns_drake.city.broadleaf import BroadleafForm, grow_broadleaf
from cns_drake.city.mesh import Mesh
from cns_drake.city.object_parts import Builder, assemble
from cns_drake.city.structures import MeshShape, Model, Part


@dataclass(frozen=True)
class Species:
    """A kind of tree.

    Attributes:
        name: also the stem of its mesh names.
        number: seeds the meshes; never change one that is in use.
        variants: how many different meshes there are.
        height: nominal height of the meshes [m].
        height_range: heights that a planted tree may have [m].
        grow: mesh generator, rng -> (wood, leaves).
        leaf_rgb: mean colour of the leaves.
        bark_rgb: colour of the wood.
    """

    name: str
    number: int
    variants: int
    height: float
    height_range: tuple[float, float]
    grow: Callable[[np.random.Generator], tuple[Mesh, Mesh]]
    leaf_rgb: tuple[float, float, float]
    bark_rgb: tuple[float, float, float] = (0.42, 0.34, 0.26)


def _broadleaf(form: BroadleafForm) -> dict:
    return {
        "height": form.height,
        "grow": partial(grow_broadleaf, form=form),
    }


_PLANE = BroadleafForm(
    height=11.0,
    crown_base=3.7,
    crown_radius=3.6,
    profile=(0.55, 0.9, 1.0, 0.98, 0.85, 0.6, 0.25),
    trunk_radius=0.22,
    limbs=8,
    clumps=42,
    clump_radius=0.95,
)
_LIME = BroadleafForm(
    height=9.0,
    crown_base=3.0,
    crown_radius=2.5,
    profile=(0.6, 0.92, 1.0, 0.95, 0.8, 0.6, 0.3),
    trunk_radius=0.16,
    limbs=7,
    clumps=40,
    clump_radius=0.75,
    leaf_length=0.46,
    leaf_width=0.34,
    raggedness=0.1,
)
_POPLAR = BroadleafForm(
    height=15.0,
    crown_base=2.2,
    crown_radius=1.5,
    profile=(0.5, 0.85, 1.0, 1.0, 0.92, 0.78, 0.55, 0.2),
    trunk_radius=0.2,
    limbs=9,
    clumps=44,
    clump_radius=0.75,
    leaf_length=0.46,
    leaf_width=0.32,
    raggedness=0.12,
)
_YOUNG = BroadleafForm(
    height=5.6,
    crown_base=2.75,
    crown_radius=1.15,
    profile=(0.5, 0.95, 1.0, 0.75, 0.3),
    trunk_radius=0.06,
    limbs=5,
    clumps=16,
    clump_radius=0.42,
    leaf_length=0.3,
    leaf_width=0.22,
    lean=0.1,
)

SPECIES = {
    species.name: species
    for species in (
        Species(
            "plane_tree",
            1,
            4,
            height_range=(8.5, 13.0),
            leaf_rgb=(0.36, 0.50, 0.24),
            **_broadleaf(_PLANE),
        ),
        Species(
            "lime_tree",
            2,
            4,
            height_range=(7.8, 10.5),
            leaf_rgb=(0.30, 0.47, 0.22),
            **_broadleaf(_LIME),
        ),
        Species(
            "poplar",
            3,
            3,
            height_range=(12.0, 18.0),
            leaf_rgb=(0.38, 0.52, 0.25),
            **_broadleaf(_POPLAR),
        ),
        Species(
            "young_tree",
            6,
            3,
            height_range=(5.2, 6.2),
            leaf_rgb=(0.42, 0.56, 0.28),
            **_broadleaf(_YOUNG),
        ),
    )
}


@cache
def tree_meshes(name: str, variant: int) -> dict[str, Mesh]:
    """Returns the wood and leaf meshes of a variant by their names."""
    species = SPECIES[name]
    rng = np.random.default_rng([7001, species.number, variant])
    wood, crown = species.grow(rng)
    stem = f"{name}_{string.ascii_lowercase[variant]}"
    return {f"{stem}_wood": wood, f"{stem}_crown": crown}


def tree(
    rng: np.random.Generator,
    *,
    species: str,
    height: float | None = None,
    variant: int | None = None,
) -> Model:
    """Returns one tree: a variant of its species, scaled, turned, tinted.

    Args:
        rng: draws whatever is not given.
        species: a key of `SPECIES`.
        height: of the top [m].
        variant: number of the mesh variant.
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
    up = height / kind.height
    # Tall trees are wider too, but less than in proportion.
    across = up**0.7 * stretch
    scale = tuple(round(float(s), 3) for s in (*across, up))
    meshes = tree_meshes(species, variant)
    wood, crown = meshes
    rgb = np.clip(kind.leaf_rgb * tint, 0, 1)
    rpy = (0.0, 0.0, round(yaw, 3))
    parts = (
        Part("wood", MeshShape(wood, scale), rpy=rpy, rgb=kind.bark_rgb),
        Part(
            "crown",
            MeshShape(crown, scale),
            rpy=rpy,
            rgb=tuple(round(float(c), 3) for c in rgb),
        ),
    )
    return assemble(parts, meshes)


TREES = {
    name: Builder("vegetation", partial(tree, species=name)) for name in SPECIES
}
