"""Traffic signals at junctions of OpenStreetMap streets."""

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base import wrapped
from cns_drake.imports.openstreetmap.street_lanes import StreetTraffic
from cns_drake.imports.streets import Street
from cns_drake.traffic import LaneGraph, Piece

# A signal belongs to a junction within this distance [m].
_JUNCTION_WITHIN = 25.0
# A signal controls the ways of its junction that pass within this distance [m].
_WAY_WITHIN = 6.0
# A way leads across the first way of its junction if the sine of the angle
# between them is greater than this (45 deg).
_ACROSS_SINE = np.sin(np.pi / 4)


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
        node: place
        for street in streets
        for node, place in zip(street.nodes, street.line, strict=True)
    }
    junctions = shapely.points([places[node] for node in traffic.junctions])
    if not len(junctions):
        return []
    pairs = shapely.STRtree(junctions).query_nearest(
        shapely.points(signals), max_distance=_JUNCTION_WITHIN
    )
    return list(junctions[np.unique(pairs[1])])


def with_signals(
    graph: LaneGraph, signals: Sequence[BaseGeometry]
) -> LaneGraph:
    """Returns the lanes, with signals of two phases at some junctions.

    The first phase is for the direction in which the first way of a junction
    begins, and the second phase is for the direction across. Junctions with a
    common signal become one junction.

    Args:
        graph: the lanes.
        signals: places of the junctions that get signals.
    """
    joined = _joined_junctions(_junctions_of_signals(graph, signals))
    pieces = [
        replace(piece, junction=joined.get(piece.junction, piece.junction))
        for piece in graph.pieces
    ]
    with_phases = _with_phases(pieces, frozenset(joined.values()))
    return replace(graph, pieces=tuple(with_phases))


def _junctions_of_signals(
    graph: LaneGraph, signals: Sequence[BaseGeometry]
) -> Iterator[tuple[int, int]]:
    """Yields pairs of junctions that have a common signal.

    Each way near a signal yields the signal's first junction, and the junction
    of the way, which may be the same.
    """
    ways = [piece for piece in graph.pieces if piece.is_way]
    if not signals or not ways:
        return
    lines = [shapely.LineString(way.points[:, :2]) for way in ways]
    near = shapely.STRtree(signals).query(lines, "dwithin", _WAY_WITHIN)
    first_junctions: dict[int, int] = {}
    for way, signal in near.T.tolist():
        junction = ways[way].junction
        yield first_junctions.setdefault(signal, junction), junction


def _joined_junctions(pairs: Iterable[tuple[int, int]]) -> dict[int, int]:
    """Returns for each junction in pairs the junction that it becomes part of.

    Lanes that never cross have different junctions, although they may have a
    common signal. The two junctions of a pair become one.
    """
    parents: dict[int, int] = {}

    def root(junction: int) -> int:
        while (parent := parents.setdefault(junction, junction)) != junction:
            junction = parent
        return junction

    for first, junction in pairs:
        parents[root(junction)] = root(first)
    return {junction: root(junction) for junction in parents}


def _with_phases(
    pieces: Iterable[Piece], switched: AbstractSet[int]
) -> Iterator[Piece]:
    """Yields pieces; ways through the junctions in `switched` have a phase."""
    first_headings: dict[int, float] = {}
    for piece in pieces:
        if not piece.is_way or piece.junction not in switched:
            yield piece
            continue
        step = piece.points[1] - piece.points[0]
        heading = float(np.arctan2(step[1], step[0]))
        first = first_headings.setdefault(piece.junction, heading)
        is_across = abs(np.sin(wrapped(heading - first))) > _ACROSS_SINE
        yield replace(piece, phase=int(is_across))
