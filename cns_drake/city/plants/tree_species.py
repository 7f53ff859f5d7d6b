"""The species of trees: their sizes and colours."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Species:
    """A kind of tree.

    Attributes:
        variants: how many different meshes there are.
        height_range: heights that a planted tree may have [m].
        leaf_rgb: mean colour of the leaves.
        bark_rgb: colour of the wood.
        street: whether people walk under the crown: it starts at 2.5 m or
            higher.
    """

    variants: int
    height_range: tuple[float, float]
    leaf_rgb: tuple[float, float, float]
    bark_rgb: tuple[float, float, float] = (0.42, 0.34, 0.26)
    street: bool = True


# By the stems of their meshes' names.
SPECIES = {
    "plane_tree": Species(5, (8.5, 13.0), (0.36, 0.50, 0.24)),
    "lime_tree": Species(4, (7.8, 10.5), (0.30, 0.47, 0.22)),
    "poplar": Species(3, (12.0, 18.0), (0.38, 0.52, 0.25)),
    "spruce": Species(3, (8.0, 16.0), (0.20, 0.34, 0.22), street=False),
    "pine": Species(3, (9.0, 14.0), (0.26, 0.39, 0.23), (0.48, 0.34, 0.25)),
    "young_tree": Species(3, (5.2, 6.2), (0.42, 0.56, 0.28)),
    "palm": Species(4, (6.5, 11.0), (0.38, 0.50, 0.26), (0.50, 0.42, 0.33)),
    "willow": Species(3, (7.5, 11.0), (0.44, 0.54, 0.28), street=False),
}
