"""Paves narrow gaps between sidewalks, carriageways and walls.

Maps have footways beside streets as lines of a usual width. Between them and
the carriageway, the sidewalk of its tags, or a house, strips without any ground
remain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from cns_drake.imports.dressing.grounds import (
    KERB_HEIGHT,
    areas_of,
    near_drives,
)
from cns_drake.imports.dressing.upper_sides import looks_up, turned_up
from cns_drake.imports.drives.search import WaypointDrive
from cns_drake.imports.faces import flat_surface, parts_of
from cns_drake.imports.foreign_city import Imported, make_imported
from cns_drake.imports.options import ImportFaults

# Widest gap that is paved [m], and least area of one [m^2].
_WIDEST, _LEAST_AREA = 3.0, 0.05
# Narrower parts are left open; a gap is at most this far from a sidewalk [m].
_NARROWEST, _BESIDE = 0.1, 0.1
# Gaps in one square of this size are one structure [m].
_SQUARE = 50.0
_MM = 0.001


def paved_gaps(
    structures: Sequence[Imported], drives: Sequence[WaypointDrive]
) -> Iterator[Imported]:
    """Yields sidewalks in the gaps near drives.

    Args:
        structures: those of all stages, on level ground.
        drives: through the city.
    """
    near = near_drives(
        [one for one in structures if one.kind != "Tree"], drives
    )
    walks = [_flat_outline(one) for one in near if one.kind == "Sidewalk"]
    if not walks:
        return
    roads = [_flat_outline(one) for one in near if one.kind == "Road"]
    walks_tree = STRtree(walks)
    houses = [one for one in near if one.structure.semantic_class == "building"]
    roofs = _upper_sides(houses)
    beside = walks_tree.query(roofs, "dwithin", _WIDEST)[0]
    covered = shapely.union_all([*walks, *roads, *roofs[np.unique(beside)]])
    half = _WIDEST / 2.0
    closed = covered.buffer(half, 2).buffer(-half, 2)
    gaps = shapely.difference(closed, covered, grid_size=_MM)
    other = _upper_sides(
        [
            one
            for one in near
            if one.kind not in ("Sidewalk", "Road", "Crossing")
            and one not in houses
        ]
    )
    other_tree = STRtree(other)
    surfaces: dict[tuple[int, int], list[np.ndarray]] = {}
    for part in parts_of(gaps):
        if (
            part.area < _LEAST_AREA
            or not walks_tree.query(part, "dwithin", _BESIDE).size
        ):
            continue
        taken = shapely.union_all(
            other[other_tree.query(part, "intersects")], grid_size=_MM
        )
        free = areas_of(shapely.difference(part, taken, grid_size=_MM))
        inside = free.buffer(-_NARROWEST / 2.0, 2)
        wide = areas_of(inside.buffer(_NARROWEST / 2.0, 2))
        open_ = shapely.intersection(wide, free, grid_size=_MM)
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
        yield make_imported(
            f"sidewalk_gap_{number}",
            "sidewalk",
            "Sidewalk",
            {"surface": turned_up(np.concatenate(some))},
            {},
        )


def _upper_sides(structures: Sequence[Imported]) -> np.ndarray:
    """Returns the triangles that look up, or down, as polygons from above."""
    triangles = turned_up(
        np.concatenate(
            [np.zeros((0, 3, 3)), *(one.triangles for one in structures)]
        )
    )
    rings = np.round(triangles[looks_up(triangles)][:, [0, 1, 2, 0], :2], 3)
    return np.asarray(shapely.polygons(rings))


def _flat_outline(one: Imported) -> BaseGeometry:
    """Returns the area of a level structure from above."""
    return shapely.coverage_union_all(_upper_sides([one]))
