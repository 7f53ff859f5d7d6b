"""Carriageways and sidewalks along drives, where a file has no roads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import MultiLineString, Polygon
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
from cns_drake.imports.ground import Ground
from cns_drake.imports.options import ImportFaults

# Half of the width of a street of unknown width, and width of its sidewalks
# [m].
HALF_STREET = 3.9
_SIDEWALK = 2.0
# A carriageway ends before walls; narrower sidewalks are left out [m].
_FROM_WALL, _NARROWEST = 0.5, 0.6
# Height of a carriageway above the ground, which it covers [m].
_ABOVE = 0.02
_MM = 0.001


def guessed_streets(
    structures: Sequence[Imported],
    drives: Sequence[WaypointDrive],
    ground: Ground,
) -> Iterator[Imported]:
    """Yields a carriageway and sidewalks on the ground below drives.

    Args:
        structures: those of all stages, without roads.
        drives: through the city, in the middle of its streets.
        ground: below it.
    """
    paths = MultiLineString([drive.path for drive in drives]).simplify(0.05)
    near = near_drives(structures, drives)
    walls = _area(
        [one for one in near if one.structure.semantic_class == "building"],
        paths.buffer(HALF_STREET + _SIDEWALK + _FROM_WALL),
    )
    street = areas_of(
        shapely.difference(
            paths.buffer(HALF_STREET, 4),
            walls.buffer(_FROM_WALL, 1),
            grid_size=_MM,
        )
    )
    beside = areas_of(
        shapely.difference(
            paths.buffer(HALF_STREET + _SIDEWALK, 4), street, grid_size=_MM
        )
    )
    beside = areas_of(shapely.difference(beside, walls, grid_size=_MM))
    half = _NARROWEST / 2.0
    wide = beside.buffer(-half, 2).buffer(half, 2)
    sidewalks = wide.intersection(beside)
    terrain = [one.triangles for one in structures if one.kind == "TINRelief"]
    if terrain:
        below = turned_up(np.concatenate(terrain))
    else:
        mesh = ground.to_mesh()
        below = mesh.vertices[mesh.triangles()]
        heights = ground.height(below.reshape(-1, 3)[:, :2])
        below[..., 2] = heights.reshape(below.shape[:2])
    below = below[looks_up(below)]
    outlines = np.asarray(shapely.polygons(below[:, [0, 1, 2, 0], :2]))
    tree = shapely.STRtree(outlines)
    for name, kind, semantic_class, area, above in (
        ("carriageway", "Road", "road", street, _ABOVE),
        ("sidewalk", "Sidewalk", "sidewalk", sidewalks, KERB_HEIGHT),
    ):
        for number, part in enumerate(parts_of(area)):
            hit = np.sort(tree.query(part, "intersects"))
            surface = _laid(part, below[hit], outlines[hit], above)
            if len(surface):
                yield make_imported(
                    f"{name}_{number}",
                    semantic_class,
                    kind,
                    {"surface": surface},
                    {},
                )


def _area(structures: Sequence[Imported], near: BaseGeometry) -> BaseGeometry:
    """Returns the area of structures near a place, from above."""
    triangles = np.concatenate(
        [np.zeros((0, 3, 3)), *(one.triangles for one in structures)]
    )
    triangles = triangles[looks_up(triangles)]
    rings = np.round(triangles[:, [0, 1, 2, 0], :2], 3)
    polygons = np.asarray(shapely.polygons(rings))
    shapely.prepare(near)
    return shapely.union_all(
        polygons[shapely.intersects(near, polygons)], grid_size=_MM
    )


def _laid(
    area: BaseGeometry, ground: np.ndarray, outlines: np.ndarray, above: float
) -> np.ndarray:
    """Returns an area laid on a ground, as triangles (N, 3, 3) [m].

    Args:
        area: from above.
        ground: triangles (M, 3, 3) that look upwards and meet it [m].
        outlines: (M,) theirs from above.
        above: height above it [m].
    """
    pieces = shapely.intersection(outlines, area, grid_size=_MM)
    whole = np.isclose(
        shapely.area(pieces), shapely.area(shapely.convex_hull(pieces)), 1e-6
    )
    found = [np.zeros((0, 3, 3))]
    for triangle, piece, is_convex in zip(ground, pieces, whole, strict=True):
        a, b, c = triangle
        normal = np.cross(b - a, c - a)
        for part in parts_of(piece):
            flat = _fan(part) if is_convex else _filled(part)
            aside = (flat - a)[..., :2] @ normal[:2]
            flat[..., 2] = a[2] - aside / normal[2] + above
            found.append(flat)
    return turned_up(np.concatenate(found))


def _filled(area: Polygon) -> np.ndarray:
    return flat_surface(area, 0.0, "street", ImportFaults())


def _fan(area: Polygon) -> np.ndarray:
    """Returns a convex area as triangles (N, 3, 3) at height 0 [m]."""
    corners = np.array(area.exterior.coords)[:-1, :2]
    fan = np.zeros((len(corners) - 2, 3, 3))
    fan[:, 0, :2] = corners[0]
    fan[:, 1, :2], fan[:, 2, :2] = corners[1:-1], corners[2:]
    sides = fan[:, 1:, :2] - fan[:, :1, :2]
    return fan[np.abs(np.linalg.det(sides)) > _MM * _MM]
