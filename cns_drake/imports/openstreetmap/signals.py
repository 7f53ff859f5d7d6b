"""Traffic signals at junctions of OpenStreetMap streets."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base.angles import wrapped
from cns_drake.imports.openstreetmap.street_lanes import StreetTraffic
from cns_drake.imports.streets import Street
from cns_drake.traffic import lane_graph

# A signal belongs to a junction within this distance [m].
_JUNCTION_WITHIN = 25.0
# A signal controls the ways of its junction that pass within this distance [m].
_WAY_WITHIN = 6.0


def junctions_with_signals(
    traffic: StreetTraffic, streets: Iterable[Street], signals: np.ndarray
) -> list[BaseGeometry]:
    """Returns the places of junctions that have signals, as points.

    Args:
        traffic: the lanes, and the nodes of junctions.
        streets: the streets that meet there.
        signals: (N, 2) places of traffic signals [m].
    """
    if not len(signals):
        return []
    places = {
        node: street.line[k]
        for street in streets
        for k, node in enumerate(street.nodes)
    }
    junctions = shapely.points([places[n] for n in traffic.junctions])
    if not len(junctions):
        return []
    pairs = shapely.STRtree(junctions).query_nearest(
        shapely.points(signals), max_distance=_JUNCTION_WITHIN
    )
    return list(junctions[np.unique(pairs[1])])


def with_signals(
    graph: lane_graph.LaneGraph, signals: Sequence[BaseGeometry]
) -> lane_graph.LaneGraph:
    """Returns the lanes, with signals of two phases at some junctions.

    The first phase is for the direction in which the first way of a junction
    begins, and the second phase is for the direction across.

    Args:
        graph: the lanes.
        signals: places of the junctions that get signals.
    """
    ways = [k for k, piece in enumerate(graph.pieces) if piece.is_way]
    if not signals or not ways:
        return graph
    lines = [shapely.LineString(graph.pieces[k].points[:, :2]) for k in ways]
    near = shapely.STRtree(signals).query(lines, "dwithin", _WAY_WITHIN)
    # Lanes that never cross have different junctions, which a common signal
    # joins.
    group = {piece.junction: piece.junction for piece in graph.pieces}
    controlled: dict[int, int] = {}
    for k, signal in near.T.tolist():
        junction = graph.pieces[ways[k]].junction
        first = group[controlled.setdefault(signal, junction)]
        joined = group[junction]
        group = {a: first if b == joined else b for a, b in group.items()}
    switched = {group[k] for k in controlled.values()}
    pieces = list(graph.pieces)
    axes: dict[int, float] = {}
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
    return replace(graph, pieces=tuple(pieces))
