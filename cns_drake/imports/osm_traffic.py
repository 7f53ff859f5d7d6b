"""Lanes, signals, crossings and walkways of OpenStreetMap, for traffic."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base.angles import wrapped
from cns_drake.imports.foreign_city import Imported, StreetPlaces
from cns_drake.imports.import_report import DriveOn
from cns_drake.imports.street_lanes import Street
from cns_drake.imports.street_traffic import StreetTraffic
from cns_drake.imports.street_walkways import StreetWalkways
from cns_drake.imports.waypoint_drives import WaypointDrive
from cns_drake.traffic.lane_file import lane_text
from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.lane_joining import join_lanes

# Traffic keeps to the streets near drives [m].
_WITHIN = 300.0
# Half of the room of a vehicle beside the middle of its lane [m].
_HALF_WIDTH = 1.3
# A signal stands within this distance of its junction, and a way of the
# junction passes it within this distance [m].
_SIGNAL_NEAR, _WAY_NEAR = 25.0, 6.0
_KERB = 0.12
# A height above which things do not stop a vehicle, and below [m].
_ABOVE, _BELOW = 0.3, 3.5


def lanes_of_streets(
    streets: Sequence[Street],
    places: StreetPlaces,
    structures: Sequence[Imported],
    added: Sequence[Imported],
    drives: Sequence[WaypointDrive],
    drive_on: DriveOn,
) -> str | None:
    """Returns the text of a file of lanes; None if no vehicle can drive on.

    Args:
        streets: of the file.
        places: signals, crossings and paths.
        structures: of the city.
        added: parked cars and other things that were put beside the streets;
            those that stand in a lane are named in the file.
        drives: traffic keeps to the streets near them.
        drive_on: the side of the streets on which traffic keeps.
    """
    if not drives:
        return None
    paths = shapely.MultiLineString([drive.path for drive in drives])
    lines = [shapely.LineString(street.line) for street in streets]
    near = [
        street
        for street, line in zip(streets, lines, strict=True)
        if line.dwithin(paths, _WITHIN)
    ]
    if not near:
        return None
    walks = StreetWalkways(
        near,
        places.paths,
        places.crossed,
        _sidewalks(structures, paths),
        _KERB,
    )
    surface = shapely.union_all(
        [
            line.buffer(street.width / 2.0, 4)
            for street, line in zip(streets, lines, strict=True)
            if line.dwithin(paths, 2.0 * _WITHIN)
        ]
    )
    side = 1.0 if drive_on is DriveOn.RIGHT else -1.0
    traffic = StreetTraffic(near, set(walks.crossings), surface, side)
    free = _free(traffic, structures)
    outer = traffic.beside
    graph = join_lanes(
        traffic.lanes,
        [pair for pair in traffic.links if free[list(pair)].all()],
        outer if side > 0 else {b: a for a, b in outer.items()},
    )
    if not graph.pieces:
        return None
    graph = _with_signals(graph, _signals(traffic, near, places.signals))
    graph = replace(graph, crossings=tuple(walks.crossings.values()))
    return lane_text(graph, walks.walkways, _in_the_way(graph, added))


def _sidewalks(
    structures: Iterable[Imported], paths: BaseGeometry
) -> BaseGeometry:
    """Returns the area of sidewalks near drives."""
    triangles = [
        one.triangles[:, :, :2] for one in structures if one.kind == "Sidewalk"
    ]
    if not triangles:
        return shapely.Polygon()
    corners = np.round(np.concatenate(triangles), 3)
    flat = np.asarray(shapely.polygons(corners))
    near = shapely.dwithin(flat, paths, _WITHIN) & shapely.is_valid(flat)
    return shapely.union_all(flat[near], grid_size=0.001)


def _free(traffic: StreetTraffic, structures: Iterable[Imported]) -> np.ndarray:
    """Returns which lanes nothing of the file stands in, (L,) bool."""
    solid = [
        one.triangles
        for one in structures
        if not one.is_ground
        and one.kind not in ("Sidewalk", "Lane mark")
        and not one.kind.startswith("Water")
    ]
    free = np.ones(len(traffic.lanes), bool)
    if not solid:
        return free
    triangles = np.concatenate(solid)
    z = triangles[:, :, 2]
    low = triangles[(z.max(axis=1) > _ABOVE) & (z.min(axis=1) < _BELOW)]
    tree = shapely.STRtree(shapely.linearrings(low[:, [0, 1, 2, 0], :2]))
    strips = [_strip(lane.points) for lane in traffic.lanes]
    free[np.unique(tree.query(strips, "intersects")[0])] = False
    return free


def _strip(points: np.ndarray) -> BaseGeometry:
    return shapely.LineString(points[:, :2]).buffer(
        _HALF_WIDTH, cap_style="flat", quad_segs=2
    )


def _in_the_way(graph: LaneGraph, added: Sequence[Imported]) -> list[str]:
    """Returns the names of things that stand where vehicles drive."""
    if not added:
        return []
    tree = shapely.STRtree([_strip(piece.points) for piece in graph.pieces])
    outlines = [one.structure.footprint_W for one in added]
    hit = np.unique(tree.query(outlines, "intersects")[0])
    return [added[k].structure.name for k in hit]


def _signals(
    traffic: StreetTraffic, streets: Iterable[Street], signals: np.ndarray
) -> list[BaseGeometry]:
    """Returns the places (2,) of junctions with signals."""
    if not len(signals):
        return []
    places = {
        node: street.line[k]
        for street in streets
        for k, node in enumerate(street.nodes)
    }
    junctions = shapely.points([places[n] for n in traffic.junctions()])
    if not len(junctions):
        return []
    pairs = shapely.STRtree(junctions).query_nearest(
        shapely.points(signals), max_distance=_SIGNAL_NEAR
    )
    return list(junctions[np.unique(pairs[1])])


def _with_signals(
    graph: LaneGraph, signals: Sequence[BaseGeometry]
) -> LaneGraph:
    """Returns lanes with signals of two phases at some junctions.

    One phase is along the way on which a junction is entered first, the other
    across it.
    """
    ways = [k for k, piece in enumerate(graph.pieces) if piece.is_way]
    if not signals or not ways:
        return graph
    lines = [shapely.LineString(graph.pieces[k].points[:, :2]) for k in ways]
    near = shapely.STRtree(signals).query(lines, "dwithin", _WAY_NEAR)
    # Lanes that never cross have junctions of their own; signals join them.
    group = {k: k for k in range(len(graph.phases))}
    controlled: dict[int, int] = {}
    for k, signal in near.T.tolist():
        junction = graph.pieces[ways[k]].junction
        first = group[controlled.setdefault(signal, junction)]
        joined = group[junction]
        group = {a: first if b == joined else b for a, b in group.items()}
    switched = {group[k] for k in controlled.values()}
    pieces = list(graph.pieces)
    axes: dict[int, float] = {}
    phases = list(graph.phases)
    for k, piece in enumerate(pieces):
        junction = group[piece.junction]
        pieces[k] = replace(piece, junction=junction)
        if not piece.is_way or junction not in switched:
            continue
        step = piece.points[1] - piece.points[0]
        heading = float(np.arctan2(step[1], step[0]))
        axis = axes.setdefault(junction, heading)
        across = abs(np.sin(wrapped(heading - axis))) > np.sin(np.pi / 4)
        pieces[k] = replace(pieces[k], phase=int(across))
        phases[junction] = 2
    return replace(graph, pieces=tuple(pieces), phases=tuple(phases))
