"""Makes lanes, crossings and walkways for traffic from a road network."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
import itertools
import math

import numpy as np
import shapely

from cns_drake.base import distances_along, length_of
from cns_drake.roads import (
    ENDS,
    Connection,
    End,
    Junction,
    LaneRef,
    Road,
    RoadNetwork,
    blend,
)
from cns_drake.traffic import lane_graph
from cns_drake.traffic.lane_graph import LaneGraph, Piece, Walkway
from cns_drake.traffic.polylines import resampled

# Distance of stop lines from the end of a road with a crossing [m].
_STOP_LINE = 4.5
# Distance of stop lines from the end of a road without a crossing [m].
_STOP_LINE_ALONE = 1.0
# Distance of a crossing's middle from the end of the road [m].
_CROSSING_PLACE = 1.7
# Width of a crossing [m].
_CROSSING_WIDTH = 2.4
# Between its stop lines, a lane must have room for any vehicle. A shorter lane
# becomes part of the ways through the junctions at its ends [m].
_SHORTEST_LANE = 14.0
# Greatest number of junctions in one way.
_MOST_JUNCTIONS = 4
# Roads with more lanes have signals at their junctions, as in the city
# generator.
_LANES_WITHOUT_SIGNAL = 2
# Least number of arms of a junction with crossings, and with signals.
_FEWEST_ARMS = 3
# Points nearer than this to the new end of a line are left out [m].
_AT_END = 1e-3


def make_lane_graph(network: RoadNetwork) -> LaneGraph:
    """Returns the lane graph of a road network.

    Lanes end at stop lines. Short lanes are part of the paths through
    junctions.
    """
    trims = {
        (road.name, end): _stop_line(network, road, end)
        for road in network.roads.values()
        for end in ENDS
    }
    long = {
        road.name
        for road in network.roads.values()
        if road.length - sum(trims[road.name, end] for end in ENDS)
        >= _SHORTEST_LANE
    }
    number = {
        ref: k
        for k, ref in enumerate(
            one for one in network.lanes() if one.road in long
        )
    }
    clusters = _clusters(network, long)
    lines = {
        ref: network.roads[ref.road].lane_centreline(*ref[1:], 0.5)
        for ref in network.lanes()
    }
    onward = _connections_from(network)
    pieces = [
        _lane_piece(network, ref, lines[ref], trims, number, clusters)
        for ref in number
    ]
    for ref, k in number.items():
        first = len(pieces)
        phase = _signal_phase(network, clusters, ref)
        for way, last in _ways(onward, ref, long):
            roads = {ref.road, *(c.outgoing.road for c in way)}
            pieces.append(
                Piece(
                    resampled(_way_line(lines, trims, ref, way, last)),
                    min(network.roads[name].speed_limit for name in roads),
                    True,
                    (number[last],),
                    junction=clusters[network.exit_junction(ref)],
                    phase=phase,
                )
            )
        pieces[k] = replace(pieces[k], after=tuple(range(first, len(pieces))))
    crossings = tuple(_crossings(network, trims))
    return LaneGraph(tuple(lane_graph.without_dead_ends(pieces)), crossings)


def _connections_from(
    network: RoadNetwork,
) -> dict[LaneRef, list[Connection]]:
    """Returns lane -> connections that begin at its exit."""
    onward: dict[LaneRef, list[Connection]] = {
        ref: [] for ref in network.lanes()
    }
    for name in network.junctions:
        for connection in network.connections(name):
            onward[connection.incoming].append(connection)
    return onward


def _lane_piece(
    network: RoadNetwork,
    ref: LaneRef,
    line: np.ndarray,
    trims: dict[tuple[str, End], float],
    number: Mapping[LaneRef, int],
    clusters: dict[str, int],
) -> Piece:
    """Returns a lane as a piece that no way follows yet.

    Args:
        network: the road network.
        ref: the lane.
        line: (N, 3) its centreline [m].
        trims: distance of each stop line from the end of its road [m].
        number: lane -> number of its piece, for all lanes that are pieces.
        clusters: see `_clusters`.
    """
    return Piece(
        resampled(_shortened(line, *_trims_of(ref, trims))),
        network.roads[ref.road].speed_limit,
        False,
        left=number.get(ref._replace(lane=ref.lane - 1), -1),
        right=number.get(ref._replace(lane=ref.lane + 1), -1),
        junction=clusters[network.exit_junction(ref)],
    )


def _stop_line(network: RoadNetwork, road: Road, end: End) -> float:
    """Returns the distance of the stop line from the end of a road [m]."""
    junction = network.junctions[road.start if end == "start" else road.end]
    crosses = (
        len(junction.arms) >= _FEWEST_ARMS and road.length >= 2 * _STOP_LINE
    )
    return _STOP_LINE if crosses else _STOP_LINE_ALONE


def _trims_of(
    ref: LaneRef, trims: dict[tuple[str, End], float]
) -> tuple[float, float]:
    """Returns the lengths that are cut off a lane's entry and exit [m]."""
    start, end = trims[ref.road, "start"], trims[ref.road, "end"]
    return (start, end) if ref.direction == "forward" else (end, start)


