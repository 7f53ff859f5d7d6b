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
        [imported for imported in objects if imported.object_type != "Tree"],
        drives,
    )
    walks = [
        _flat_outline(imported)
        for imported in near
        if imported.object_type == "Sidewalk"
    ]
    if not walks:
        return
    walks_tree = STRtree(walks)
    gaps = _gaps_beside(walks, walks_tree, near)
    obstacles = triangles_from_above(
        [
            imported
            for imported in near
            if imported.object_type not in ("Sidewalk", "Road", "Crossing")
            and imported.structure.semantic_class != "building"
        ]
    )
    obstacles_tree = STRtree(obstacles)
    surfaces: dict[tuple[int, int], list[np.ndarray]] = {}
    for gap in parts_of(gaps):
        if (
            gap.area < _SMALLEST_GAP
            or not walks_tree.query(gap, "dwithin", _GAP_WITHIN).size
        ):
            continue
        taken = shapely.union_all(
            obstacles[obstacles_tree.query(gap, "intersects")], grid_size=GRID
        )
        square = (
            int(gap.centroid.x // _SQUARE),
            int(gap.centroid.y // _SQUARE),
        )
        surfaces.setdefault(square, []).extend(
            flat_surface(part, KERB_HEIGHT, "gap", ImportFaults())
            for part in parts_of(_wide_parts(area_outside(gap, taken)))
        )
    filled = [of_square for of_square in surfaces.values() if of_square]
    for number, of_square in enumerate(filled):
        surface = np.concatenate(of_square)
        yield paved_structure(f"sidewalk_gap_{number}", "sidewalk", surface)


def _gaps_beside(
    walks: Sequence[BaseGeometry],
    walks_tree: STRtree,
    objects: Sequence[ImportedObject],
) -> BaseGeometry:
    """Returns the narrow gaps between sidewalks, roads and buildings in W [m].

    Args:
        walks: areas of the sidewalks [m].
        walks_tree: search tree of these areas.
        objects: objects of the city, which include roads and buildings.
    """
    roads = [
        _flat_outline(imported)
        for imported in objects
        if imported.object_type == "Road"
    ]
    houses = [o for o in objects if o.structure.semantic_class == "building"]
    roofs = triangles_from_above(houses)
    beside = walks_tree.query(roofs, "dwithin", _WIDEST_GAP)[0]
    covered = shapely.union_all([*walks, *roads, *roofs[np.unique(beside)]])
    half = _WIDEST_GAP / 2.0
    closed = covered.buffer(half, quad_segs=2).buffer(-half, quad_segs=2)
    return shapely.difference(closed, covered, grid_size=GRID)


def _wide_parts(area: BaseGeometry) -> BaseGeometry:
    """Returns an area without the parts that are too narrow to be paved."""
    half = _NARROWEST_GAP / 2.0
    inside = area.buffer(-half, quad_segs=2)
    wide = polygons_only(inside.buffer(half, quad_segs=2))
    return shapely.intersection(wide, area, grid_size=GRID)


def _flat_outline(imported: ImportedObject) -> BaseGeometry:
    """Returns the area of a level structure, seen from above."""
    return shapely.coverage_union_all(triangles_from_above([imported]))
