"""The lane file of an OpenStreetMap city."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.city import GRID
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.foreign_city import StreetPlaces
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.openstreetmap.signals import (
    junctions_with_signals,
    with_signals,
)
from cns_drake.imports.openstreetmap.street_lanes import (
    StreetTraffic,
    make_traffic_lanes,
)
from cns_drake.imports.openstreetmap.walkways import find_walkways
from cns_drake.imports.options import DriveOn
from cns_drake.imports.streets import Street
from cns_drake.traffic import LaneGraph, join_lanes, lane_text

# Traffic stays within this distance of drives [m].
_TRAFFIC_WITHIN = 300.0
# Ways through junctions must lie on streets within this distance of drives,
# because streets with traffic extend beyond the distance of traffic [m].
_SURFACE_WITHIN = 2.0 * _TRAFFIC_WITHIN
# Half the width that a vehicle needs around the middle of its lane [m].
_HALF_WIDTH = 1.3
# What ends below this height does not stop a vehicle [m].
_LOWEST_OBSTACLE = 0.3
# What begins above this height does not stop a vehicle [m].
_HIGHEST_OBSTACLE = 3.5


def lane_text_of_streets(
    streets: Sequence[Street],
    places: StreetPlaces,
    objects: Sequence[ImportedObject],
    added: Sequence[ImportedObject],
    drives: Sequence[WaypointRoute],
    drive_on: DriveOn,
) -> str | None:
    """Returns the text of a lane file; None if there is no lane to drive on.

    The file contains the streets within 300 m of the drives. The file also
    lists details, such as parked cars, that were added beside the streets and
    stand in a lane.

    Args:
        streets: streets from the imported file.
        places: crossings, traffic signals and footpaths.
        objects: objects from the imported file.
        added: objects that were added to the imported file.
        drives: the drives, near which there is traffic.
        drive_on: side of the road on which traffic keeps.
    """
    if not drives:
        return None
    paths = shapely.MultiLineString([drive.path for drive in drives])
    lines = [shapely.LineString(street.line) for street in streets]
    near = [
        street
        for street, line in zip(streets, lines, strict=True)
        if line.dwithin(paths, _TRAFFIC_WITHIN)
    ]
    if not near:
        return None
    walks = find_walkways(
        near, places.paths, places.crossed, _sidewalks(objects, paths)
    )
    surface = shapely.union_all(
        [
            line.buffer(street.width / 2.0, quad_segs=4)
            for street, line in zip(streets, lines, strict=True)
            if line.dwithin(paths, _SURFACE_WITHIN)
        ]
    )
    side = 1.0 if drive_on == "right" else -1.0
    traffic = make_traffic_lanes(near, set(walks.crossings), surface, side)
    free = _are_free(traffic, objects)
    right_of = traffic.beside
    if side < 0.0:
        right_of = {outer: inner for inner, outer in traffic.beside.items()}
    graph = join_lanes(
        traffic.lanes,
        [pair for pair in traffic.links if free[list(pair)].all()],
        right_of,
    )
    if not graph.pieces:
        return None
    graph = with_signals(
        graph, junctions_with_signals(traffic, near, places.signals)
    )
    graph = replace(graph, crossings=tuple(walks.crossings.values()))
    return lane_text(graph, walks.walkways, _in_the_way(graph, added))


def _sidewalks(
    objects: Iterable[ImportedObject], paths: BaseGeometry
) -> BaseGeometry:
    """Returns the area of sidewalks near drives in W [m].

    `paths` are the paths of the drives.
    """
    triangles = [
        one.triangles[:, :, :2]
        for one in objects
        if one.object_type == "Sidewalk"
    ]
    if not triangles:
        return shapely.Polygon()
    corners = np.round(np.concatenate(triangles), 3)
    flat = np.asarray(shapely.polygons(corners))
    near = shapely.dwithin(flat, paths, _TRAFFIC_WITHIN) & shapely.is_valid(
        flat
    )
    return shapely.union_all(flat[near], grid_size=GRID)


def _are_free(
    traffic: StreetTraffic, objects: Iterable[ImportedObject]
) -> np.ndarray:
    """Returns (L,) bool: which of L lanes no structure blocks."""
    solid = [
        one.triangles
        for one in objects
        if not one.is_ground
        and one.object_type not in ("Sidewalk", "Lane mark")
        and not one.object_type.startswith("Water")
    ]
    free = np.ones(len(traffic.lanes), bool)
    if not solid:
        return free
    triangles = np.concatenate(solid)
    z = triangles[:, :, 2]
    low = triangles[
        (z.max(axis=1) > _LOWEST_OBSTACLE) & (z.min(axis=1) < _HIGHEST_OBSTACLE)
    ]
    tree = shapely.STRtree(shapely.linearrings(low[:, [0, 1, 2, 0], :2]))
    strips = [_driven_area(lane.points) for lane in traffic.lanes]
    free[np.unique(tree.query(strips, "intersects")[0])] = False
    return free


def _driven_area(points: np.ndarray) -> BaseGeometry:
    """Returns the area that vehicles cover along the middle of a lane."""
    return shapely.LineString(points[:, :2]).buffer(
        _HALF_WIDTH, cap_style="flat", quad_segs=2
    )


def _in_the_way(graph: LaneGraph, added: Sequence[ImportedObject]) -> list[str]:
    """Returns the names of objects that stand where vehicles drive."""
    if not added:
        return []
    tree = shapely.STRtree(
        [_driven_area(piece.points) for piece in graph.pieces]
    )
    outlines = [one.structure.footprint_W for one in added]
    in_the_way = np.unique(tree.query(outlines, "intersects")[0])
    return [added[number].structure.name for number in in_the_way]
