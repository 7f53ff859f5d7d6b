"""Past cities, with former buildings in place of their successors."""

from collections.abc import Iterable, Sequence

import numpy as np
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from cns_drake.imports.imported_objects import ImportedObject

# Two buildings stand in the same place if they share this much of the smaller
# outline.
_SHARED = 0.3


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
    later = [one for one in others if one.is_building]
    tree = STRtree([one.structure.model.footprint for one in later])
    stood: list[ImportedObject] = []
    replaced: set[ImportedObject] = set()
    for one in former:
        outline = one.structure.model.footprint
        there = [
            later[k]
            for k in np.sort(tree.query(outline, "intersects"))
            if _are_in_same_place(outline, later[k].structure.model.footprint)
        ]
        if any(new.year is not None for new in there):
            continue
        stood.append(one)
        replaced.update(there)
    return [one for one in others if one not in replaced] + stood


def _are_in_same_place(one: BaseGeometry, other: BaseGeometry) -> bool:
    shared = one.intersection(other).area
    return bool(shared > _SHARED * min(one.area, other.area))
