"""Single trees: a mesh variant of a species, scaled, turned and tinted."""

from __future__ import annotations

from functools import cache, partial
import string

import numpy as np

from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.object_parts import Builder, assemble, triple
from cns_drake.city.geometry.structures import MeshShape, Model, Part
from cns_drake.city.plants.tree_species import SPECIES

# Species that may stand on a sidewalk.
STREET_TREES = tuple(s.name for s in SPECIES.values() if s.street)

_SEED = 7001


@cache
def tree_meshes(species: str, variant: int) -> dict[str, Mesh]:
    """Returns the wood and leaf meshes of a variant by their names."""
    kind = SPECIES[species]
    rng = np.random.default_rng([_SEED, kind.number, variant])
    wood, crown = kind.grow(rng)
    stem = f"{species}_{string.ascii_lowercase[variant]}"
    return {f"{stem}_wood": wood, f"{stem}_crown": crown}


def tree(
    rng: np.random.Generator,
    *,
    species: str,
    height: float | None = None,
    variant: int | None = None,
) -> Model:
    """Returns one tree.

    Args:
        rng: draws whatever is not given.
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
    meshes = tree_meshes(species, variant)
    up = height / max(m.vertices[:, 2].max() for m in meshes.values())
    # Tall trees are wider too, but less than in proportion.
    across = up**0.7 * stretch
    scale = triple(round(float(s), 3) for s in (*across, up))
    wood, crown = meshes
    rgb = np.clip(kind.leaf_rgb * tint, 0, 1)
    rpy = (0.0, 0.0, round(yaw, 3))
    parts = (
        Part("wood", MeshShape(wood, scale), rpy=rpy, rgb=kind.bark_rgb),
        Part(
            "crown",
            MeshShape(crown, scale),
            rpy=rpy,
            rgb=triple(round(float(c), 3) for c in rgb),
        ),
    )
    return assemble(*parts, meshes=meshes)


TREES = {
    name: Builder("vegetation", partial(tree, species=name)) for name in SPECIES
}
