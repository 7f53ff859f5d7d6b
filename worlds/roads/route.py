"""Routes along the lanes of a road network, drawn or given, and their paths."""

from collections import Counter, defaultdict
import math
from typing import NamedTuple

import numpy as np

from evaluation.base import InputError
from worlds.roads.network import Connection, RoadNetwork
from worlds.roads.road import Road
from worlds.shapes import (
    DENSE_SPACING,
    Direction,
    LanePath,
    LaneRef,
    Route,
    RouteLeg,
    find_u_turn,
    sample_lane_path,
    smooth_step,
)

# Length of a lane change where the road has room for it [m].
LANE_CHANGE_LENGTH = 50.0
# Least length of a lane change [m].
MIN_LANE_CHANGE_LENGTH = 20.0
# Length over which a car moves aside [m].
_ASIDE_LENGTH = 25.0
# Least distance of the middle of a car's rear axle from kerbs and medians: its
# front swings out [m].
CAR_ROOM = 1.4
# Greatest distance before a junction at which a car turns round [m].
_TURNING_LENGTH = 30.0
# Distance between the places of turning that are tried [m].
_TURNING_STEP = 0.5


def make_lane_path(
    network: RoadNetwork,
    route: Route,
    spacing: float,
    source: object = "route",
    *,
    aside: float = 0.0,
) -> LanePath:
    """Returns the path along the lanes of a route, joined at junctions.

    Consecutive legs must meet in a junction, and the path through this junction
    must be legal: a left turn from innermost lane to innermost lane, a right
    turn from outermost lane to outermost lane, and straight on without a change
    of lane (`RoadNetwork.is_legal`). Lanes change only along a leg. Within a
    junction, the lower speed limit of the two roads holds. If the next leg
    leads back on the same road, the car turns round in a loop to the left: at
    the leg's `end` or, without an `end`, as near to the junction as there is
    room.

    Args:
        network: the road network.
        route: the legs of the route.
        spacing: distance between the points, rounded so that it divides the
            length of the route [m].
        source: file or other source, named in error messages.
        aside: lateral offset of the path from the lanes' middle, positive to
            the right [m]. The offset applies along each road between its
            junctions, as far as the road has room.

    Raises:
        InputError: a leg names an unknown lane, does not follow from the leg
            before, is too short for its lane change or has no room for turning
            round; or the whole route is too short.
    """
    stretches: list[_Stretch] = []
    begin: float | None = None
    for k, leg in enumerate(route.root):
        before = route.root[k - 1] if k > 0 else None
        after = route.root[k + 1] if k + 1 < len(route.root) else None
        try:
            _check_ends(network, leg, before is None, after)
            road = network.roads[leg.road]
            if before is not None and begin is None:
                stretches.append(_through_junction(network, before, leg))
            first = leg.start or 0.0 if begin is None else begin
            loop = np.zeros((0, 3))
            if after is not None and leads_back(leg, after):
                loop, last = _turning_loop(network, leg, after, first, aside)
                begin = road.length - last
            else:
                last = leg.end or road.length
                begin = None
            points = _leg_points(network, leg, first, last, aside)
            beside = _lanes_beside(road, leg)
            stretches += [
                _Stretch(points, road.speed_limit, beside),
                _Stretch(loop, road.speed_limit, np.zeros(2)),
            ]
        except ValueError as error:
            raise InputError(
                f"{source}: route.{k} ({leg.road} {leg.direction}): {error}"
            ) from error
    return sample_lane_path(
        np.concatenate([stretch.points for stretch in stretches]),
        np.concatenate(
            [
                np.full(len(stretch.points), stretch.speed_limit)
                for stretch in stretches
            ]
        ),
        spacing,
        f"{source}: route",
        np.concatenate(
            [
                np.tile(stretch.beside, (len(stretch.points), 1))
                for stretch in stretches
            ]
        ),
    )


class _Stretch(NamedTuple):
    """A part of a path, with one speed limit and the same lanes beside it.

    Attributes:
        points: (N, 3) points of the path [m].
        speed_limit: speed limit [m/s].
        beside: (2,) distances to the neighbouring lanes on the left and on the
            right [m]; 0 without such a lane.
    """

    points: np.ndarray
    speed_limit: float
    beside: np.ndarray


def _through_junction(
    network: RoadNetwork, before: RouteLeg, leg: RouteLeg
) -> _Stretch:
    """Returns the path through the junction between two legs.

    Raises:
        ValueError: there is no legal connection.
    """
    way = _legal_connection(network, before, leg)
    roads = network.roads[before.road], network.roads[leg.road]
    beside = np.zeros(2)
    if way.turn == "straight":
        beside = np.minimum(
            _lanes_beside(roads[0], before), _lanes_beside(roads[1], leg)
        )
    limit = min(road.speed_limit for road in roads)
    return _Stretch(way.points[1:-1], limit, beside)


def _lanes_beside(road: Road, leg: RouteLeg) -> np.ndarray:
    """Returns the distances (2,) to the next lanes on the left and right [m].

    They are 0 for a leg that changes lanes.
    """
    if not isinstance(leg.lane, int):
        return np.zeros(2)
    others = [leg.lane > 1, leg.lane < road.lanes[leg.direction]]
    return np.array(others) * road.lane_width


