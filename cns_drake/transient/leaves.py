"""Removes leaves of trees and shrubs, as in autumn."""

import numpy as np

from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.surroundings import Surroundings, change_rng

# Cause of these changes in the structure table.
_CAUSE = "leaves"
# Of a shrub without wood of its own, this share of the surface stays as twigs.
_TWIGS = 0.1


def thin_leaves(around: Surroundings, share: float) -> None:
    """Removes all leaves of vegetation, except for a share of them.

    Plants with the same mesh lose the same leaves of the mesh. These plants
    still look different, because each plant is rotated and scaled.
    """
    changed = False
    for plant in around.of_classes({"vegetation"}):
        leafy = [
            part
            for part in plant.parts
            if part.material.kind == "leaves" and len(part.triangles)
        ]
        left = share
        if len(leafy) == len(plant.parts):
            left = max(share, _TWIGS)
        for part in leafy:
            count = len(part.triangles)
            # The key is the size of the mesh, not its path, so that the result
            # does not depend on where the file is.
            order = change_rng(around.seed, _CAUSE, str(count)).permutation(
                count
            )
            around.editing.keep_triangles(
                part, np.sort(order[: round(left * count)])
            )
        if leafy:
            changed = True
            around.editing.record_cause(plant.name, _CAUSE)
    if not changed:
        around.editing.note(
            "leaves: no structure of class vegetation has leaves that are "
            "triangles"
        )


EFFECT = Effect("leaves", Phase.OBJECTS, thin_leaves, order=2)
