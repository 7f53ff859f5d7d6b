"""Past cities, with former buildings in place of their successors."""

from collections.abc import Iterable, Sequence

import numpy as np
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from worlds.imports.imported_objects import ImportedObject

# Two buildings stand in the same place if they share this much of the smaller
# outline.
_LEAST_SHARED = 0.3


def with_former_buildings(
    former: Sequence[ImportedObject], others: Iterable[ImportedObject]
) -> list[ImportedObject]:
    """Returns the objects of a past city: `others`, and former buildings.

    Where a building of today stands in the place of a former building, the
    result contains only one of the two: the building of today if its year of
    construction is known, and otherwise the former building.

    Args:
        former: the former buildings, demolished at an unknown date.
        others: objects of today, which stood in the past city as well.
    """
    others = list(others)
    of_today = [other for other in others if other.is_building]
    outlines = [building.structure.model.footprint for building in of_today]
    tree = STRtree(outlines)
    stood: list[ImportedObject] = []
    replaced: set[ImportedObject] = set()
    for building in former:
        outline = building.structure.model.footprint
        successors = [
            of_today[k]
            for k in np.sort(tree.query(outline, "intersects"))
            if _are_in_same_place(outline, outlines[k])
        ]
        if any(successor.year is not None for successor in successors):
            continue
        stood.append(building)
        replaced.update(successors)
    return [other for other in others if other not in replaced] + stood


def _are_in_same_place(outline: BaseGeometry, other: BaseGeometry) -> bool:
    shared = outline.intersection(other).area
    return bool(shared > _LEAST_SHARED * min(outline.area, other.area))
