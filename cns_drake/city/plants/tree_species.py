"""The species of trees: their shapes, sizes and colours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from cns_drake.city.geometry.lofts import beam, tube
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.geometry.object_parts import ROOT_DEPTH
from cns_drake.city.plants.broadleaf import BroadleafForm, grow_broadleaf
from cns_drake.city.plants.conifer import grow_conifer
from cns_drake.city.plants.palm import grow_palm
from cns_drake.city.plants.willow import grow_willow

Grow = Callable[[np.random.Generator], tuple[Mesh, Mesh]]


@dataclass(frozen=True)
class Species:
    """A kind of tree.

    Attributes:
        name: also the stem of its mesh names.
        number: seeds the meshes; never change one that is in use.
        variants: how many different meshes there are.
        height_range: heights that a planted tree may have [m].
        grow: mesh generator, rng -> (wood, leaves).
        leaf_rgb: mean colour of the leaves.
        bark_rgb: colour of the wood.
        street: whether people walk under the crown: it starts at 2.5 m or
            higher.
    """

    name: str
    number: int
    variants: int
    height_range: tuple[float, float]
    grow: Grow
    leaf_rgb: tuple[float, float, float]
    bark_rgb: tuple[float, float, float] = (0.42, 0.34, 0.26)
    street: bool = True


_PLANE = BroadleafForm(
    height=11.0, crown_base=3.7, crown_radius=3.6,
    profile=(0.55, 0.9, 1.0, 0.98, 0.85, 0.6, 0.25), trunk_radius=0.22, limbs=8,
    clumps=47, clump_radius=0.92, leaf_length=0.57, leaf_width=0.4,
)  # fmt: skip
_LIME = BroadleafForm(
    height=9.0, crown_base=3.0, crown_radius=2.5,
    profile=(0.6, 0.92, 1.0, 0.95, 0.8, 0.6, 0.3), trunk_radius=0.16, limbs=7,
    clumps=40, clump_radius=0.75, leaf_length=0.46, leaf_width=0.34,
    raggedness=0.1,
)  # fmt: skip
_POPLAR = BroadleafForm(
    height=15.0, crown_base=3.3, crown_radius=1.5,
    profile=(0.5, 0.85, 1.0, 1.0, 0.92, 0.78, 0.55, 0.2), trunk_radius=0.2,
    limbs=9, clumps=44, clump_radius=0.75, leaf_length=0.46, leaf_width=0.32,
    raggedness=0.12,
)  # fmt: skip
_PINE = BroadleafForm(
    height=12.0, crown_base=6.2, crown_radius=3.3,
    profile=(0.35, 0.8, 1.0, 0.95, 0.6), trunk_radius=0.2, limbs=8, clumps=34,
    clump_radius=0.8, tufts_per_clump=4, leaves_per_tuft=5, leaf_length=0.62,
    leaf_width=0.24, raggedness=0.3, lean=0.9,
)  # fmt: skip
_YOUNG = BroadleafForm(
    height=5.6, crown_base=2.75, crown_radius=1.15,
    profile=(0.5, 0.95, 1.0, 0.75, 0.3), trunk_radius=0.06, limbs=5, clumps=18,
    clump_radius=0.42, leaf_length=0.32, leaf_width=0.23, lean=0.1,
)  # fmt: skip


def _grow_staked(rng: np.random.Generator) -> tuple[Mesh, Mesh]:
    """Returns a young tree tied to two stakes."""
    wood, crown = grow_broadleaf(rng, _YOUNG)
    stakes = [
        tube([(0, y, -1.2 * ROOT_DEPTH), (0, y, 1.75)], (0.04, 0.04), 5)
        for y in (-0.38, 0.38)
    ]
    tie = beam((0, -0.4, 1.55), (0, 0.4, 1.55), 0.03, 0.1)
    return merge_meshes(wood, *stakes, tie), crown


SPECIES = {
    species.name: species
    for species in (
        Species(
            "plane_tree", 1, 5, height_range=(8.5, 13.0),
            leaf_rgb=(0.36, 0.50, 0.24),
            grow=partial(grow_broadleaf, form=_PLANE),
        ),
        Species(
            "lime_tree", 2, 4, height_range=(7.8, 10.5),
            leaf_rgb=(0.30, 0.47, 0.22),
            grow=partial(grow_broadleaf, form=_LIME),
        ),
        Species(
            "poplar", 3, 3, height_range=(12.0, 18.0),
            leaf_rgb=(0.38, 0.52, 0.25),
            grow=partial(grow_broadleaf, form=_POPLAR),
        ),
        Species(
            "spruce", 4, 3, height_range=(8.0, 16.0), grow=grow_conifer,
            leaf_rgb=(0.20, 0.34, 0.22), street=False,
        ),
        Species(
            "pine", 5, 3, height_range=(9.0, 14.0), leaf_rgb=(0.26, 0.39, 0.23),
            bark_rgb=(0.48, 0.34, 0.25),
            grow=partial(grow_broadleaf, form=_PINE),
        ),
        Species(
            "young_tree", 6, 3, height_range=(5.2, 6.2), grow=_grow_staked,
            leaf_rgb=(0.42, 0.56, 0.28),
        ),
        Species(
            "palm", 7, 4, height_range=(6.5, 11.0), grow=grow_palm,
            leaf_rgb=(0.38, 0.50, 0.26), bark_rgb=(0.50, 0.42, 0.33),
        ),
        Species(
            "willow", 8, 3, height_range=(7.5, 11.0), grow=grow_willow,
            leaf_rgb=(0.44, 0.54, 0.28), street=False,
        ),
    )
}  # fmt: skip