def _shortened(line: np.ndarray, start: float, end: float) -> np.ndarray:
    """Returns a line shortened at both ends.

    Args:
        line: (N, 3) the line [m].
        start, end: lengths to cut off [m].
    """
    along = distances_along(line)
    low, high = start, along[-1] - end
    inside = along[(along > low + _AT_END) & (along < high - _AT_END)]
    wanted = np.concatenate([[low], inside, [high]])
    return np.column_stack([np.interp(wanted, along, x) for x in line.T])


def _clusters(network: RoadNetwork, long: set[str]) -> dict[str, int]:
    """Returns junction -> number; junctions joined by short roads share one.

    Args:
        network: the road network.
        long: names of the roads whose lanes are long enough to be pieces.
    """
    group = {name: {name} for name in network.junctions}
    for road in network.roads.values():
        if road.name not in long:
            joined = group[road.start] | group[road.end]
            for name in joined:
                group[name] = joined
    firsts = {name: min(names) for name, names in group.items()}
    number = {first: k for k, first in enumerate(sorted(set(firsts.values())))}
    return {name: number[firsts[name]] for name in network.junctions}


def _signal_phase(
    network: RoadNetwork, clusters: dict[str, int], ref: LaneRef
) -> int:
    """Returns the signal phase of a lane's ways; -1 without a signal.

    Phase 0 is along the junction's first arm, in both directions, and phase 1
    across it.

    Args:
        network: the road network.
        clusters: see `_clusters`.
        ref: the lane.
    """
    number = clusters[network.exit_junction(ref)]
    if not _has_signals(network, clusters, number):
        return -1
    axis = next(
        junction.arms[0].heading
        for name, junction in network.junctions.items()
        if clusters[name] == number
    )
    *_, heading = network.roads[ref.road].lane_end(*ref[1:], "exit")
    return int(abs(np.sin(heading - axis)) > np.sin(np.pi / 4))


def _way_line(
    lines: Mapping[LaneRef, np.ndarray],
    trims: dict[tuple[str, End], float],
    first: LaneRef,
    way: Sequence[Connection],
    last: LaneRef,
) -> np.ndarray:
    """Returns the points (N, 3) of a way, from one stop line to a lane [m].

    Args:
        lines: centreline of each lane.
        trims: distance of each stop line from the end of its road [m].
        first: the lane before the way.
        way: connections of the way, as by `_ways`.
        last: the lane behind the way.
    """
    length = length_of(lines[first])
    parts = [_shortened(lines[first], length - _trims_of(first, trims)[1], 0)]
    length = length_of(lines[last])
    head = _shortened(lines[last], 0, length - _trims_of(last, trims)[0])
    for connection in way:
        after = (
            head if connection.outgoing == last else lines[connection.outgoing]
        )
        parts += [connection.points, after]
    return np.concatenate(parts)


def _has_signals(
    network: RoadNetwork, clusters: dict[str, int], number: int
) -> bool:
    """Returns whether a cluster has signals: where a wide road ends.

    Args:
        network: the road network.
        clusters: see `_clusters`.
        number: number of the cluster.
    """
    return any(
        len(junction.arms) >= _FEWEST_ARMS
        and any(
            sum(network.roads[arm.road].lanes.values()) > _LANES_WITHOUT_SIGNAL
            for arm in junction.arms
        )
        for name, junction in network.junctions.items()
        if clusters[name] == number
    )


