"""Sidewalks for streets whose tags do not mention sidewalks."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, MultiLineString
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.polygons import GRID
from cns_drake.imports.dressing.paving import (
    PAVED_WITHIN,
    area_outside,
    near_drives,
    paved_structure,
    triangles_from_above,
)
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.faces import flat_surface, parts_of
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.streets import KERB_HEIGHT, SIDEWALK_WIDTH, Street

# Pieces of a sidewalk are left out if no circle of this radius fits in [m].
_SLIVER_RADIUS = 0.3
# Streets of these kinds have sidewalks unless their tags say otherwise.
_WITH_SIDEWALKS = (
    "primary",
    "secondary",
    "tertiary",
    "unclassified",
    "residential",
)


def missing_sidewalks(
    objects: Sequence[ImportedObject],
    streets: Sequence[Street],
    drives: Sequence[WaypointRoute],
) -> Iterator[ImportedObject]:
    """Yields sidewalks for streets whose tags do not mention sidewalks.

    Only the larger streets within 80 m of a drive get sidewalks. The ground
    must be level.

    Args:
        objects: objects of the city, which the sidewalks must not overlap.
        streets: the streets.
        drives: the drives, at least one.
    """
    paths = MultiLineString([drive.path for drive in drives])
    near = [
        (street, LineString(street.line))
        for street in streets
        if LineString(street.line).distance(paths) < PAVED_WITHIN
    ]
    lacking = [
        (street, line)
        for street, line in near
        if street.tags.get("highway") in _WITH_SIDEWALKS
        and not any(key.startswith("sidewalk") for key in street.tags)
    ]
    if not lacking:
        return
    carriageways = [
        line.buffer(street.width / 2.0, quad_segs=4) for street, line in near
    ]
    obstacles = _obstacles(near_drives(objects, drives))
    taken = np.concatenate([obstacles, carriageways])
    # The union of a whole city takes long, so only polygons near each street
    # are used.
    tree = STRtree(taken)
    sidewalks: list[BaseGeometry] = []
    for street, line in lacking:
        reach = street.width / 2.0 + SIDEWALK_WIDTH
        strip = line.buffer(reach, quad_segs=4)
        others = [
            *taken[tree.query(strip, "intersects")],
            *(area for area in sidewalks if area.intersects(strip)),
        ]
        covered = shapely.union_all(others, grid_size=GRID)
        sidewalk = area_outside(strip, covered)
        sidewalks.append(sidewalk)
        surface = [
            flat_surface(part, KERB_HEIGHT, street.name, ImportFaults())
            for part in parts_of(sidewalk)
            if not part.buffer(-_SLIVER_RADIUS).is_empty
        ]
        if surface:
            laid = np.concatenate(surface)
            yield paved_structure(f"sidewalk_{street.name}", "sidewalk", laid)


def _obstacles(objects: Iterable[ImportedObject]) -> np.ndarray:
    """Returns the areas (N,) that no sidewalk may cover, in W [m]."""
    return triangles_from_above(
        [
            one
            for one in objects
            if one.structure.semantic_class in ("building", "road", "sidewalk")
            or one.object_type.startswith("Water")
        ]
    )
