"""Areas and objects of the paving that is added near drives."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import MultiLineString, MultiPolygon
from shapely.geometry.base import BaseGeometry

from worlds.imports.drives.steerable_drives import WaypointRoute
from worlds.imports.faces import joined_triangles, parts_of
from worlds.imports.imported_objects import ImportedObject, make_object
from worlds.shapes import GRID, looks_up, turned_up

# Within this distance of drives, sidewalks get kerbs and missing ones are added
# [m].
PAVED_WITHIN = 80.0


def near_drives(
    objects: Sequence[ImportedObject], drives: Sequence[WaypointRoute]
) -> list[ImportedObject]:
    """Returns the objects that are at most 80 m from a drive."""
    paths = MultiLineString([drive.path for drive in drives])
    shapely.prepare(paths)
    outlines = [one.structure.model.footprint for one in objects]
    near = shapely.dwithin(np.array(outlines), paths, PAVED_WITHIN)
    return [one for one, is_near in zip(objects, near, strict=True) if is_near]


def paved_structure(
    name: str, semantic_class: str, surface: np.ndarray
) -> ImportedObject:
    """Returns a road or a sidewalk made of triangles (N, 3, 3) [m]."""
    object_type = semantic_class.capitalize()
    return make_object(
        name, semantic_class, object_type, {"surface": surface}, {}
    )


def polygons_only(geometry: BaseGeometry) -> MultiPolygon:
    """Returns the polygons of a geometry, without its lines and points."""
    return MultiPolygon(list(parts_of(geometry)))


def area_outside(area: BaseGeometry, other: BaseGeometry) -> MultiPolygon:
    """Returns the polygons of an area outside of another area."""
    return polygons_only(shapely.difference(area, other, grid_size=GRID))


def triangles_from_above(
    objects: Sequence[ImportedObject], *, with_downward: bool = True
) -> np.ndarray:
    """Returns triangles of objects as polygons (N,), seen from above [m].

    Vertical triangles are left out. Triangles that look downwards are left out
    only if `with_downward` is false.
    """
    triangles = joined_triangles(one.triangles for one in objects)
    if with_downward:
        triangles = turned_up(triangles)
    rings = np.round(triangles[looks_up(triangles)][:, [0, 1, 2, 0], :2], 3)
    return np.asarray(shapely.polygons(rings))