def _ways(
    onward: Mapping[LaneRef, Sequence[Connection]],
    ref: LaneRef,
    long: Collection[str],
) -> Iterator[tuple[list[Connection], LaneRef]]:
    """Yields the ways from a lane to the next lanes that are long enough.

    No way passes a junction twice.

    Args:
        onward: lane -> connections that begin at its exit.
        ref: the lane.
        long: names of the roads whose lanes are long enough.

    Yields:
        The connections of a way, and the lane behind it.
    """
    waiting: list[tuple[list[Connection], LaneRef]] = [([], ref)]
    while waiting:
        way, lane = waiting.pop(0)
        passed = {connection.junction for connection in way}
        for connection in onward[lane]:
            if connection.junction in passed or len(way) == _MOST_JUNCTIONS:
                continue
            longer = [*way, connection]
            if connection.outgoing.road in long:
                yield longer, connection.outgoing
            else:
                waiting.append((longer, connection.outgoing))


def _crossings(
    network: RoadNetwork, trims: dict[tuple[str, End], float]
) -> Iterator[lane_graph.Crossing]:
    """Yields a crossing at each end of a road with a far stop line."""
    for road in network.roads.values():
        for end in ENDS:
            if trims[road.name, end] == _STOP_LINE:
                line = _crossing_line(road, end)
                yield lane_graph.make_crossing(line, _CROSSING_WIDTH)


def _crossing_line(road: Road, end: End) -> np.ndarray:
    """Returns the line (2, 3) of a road end's crossing, left end first [m]."""
    offsets = np.array([road.half_width, -road.half_width])
    return road.evaluate([_crossing_station(road, end)] * 2, offsets)[:, :3]


def _crossing_station(road: Road, end: End) -> float:
    """Returns the station of the crossing at a road's end [m]."""
    if end == "start":
        return road.first_station + _CROSSING_PLACE
    return road.last_station - _CROSSING_PLACE


# Distance of pedestrians from kerbs and walls [m].
_MARGIN = 0.45
# Half the width in which pedestrians walk on a crossing [m].
_CROSSING_HALF_WIDTH = 0.8
# Least half width in which pedestrians walk along a road [m].
_LEAST_HALF_WIDTH = 0.3
# Distance from the kerb at which pedestrians wait [m].
_BEFORE_KERB = 1.4
# Least length of a walkway from the walked strip to that place [m].
_SHORTEST_SPUR = 1.5
# Greatest width of the strip of a sidewalk on which pedestrians walk [m].
_WIDEST = 3.0
# Least length of a walkway [m].
_SHORTEST = 1.0


def make_walkways(network: RoadNetwork, graph: LaneGraph) -> list[Walkway]:
    """Returns the walkways of a road network.

    Walkways lead along the sidewalks, around the corners of junctions, and over
    the crossings of `graph`.
    """
    nodes: dict[tuple[str, End, int], int] = {}
    for road in network.roads.values():
        if _is_walked(road):
            for end, side in itertools.product(ENDS, (1, -1)):
                nodes[road.name, end, side] = len(nodes)
    places = {
        key: _sidewalk_end(network.roads[key[0]], *key[1:]) for key in nodes
    }
    found: list[Walkway] = []
    for road in network.roads.values():
        if not _is_walked(road):
            continue
        for side in (1, -1):
            first, last = (_crossing_station(road, end) for end in ENDS)
            stations = np.linspace(first, last, max(2, int(last - first)))
            line = road.evaluate(stations, side * _strip_offset(road))[:, :3]
            line[:, 2] += road.kerb_height
            width = _half_width(_walked_width(road))
            a, b = (nodes[road.name, end, side] for end in ENDS)
            found.append(Walkway(resampled(line), width, a, b))
    for junction in network.junctions.values():
        found += _corner_walkways(network, junction, nodes, places)
    crossed = [
        (road, end, _crossing_line(road, end))
        for road, end in itertools.product(network.roads.values(), ENDS)
        if (road.name, end, 1) in nodes
    ]
    found += _crossing_walkways(graph, crossed, nodes, places, len(found))
    # At unusual junctions, some corners have no sidewalk.
    lanes = network.areas.lane_area
    shapely.prepare(lanes)
    return [
        way
        for way in found
        if way.crossing >= 0
        or not lanes.intersects(
            shapely.LineString(way.points[:, :2]).buffer(way.half_width)
        )
    ]


