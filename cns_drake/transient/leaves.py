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
# Of a shrub without wood of its own, twigs stay: so much of its surface.
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
        things: all that stands.
        part: of the leaves that stay, from 0 to 1.
        seed: of which.
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
    # By its size and not by its file, whose place does not matter.
    order = draws(seed, CAUSE, str(count)).permutation(count)
    editing.replace_triangles(part, np.sort(order[: round(left * count)]))


def _is_leafy(part: StandingPart) -> bool:
    """Tells leaves from wood, by their names or else by their colour."""
    if not isinstance(part.geometry.surface, TriangleSurface):
        return False
    name = part.name.lower()
    if any(word in name for word in _LEAVES):
        return True
    r, g, b = part.geometry.rgb or (0.0, 0.0, 0.0)
    return g > 1.1 * r and g > 1.1 * b