def leads_back(leg: RouteLeg, after: RouteLeg) -> bool:
    """Returns whether the car turns round between two consecutive legs."""
    return leg.road == after.road and leg.direction != after.direction


def _check_ends(
    network: RoadNetwork, leg: RouteLeg, is_first: bool, after: RouteLeg | None
) -> None:
    """Checks the road, the start and the end of a leg.

    Raises:
        ValueError: the road does not exist, or start or end are not allowed.
    """
    if leg.start is not None and not is_first:
        raise ValueError("start is allowed in the first leg only")
    if leg.road not in network.roads:
        raise ValueError(f"no road {leg.road!r}")
    if leg.end is not None and after and not leads_back(leg, after):
        raise ValueError(
            "end is allowed in the last leg only, or before a leg that leads "
            "back"
        )
    length = network.roads[leg.road].length
    start = 0.0 if leg.start is None else leg.start
    end = length if leg.end is None else leg.end
    if not start < end <= length:
        raise ValueError(
            f"from {start:g} m to {end:g} m does not lie within the road's "
            f"{length:.1f} m"
        )


def _leg_points(
    network: RoadNetwork, leg: RouteLeg, start: float, end: float, aside: float
) -> np.ndarray:
    """Returns the points (N, 3) of a leg on its road [m].

    `start` and `end` are distances from the entry of the road; if the car turns
    round in a junction, they extend beyond the road. The path lies `aside` to
    the right of the lanes' middle.

    Raises:
        ValueError: the leg does not fit its road.
    """
    road = network.roads[leg.road]
    first = road.lane_offset(leg.direction, leg.entry_lane.lane)
    last = road.lane_offset(leg.direction, leg.exit_lane.lane)
    if start >= end:
        raise ValueError(
            f"the road is too short for turning round at {end:.1f} m"
        )
    count = int(np.ceil((end - start) / DENSE_SPACING)) + 1
    travelled = np.linspace(start, end, count)
    offset = np.full(count, first)
    if first != last:
        offset += (last - first) * _completed_share(travelled)
    offset = _offsets_moved_right(road, leg.direction, offset, travelled, aside)
    return road.evaluate(_stations_of(road, leg, travelled), offset)[:, :3]


def _stations_of(
    road: Road, leg: RouteLeg, travelled: np.ndarray
) -> np.ndarray:
    if leg.direction == "forward":
        return road.first_station + travelled
    return road.last_station - travelled


def _turning_loop(
    network: RoadNetwork,
    leg: RouteLeg,
    after: RouteLeg,
    start: float,
    aside: float,
) -> tuple[np.ndarray, float]:
    """Returns the loop in which the car turns round at the end of a leg.

    The result is the points (N, 3) of the loop between the lanes [m], and the
    distance from the entry of the road at which the car leaves the first lane
    [m].

    Raises:
        ValueError: there is no room, or no such lane.
    """
    road = network.roads[leg.road]

    def lanes_at(travelled: float) -> tuple[np.ndarray, float]:
        """Returns the pose of the lane, and the distance to the opposite lane.

        The pose (3,) contains x and y [m] and the heading [rad] of the lane's
        middle, `travelled` [m] after the entry of the road. The opposite lane
        is on the left; the distance is measured from middle to middle [m].
        """
        offsets = [
            _offsets_moved_right(
                road,
                of_leg.direction,
                np.array([road.lane_offset(of_leg.direction, lane.lane)]),
                np.array([from_entry]),
                aside,
            )[0]
            for of_leg, lane, from_entry in (
                (leg, leg.exit_lane, travelled),
                (after, after.entry_lane, road.length - travelled),
            )
        ]
        station = _stations_of(road, leg, np.array([travelled]))
        x, y, _, heading = road.evaluate(station, offsets[0])[0]
        if leg.direction == "backward":
            heading += np.pi
        return np.array([x, y, heading]), abs(offsets[1] - offsets[0])

    if leg.end is not None:
        centres = np.array([leg.end])
    else:
        # Places are tried backwards, beginning in the middle of the junction.
        first, last = road.first_station, road.full_length - road.last_station
        beyond = last if leg.direction == "forward" else first
        farthest = road.length + beyond
        nearest = max(start, road.length - _TURNING_LENGTH)
        centres = np.arange(farthest, nearest, -_TURNING_STEP)
    u_turn = find_u_turn(lanes_at, centres, network.areas.lane_area)
    x, y, heading = lanes_at(u_turn.begin)[0]
    ahead = (u_turn.points[:, 0] - x) * math.cos(heading)
    ahead += (u_turn.points[:, 1] - y) * math.sin(heading)
    z = road.height(_stations_of(road, leg, u_turn.begin + ahead))
    points = np.column_stack([u_turn.points, z])[1:-1]
    return points, u_turn.begin


