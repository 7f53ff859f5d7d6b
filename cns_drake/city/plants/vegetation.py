"""Single trees: a mesh variant of a species, scaled, turned and tinted."""

from __future__ import annotations

from functools import partial
import string

import numpy as np

from cns_drake.city.geometry.object_meshes import object_mesh
from cns_drake.city.geometry.object_parts import Builder, assemble, triple
from cns_drake.city.geometry.structures import MeshShape, Model, Part
from cns_drake.city.plants.tree_species import SPECIES

# Species that may stand on a sidewalk.
STREET_TREES = tuple(name for name, kind in SPECIES.items() if kind.street)


def mesh_names(species: str, variant: int) -> tuple[str, str]:
    """Returns the names of the wood and the leaves of a variant."""
    stem = f"{species}_{string.ascii_lowercase[variant]}"
    return f"{stem}_wood", f"{stem}_crown"


def tree(
    rng: np.random.Generator,
    *,
    species: str,
    height: float | None = None,
    variant: int | None = None,
) -> Model:
    """Returns one tree.

    Args:
        rng: draws each value that is not given.
        species: a key of `SPECIES`.
        height: of the top, within the species' range for the promised
            clearance below the crown [m].
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
    names = wood, crown = mesh_names(species, variant)
    up = height / max(object_mesh(n).vertices[:, 2].max() for n in names)
    # Tall trees are wider too, but less than in proportion.
    across = up**0.7 * stretch
    scale = triple(round(float(s), 3) for s in (*across, up))
    rgb = np.clip(kind.leaf_rgb * tint, 0, 1)
    rpy = (0.0, 0.0, round(yaw, 3))
    return assemble(
        Part("wood", MeshShape(wood, scale), rpy=rpy, rgb=kind.bark_rgb),
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
