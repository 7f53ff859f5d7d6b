"""Sidewalks that fill gaps beside existing sidewalks."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.polygons import GRID
from cns_drake.imports.dressing.paving import (
    area_outside,
    near_drives,
    paved_structure,
    polygons_only,
    triangles_from_above,
)
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.faces import flat_surface, parts_of
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.streets import KERB_HEIGHT

# Width of the widest gap that is paved [m].
_WIDEST_GAP = 3.0
# Area of the smallest gap that is paved [m^2].
_SMALLEST_GAP = 0.05
# Parts of a gap that are narrower than this stay open [m].
_NARROWEST_GAP = 0.1
# A gap is at most this far from a sidewalk [m].
_GAP_WITHIN = 0.1
# All gaps in a square of this size are one structure [m].
_SQUARE = 50.0


def paved_gaps(
    objects: Sequence[ImportedObject], drives: Sequence[WaypointRoute]
) -> Iterator[ImportedObject]:
    """Yields sidewalks that fill gaps beside existing sidewalks.

    A gap is unpaved ground at most 3 m wide, such as the strip between a
    sidewalk and a building. Only gaps near the drives are filled. The ground
    must be level.
    """
    near = near_drives(
        [one for one in objects if one.object_type != "Tree"], drives
    )
    walks = [
        _flat_outline(one) for one in near if one.object_type == "Sidewalk"
    ]
    if not walks:
        return
    roads = [_flat_outline(one) for one in near if one.object_type == "Road"]
    walks_tree = STRtree(walks)
    houses = [one for one in near if one.structure.semantic_class == "building"]
    roofs = triangles_from_above(houses)
    beside = walks_tree.query(roofs, "dwithin", _WIDEST_GAP)[0]
    covered = shapely.union_all([*walks, *roads, *roofs[np.unique(beside)]])
    half = _WIDEST_GAP / 2.0
    closed = covered.buffer(half, 2).buffer(-half, 2)
    gaps = shapely.difference(closed, covered, grid_size=GRID)
    other = triangles_from_above(
        [
            one
            for one in near
            if one.object_type not in ("Sidewalk", "Road", "Crossing")
            and one not in houses
        ]
    )
    other_tree = STRtree(other)
    surfaces: dict[tuple[int, int], list[np.ndarray]] = {}
    for part in parts_of(gaps):
        if (
            part.area < _SMALLEST_GAP
            or not walks_tree.query(part, "dwithin", _GAP_WITHIN).size
        ):
            continue
        taken = shapely.union_all(
            other[other_tree.query(part, "intersects")], grid_size=GRID
        )
        free = area_outside(part, taken)
        inside = free.buffer(-_NARROWEST_GAP / 2.0, 2)
        wide = polygons_only(inside.buffer(_NARROWEST_GAP / 2.0, 2))
        open_ = shapely.intersection(wide, free, grid_size=GRID)
        square = (
            int(part.centroid.x // _SQUARE),
            int(part.centroid.y // _SQUARE),
        )
        surfaces.setdefault(square, []).extend(
            flat_surface(one, KERB_HEIGHT, "gap", ImportFaults())
            for one in parts_of(open_)
        )
    found = [some for some in surfaces.values() if some]
    for number, some in enumerate(found):
        surface = np.concatenate(some)
        yield paved_structure(f"sidewalk_gap_{number}", "sidewalk", surface)


def _flat_outline(one: ImportedObject) -> BaseGeometry:
    """Returns the area of a level structure, seen from above."""
    return shapely.coverage_union_all(triangles_from_above([one]))