def _crossing_walkways(
    graph: LaneGraph,
    crossed: Sequence[tuple[Road, End, np.ndarray]],
    nodes: Mapping[tuple[str, End, int], int],
    places: Mapping[tuple[str, End, int], np.ndarray],
    count: int,
) -> list[Walkway]:
    """Returns the walkways over crossings, with the ways to their kerbs.

    Args:
        graph: the lane graph with the crossings.
        crossed: for each road end where people walk, the road, the end, and the
            line of the crossing there.
        nodes: road, end and side -> number of the place at a sidewalk's end.
        places: road, end and side -> this place, see `_sidewalk_end`.
        count: number of walkways so far, from which numbers of new places
            follow.
    """
    found: list[Walkway] = []
    for k, crossing in enumerate(graph.crossings):
        for road, end, across in crossed:
            if np.allclose(crossing.line, across):
                ends = []
                for side, kerb in zip((1, -1), crossing.line, strict=True):
                    number = nodes[road.name, end, side]
                    start = places[road.name, end, side][:3]
                    ahead = kerb[:2] - start[:2]
                    distance = math.dist(kerb[:2], start[:2])
                    if distance > _BEFORE_KERB + _SHORTEST_SPUR:
                        # On a wide sidewalk, pedestrians wait at the kerb.
                        part = 1.0 - _BEFORE_KERB / distance
                        stop = np.append(start[:2] + part * ahead, start[2])
                        node = number
                        number = 2 * len(nodes) + count + len(found)
                        spur = resampled(np.array([start, stop]))
                        found.append(
                            Walkway(spur, _CROSSING_HALF_WIDTH, node, number)
                        )
                        start = stop
                    ends.append((number, start))
                (left, one), (right, other) = ends
                line = resampled(np.array([one, *crossing.line, other]))
                found.append(
                    Walkway(line, _CROSSING_HALF_WIDTH, left, right, k)
                )
    return found


def _is_walked(road: Road) -> bool:
    return (
        _half_width(_walked_width(road)) >= _LEAST_HALF_WIDTH
        and road.length > 2 * _CROSSING_PLACE + _SHORTEST
    )


def _half_width(width: float) -> float:
    return min(width, _WIDEST) / 2 - _MARGIN


def _walked_width(road: Road) -> float:
    """Returns the width of a sidewalk beside its parking bays [m]."""
    return road.sidewalk - road.parking


def _strip_offset(road: Road) -> float:
    """Returns the distance of the walked strip from the centreline [m].

    The strip is on the far side of the sidewalk, away from objects along the
    kerb.
    """
    return (
        road.half_width + road.sidewalk - min(_walked_width(road), _WIDEST) / 2
    )


def _sidewalk_end(road: Road, end: End, side: int) -> np.ndarray:
    """Returns x, y, z of a sidewalk's end, and the heading to the junction."""
    place = road.evaluate(
        [_crossing_station(road, end)], side * _strip_offset(road)
    )[0]
    place[2] += road.kerb_height
    if end == "start":
        place[3] += np.pi
    return place


def _corner_walkways(
    network: RoadNetwork,
    junction: Junction,
    nodes: dict[tuple[str, End, int], int],
    places: dict[tuple[str, End, int], np.ndarray],
) -> list[Walkway]:
    """Returns the walkways around the corners between neighbouring arms.

    Args:
        network: the road network.
        junction: the junction of the arms.
        nodes: road, its end and a side -> number of the place there.
        places: the same -> position of the place (3,) [m].
    """
    found = []
    arms = junction.arms
    for k, arm in enumerate(arms):
        after = arms[(k + 1) % len(arms)]
        if arm is after:
            continue
        # Counter-clockwise: seen from the junction, the left side of an arm,
        # then the right side of the next arm.
        a = (arm.road, arm.end, 1 if arm.end == "start" else -1)
        b = (after.road, after.end, -1 if after.end == "start" else 1)
        if a not in nodes or b not in nodes:
            continue
        p, q = places[a], places[b]
        line = blend(p[:2], p[3], q[:2], q[3] + np.pi, 0.5)
        z = np.linspace(p[2], q[2], len(line))
        width = min(_walked_width(network.roads[key[0]]) for key in (a, b))
        points = np.column_stack([line, z])
        if length_of(points) < _SHORTEST:
            continue
        found.append(
            Walkway(resampled(points), _half_width(width), nodes[a], nodes[b])
        )
    return found
