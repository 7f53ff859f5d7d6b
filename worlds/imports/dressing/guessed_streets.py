"""Carriageways and sidewalks along drives, for a city without roads."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry

from evaluation.base import dot
from worlds.imports.dressing.paving import (
    area_outside,
    near_drives,
    paved_structure,
    triangles_from_above,
)
from worlds.imports.drives.steerable_drives import WaypointRoute
from worlds.imports.faces import flat_surface, joined_triangles, parts_of
from worlds.imports.faults import ImportFaults
from worlds.imports.ground import Ground
from worlds.imports.imported_objects import ImportedObject
from worlds.imports.streets import KERB_HEIGHT, SIDEWALK_WIDTH
from worlds.shapes import GRID, looks_up, turned_up

# Half the width of a street of unknown width [m].
HALF_STREET = 3.9
# A carriageway ends this far from walls [m].
_FROM_WALL = 0.5
# Sidewalks narrower than this are left out [m].
_NARROWEST_SIDEWALK = 0.6
# A carriageway is this far above the ground that it covers [m].
_ABOVE_GROUND = 0.02
# Greatest deviation of the middle of a street from the drive [m].
_PATH_TOLERANCE = 0.05


def guessed_streets(
    objects: Sequence[ImportedObject],
    drives: Sequence[WaypointRoute],
    ground: Ground,
) -> Iterator[ImportedObject]:
    """Yields objects for a carriageway and sidewalks along drives.

    Use this function for a city whose file has no roads: the drives are assumed
    to be in the middle of the streets.

    Args:
        objects: objects of the city. Buildings stay free, and streets lie
            on the terrain.
        drives: the drives, at least one.
        ground: the ground, on which streets lie in a city without terrain.
    """
    street, sidewalks = _areas_along(objects, drives)
    below = _upper_sides_of_ground(objects, ground)
    outlines = np.asarray(shapely.polygons(below[:, [0, 1, 2, 0], :2]))
    tree = shapely.STRtree(outlines)
    for name, semantic_class, area, above in (
        ("carriageway", "road", street, _ABOVE_GROUND),
        ("sidewalk", "sidewalk", sidewalks, KERB_HEIGHT),
    ):
        for number, part in enumerate(parts_of(area)):
            covered = np.sort(tree.query(part, "intersects"))
            surface = _draped(part, below[covered], outlines[covered], above)
            if len(surface):
                yield paved_structure(
                    f"{name}_{number}", semantic_class, surface
                )


def _areas_along(
    objects: Sequence[ImportedObject], drives: Sequence[WaypointRoute]
) -> tuple[BaseGeometry, BaseGeometry]:
    """Returns the areas in W of carriageways and sidewalks along drives [m].

    Carriageways keep a distance from the buildings among the objects, and
    sidewalks reach up to their walls.
    """
    lines = MultiLineString([drive.path for drive in drives])
    paths = lines.simplify(_PATH_TOLERANCE)
    near = near_drives(objects, drives)
    houses = [o for o in near if o.structure.semantic_class == "building"]
    roofs = triangles_from_above(houses, with_downward=False)
    reach = paths.buffer(HALF_STREET + SIDEWALK_WIDTH + _FROM_WALL)
    shapely.prepare(reach)
    roofs = roofs[shapely.intersects(reach, roofs)]
    walls = shapely.union_all(roofs, grid_size=GRID)
    street = area_outside(
        paths.buffer(HALF_STREET, quad_segs=4),
        walls.buffer(_FROM_WALL, quad_segs=1),
    )
    whole = paths.buffer(HALF_STREET + SIDEWALK_WIDTH, quad_segs=4)
    beside = area_outside(area_outside(whole, street), walls)
    half = _NARROWEST_SIDEWALK / 2.0
    wide = beside.buffer(-half, quad_segs=2).buffer(half, quad_segs=2)
    return street, wide.intersection(beside)


def _upper_sides_of_ground(
    objects: Sequence[ImportedObject], ground: Ground
) -> np.ndarray:
    """Returns the ground as triangles (M, 3, 3) that look upwards [m].

    This is the terrain among the objects or, without a terrain, `ground`.
    """
    terrain = (one for one in objects if one.object_type == "TINRelief")
    triangles = turned_up(joined_triangles(one.triangles for one in terrain))
    if not len(triangles):
        mesh = ground.to_mesh()
        triangles = mesh.vertices[mesh.triangles()]
        heights = ground.height(triangles.reshape(-1, 3)[:, :2])
        triangles[..., 2] = heights.reshape(triangles.shape[:2])
    return np.asarray(triangles[looks_up(triangles)])


def _draped(
    area: BaseGeometry, ground: np.ndarray, outlines: np.ndarray, above: float
) -> np.ndarray:
    """Returns an area laid above a ground, as triangles (N, 3, 3) [m].

    The triangles (M, 3, 3) of the ground look upwards and meet the area.
    `outlines` (M,) are these triangles seen from above.
    """
    pieces = shapely.intersection(outlines, area, grid_size=GRID)
    draped = [np.zeros((0, 3, 3))]
    for triangle, piece in zip(ground, pieces, strict=True):
        a, b, c = triangle
        normal = np.cross(b - a, c - a)
        for part in parts_of(piece):
            flat = flat_surface(part, 0.0, "street", ImportFaults())
            aside = dot((flat - a)[..., :2], normal[:2])
            flat[..., 2] = a[2] - aside / normal[2] + above
            draped.append(flat)
    return np.concatenate(draped)
