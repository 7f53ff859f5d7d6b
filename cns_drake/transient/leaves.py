"""Crowns that have lost leaves."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cns_drake.scene.surfaces import TriangleSurface
from cns_drake.transient.draws import draws
from cns_drake.transient.scene_editing import SceneEditing
from cns_drake.transient.standing import Standing, StandingPart

CAUSE = "leaves"
_LEAVES = ("crown", "lea", "foliage", "canopy", "plants", "hedge")
# Share of the surface of a shrub without separate wood that stays, as twigs.
_TWIGS = 0.1


def thin_leaves(
    editing: SceneEditing, things: Mapping[str, Standing], part: float,
    seed: int,
) -> None:  # fmt: skip
    """Takes leaves off all vegetation.

    Plants of one mesh lose the same leaves of it; turned and stretched as
    they are, they differ.

    Args:
        editing: of the world.
        things: all structures.
        part: share of leaves that stay, from 0 to 1.
        seed: of their choice.
    """
    plants = [t for t in things.values() if t.semantic_class == "vegetation"]
    changed = False
    for plant in plants:
        leafy = [one for one in plant.parts if _is_leafy(one)]
        left = part
        if len(leafy) == len(plant.parts):
            left = max(part, _TWIGS)
        for one in leafy:
            changed = True
            _thin(editing, one, left, seed)
        if leafy:
            editing.blame(plant.name, CAUSE)
    if not changed:
        editing.note(
            "leaves: no structure of class vegetation has leaves that are "
            "triangles"
        )


def _thin(
    editing: SceneEditing, part: StandingPart, left: float, seed: int
) -> None:
    surface = part.geometry.surface
    assert isinstance(surface, TriangleSurface)
    count = len(surface.triangles)
    # The key is the mesh's size, not its file, whose place must not matter.
    order = draws(seed, CAUSE, str(count)).permutation(count)
    editing.replace_triangles(part, np.sort(order[: round(left * count)]))


def _is_leafy(part: StandingPart) -> bool:
    """Returns whether a part is leaves and not wood, by name or by colour."""
    if not isinstance(part.geometry.surface, TriangleSurface):
        return False
    name = part.name.lower()
    if any(word in name for word in _LEAVES):
        return True
    r, g, b = part.geometry.rgb or (0.0, 0.0, 0.0)
    return g > 1.1 * r and g > 1.1 * b
