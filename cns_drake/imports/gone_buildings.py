"""Demolished buildings, and their successors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from cns_drake.imports.foreign_city import Imported

# A building that shares so much of the smaller outline stands in the place of
# the other.
_SHARED = 0.3


def with_gone(
    gone: Sequence[Imported], others: Iterable[Imported]
) -> list[Imported]:
    """Returns what stood together, of what is gone and what stands today.

    Where both have the same place, a building of today that has a year was
    there already, and what it replaced was not; one without a year came
    later.

    Args:
        gone: demolished buildings.
        others: present structures that may have stood then.
    """
    others = list(others)
    later = [one for one in others if one.kind.startswith("Building")]
    tree = STRtree([one.structure.model.footprint for one in later])
    stood: list[Imported] = []
    replaced: set[Imported] = set()
    for one in gone:
        outline = one.structure.model.footprint
        there = [
            later[k]
            for k in np.sort(tree.query(outline, "intersects"))
            if _shares(outline, later[k].structure.model.footprint)
        ]
        if any(new.year is not None for new in there):
            continue
        stood.append(one)
        replaced.update(there)
    return [one for one in others if one not in replaced] + stood


def _shares(one: BaseGeometry, other: BaseGeometry) -> bool:
    shared = one.intersection(other).area
    return bool(shared > _SHARED * min(one.area, other.area))