def _offsets_moved_right(
    road: Road,
    direction: Direction,
    offset: np.ndarray,
    travelled: np.ndarray,
    aside: float,
) -> np.ndarray:
    """Returns the offsets (N,) of a path moved to the right of a lane [m].

    The path stays on the carriageway. At both ends of the road, and all along a
    short road, it is in the middle of the lane.
    """
    if aside == 0 or road.length < 2 * _ASIDE_LENGTH:
        return offset
    right = -1.0 if direction == "forward" else 1.0
    outer = road.half_width - CAR_ROOM
    inner = road.median / 2 + CAR_ROOM if road.median else -outer
    from_end = np.minimum(travelled, road.length - travelled)
    share = smooth_step(np.clip(from_end / _ASIDE_LENGTH, 0.0, 1.0))
    from_middle = right * offset
    wanted = np.clip(from_middle + aside, inner, outer)
    return right * (from_middle + share * (wanted - from_middle))


def _completed_share(travelled: np.ndarray) -> np.ndarray:
    """Returns the completed share (N,) of a lane change, from 0 to 1.

    The change lies in the middle of the leg. The share follows the quintic
    whose first and second derivatives vanish at both ends.

    Args:
        travelled: (N,) distances along the leg, from its start to its end [m].

    Raises:
        ValueError: the leg is too short for a change of lane.
    """
    available = travelled[-1] - travelled[0]
    if available < MIN_LANE_CHANGE_LENGTH:
        raise ValueError(
            f"{available:.1f} m are too short for a lane change, which needs "
            f"{MIN_LANE_CHANGE_LENGTH:.0f} m"
        )
    length = min(available, LANE_CHANGE_LENGTH)
    middle = (travelled[0] + travelled[-1]) / 2
    return smooth_step(np.clip((travelled - middle) / length + 0.5, 0.0, 1.0))


def _legal_connection(
    network: RoadNetwork, previous: RouteLeg, leg: RouteLeg
) -> Connection:
    """Returns the connection from one leg to the next.

    Raises:
        ValueError: there is no legal connection.
    """
    way = network.connection(previous.exit_lane, leg.entry_lane, DENSE_SPACING)
    if not network.is_legal(way):
        rule = {
            "left": "a left turn leads from lane 1 to lane 1",
            "right": "a right turn leads from the outermost lane to the "
            "outermost",
            "straight": "straight on keeps the lane",
        }[way.turn]
        raise ValueError(
            f"from lane {way.incoming.lane} of {previous.road} to lane "
            f"{way.outgoing.lane}: {rule}"
        )
    return way


# How strongly roads that were not driven before are preferred.
_WEIGHT_OF_NEW = 6.0


def draw_route(
    network: RoadNetwork, length: float, rng: np.random.Generator
) -> Route:
    """Returns a random legal route, preferably along roads not yet driven.

    The total length of the route's roads is at least `length` [m].

    Raises:
        InputError: no route in the network can be continued without end.
    """
    successors = _successors(network)
    if not successors:
        raise InputError(
            "roads: every lane comes to an end, so that no endless route exists"
        )
    lanes = sorted(successors)
    lane = lanes[int(rng.integers(len(lanes)))]
    visits: Counter[str] = Counter()
    legs: list[tuple[LaneRef, int]] = []
    driven = 0.0
    while driven < length:
        visits[lane.road] += 1
        driven += network.roads[lane.road].length
        choices = successors[lane]
        weights = np.array(
            [
                math.pow(_WEIGHT_OF_NEW, -visits[after.road])
                for _, after in choices
            ]
        )
        chosen = int(rng.choice(len(choices), p=weights / weights.sum()))
        exit_lane, after = choices[chosen]
        legs.append((lane, exit_lane))
        lane = after
    # No road follows the last one, so the drive stays in its lane.
    legs[-1] = (legs[-1][0], legs[-1][0].lane)
    return Route([_make_leg(entry, exit_lane) for entry, exit_lane in legs])


def _make_leg(entry: LaneRef, exit_lane: int) -> RouteLeg:
    lane = entry.lane if exit_lane == entry.lane else (entry.lane, exit_lane)
    return RouteLeg(road=entry.road, direction=entry.direction, lane=lane)


def _successors(
    network: RoadNetwork,
) -> dict[LaneRef, list[tuple[int, LaneRef]]]:
    """Returns for each lane how a route can continue.

    A continuation is a pair: the number of the lane in which the car leaves the
    road, and the first lane of the next road. Lanes from which no endless route
    leads on are left out.
    """
    ways = defaultdict(list)
    for junction in network.junctions:
        for way in network.connections(junction):
            ways[way.incoming].append(way.outgoing)
    successors = {}
    for lane in network.lanes():
        road = network.roads[lane.road]
        exits = [lane.lane]
        if road.length > MIN_LANE_CHANGE_LENGTH:
            exits = [*range(1, road.lanes[lane.direction] + 1)]
        successors[lane] = [
            (number, after)
            for number in exits
            for after in sorted(ways[lane._replace(lane=number)])
        ]
    while True:
        alive = {
            lane: [way for way in choices if way[1] in successors]
            for lane, choices in successors.items()
            if any(way[1] in successors for way in choices)
        }
        if alive == successors:
            return alive
        successors = alive
