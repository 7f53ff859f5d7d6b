"""Lanes, signal programs and the ego car's path, as arrays for fast loops.

All signals have the same cycle. The green time of a junction is divided among
its phases in proportion to the incoming flow. The offsets of the junctions are
chosen so that vehicles that leave a junction on green wait little at the next
junction (a green wave, where possible).
"""

import math
from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.base.compiled import compiled
from cns_drake.base.elementary import arctan2, cos, sin
from cns_drake.roads.car_outline import outlines
from cns_drake.traffic.lane_graph import LaneGraph, Piece
from cns_drake.traffic.polylines import distances_along
from cns_drake.traffic.vehicle_kinds import LARGEST, SMALL_SIZE

# Least duration of a cycle [s].
_LEAST_CYCLE = 60.0
# Red for all after each phase [s].
_ALL_RED = 4.0
# Least duration of a phase [s].
_LEAST_PHASE = 14.0
# Greatest speed of a column of vehicles [m/s].
_COLUMN_SPEED = 9.0
# Vehicles leave a junction after these shares of their green.
_LEAVING_SHARES = np.array([0.1, 0.25, 0.4, 0.6])
# Distance between the offsets that are tried [s].
_OFFSET_STEP = 2.0
# All offsets are improved this many times.
_OFFSET_ROUNDS = 3
# A crossing within this distance of the stop line lies before the line [m].
_AT_LINE = 6.0
# Number of steps of a vehicle that takes random ways.
_WANDERS = 200
# For each driver who turns, this many go straight on.
_STRAIGHT_SHARE = 3.0
# For each driver who turns, this many turn round.
_TURN_ROUND_SHARE = 0.02
# Cosine of the angle between straight on and a turn; its negative lies between
# a turn and turning round.
_TURN_COSINE = 0.7


class Signals(NamedTuple):
    """The signal program of P pieces and C crossings.

    Attributes:
        cycle: duration of a cycle [s].
        green_from, green_for: (P + C,) time in the cycle at which green begins,
            and its duration [s], for vehicles on pieces and for pedestrians on
            crossings. Without a signal, green lasts the whole cycle.
    """

    cycle: float
    green_from: np.ndarray
    green_for: np.ndarray


def make_signals(graph: LaneGraph, begin: np.ndarray) -> Signals:
    """Returns the signal program of all traffic lights.

    Args:
        graph: lane graph with P pieces and C crossings.
        begin: (P + C, P + C) distances along piece a at which the front of a
            small vehicle reaches piece or crossing b [m], with the indices a,
            b; see `cns_drake.traffic.streets.find_conflicts`.
    """
    pieces = graph.pieces
    flow = _flows(graph)
    junction = np.array([piece.junction for piece in pieces])
    phase = np.array([piece.phase for piece in pieces])
    # Way -> the lane before it.
    origin = np.zeros(len(pieces), int)
    for k in graph.lanes:
        origin[list(pieces[k].after)] = k
    cycle = max(_LEAST_CYCLE, (phase.max() + 1) * (_ALL_RED + _LEAST_PHASE))
    green_from, green_for = np.zeros(len(begin)), np.full(len(begin), cycle)
    place = begin[: len(pieces), len(pieces) :]
    # Pedestrians must not have green together with vehicles that start.
    cost = flow[:, None] * np.where(place < _AT_LINE, 1e3, np.isfinite(place))
    # The junction whose signal each way and crossing has; -1 for none.
    owner = np.full(len(begin), -1)
    owner[: len(pieces)][phase >= 0] = junction[phase >= 0]
    for c, column in enumerate(place.T, len(pieces)):
        owner[c] = max(owner[: len(pieces)][np.isfinite(column)], default=-1)
    for j in np.unique(owner[owner >= 0]):
        own = [
            np.flatnonzero((junction == j) & (phase == one))
            for one in np.unique(phase[(junction == j) & (phase >= 0)])
        ]
        if len(own) == 1:
            continue
        need = np.array(
            [np.bincount(origin[ways], flow[ways]).max() for ways in own]
        )
        free = cycle - len(own) * (_ALL_RED + _LEAST_PHASE)
        green = _LEAST_PHASE + free * need / need.sum()
        starts = np.cumsum(green + _ALL_RED) - green - _ALL_RED
        for ways, start, lasts in zip(own, starts, green, strict=True):
            green_from[ways], green_for[ways] = start, lasts
        for column in np.flatnonzero(owner[len(pieces) :] == j):
            # Pedestrians have green in the phase in which the least flow
            # crosses their way.
            crossed = [cost[ways, column].sum() for ways in own]
            k = int(np.argmin(crossed))
            row = len(pieces) + column
            green_from[row], green_for[row] = starts[k], green[k]
    offsets = _offsets(
        graph, flow, owner, Signals(cycle, green_from, green_for)
    )
    green_from += np.where(owner >= 0, offsets[owner], 0.0)
    return Signals(cycle, green_from % cycle, green_for)


def way_shares(graph: LaneGraph, lane: int) -> np.ndarray:
    """Returns how drivers divide among the paths that follow a lane.

    Args:
        graph: the lane graph.
        lane: number of the lane, which leads to a junction.

    Returns:
        Share of the drivers on each path in `graph.pieces[lane].after`; the sum
        is 1.
    """
    after = graph.pieces[lane].after
    likes = []
    for way in after:
        steps = np.diff(graph.pieces[way].points[:, :2], axis=0)[[0, -1]]
        a, b = steps / np.linalg.norm(steps, axis=1)[:, None]
        turn = a @ b
        likes.append(
            _STRAIGHT_SHARE
            if turn > _TURN_COSINE
            else 1.0
            if turn > -_TURN_COSINE
            else _TURN_ROUND_SHARE
        )
    return np.array(likes) / sum(likes)


def _flows(graph: LaneGraph) -> np.ndarray:
    """Returns (P,) the share of vehicles on each piece, over a long time.

    At each junction, vehicles choose any way, with the shares of `way_shares`.
    """
    pieces = graph.pieces
    step = np.zeros((len(pieces), len(pieces)))
    for k, piece in enumerate(pieces):
        step[k, list(piece.after)] = way_shares(graph, k)
    flow = np.full(len(pieces), 1.0 / len(pieces))
    mean = np.zeros(len(pieces))
    for _ in range(_WANDERS):
        flow = flow @ step
        mean += flow / _WANDERS
    return mean


def _offsets(
    graph: LaneGraph, flow: np.ndarray, owner: np.ndarray, signals: Signals
) -> np.ndarray:
    """Returns the offsets (J,) of the junctions' cycles [s].

    One junction after the other takes the offset with which the flow (P,) of
    vehicles waits least. `owner` (P + C,) is the junction whose signal a piece
    or crossing has; -1 for none.
    """
    cycle, green_from, green_for = signals
    # Behind each way, a lane and its first way.
    lane = np.array([(*p.after, k)[0] for k, p in enumerate(graph.pieces)])
    after = lane[lane]
    number = len(lane)
    time = np.array(
        [p.length / min(p.limit, _COLUMN_SPEED) for p in graph.pieces]
    )
    way = np.flatnonzero(
        (owner[:number] >= 0)
        & (owner[after] >= 0)
        & (owner[after] != owner[:number])
    )
    leave = green_from[way] + time[way] + time[lane[way]]
    leave = leave[:, None] + green_for[way, None] * _LEAVING_SHARES
    weight = flow[way]
    after = after[way]
    last = green_for[after, None]
    begins = green_from[after, None]
    offsets = np.zeros(1 + max(0, owner.max()))

    def wait() -> float:
        shift = offsets[owner[way]] - offsets[owner[after]]
        late = (leave - begins + shift[:, None]) % cycle
        return float(weight @ np.where(late < last, 0.0, cycle - late).sum(1))

    for _ in range(_OFFSET_ROUNDS):
        for j in np.unique(owner[way]):
            found = []
            for offset in np.arange(0.0, cycle, _OFFSET_STEP):
                offsets[j] = offset
                found.append(wait())
            offsets[j] = _OFFSET_STEP * int(np.argmin(found))
    return offsets


# Greatest lateral acceleration in bends [m/s^2].
_LATERAL = 2.2
# Greatest braking before bends [m/s^2].
_BEFORE_BENDS = 1.5
# Speed below which bends do not reduce it [m/s].
_SLOWEST = 2.5
# The curvature is that of chords over this many points to both sides.
_CHORD = 4
# Distance between the places at which a vehicle's outline is tested [m].
_STEP = 1.0
# Free space around this outline [m].
_CLEARANCE = 0.25
# Half the width of the strip of a lane that vehicles need, including their
# distance from the ego car [m].
_HALF_LANE = 1.45
# When the ego car enters a lane, the lane must be empty. Drivers assume that
# they drive at this share of the speed limit.
_SLOW_PART = 0.6
# Drivers assume that they wait for this time at the lane's end [s].
WAIT = 20.0

# Time step of the plan [s].
STEP = 0.1
# Two ways share the lane before them.
SPLIT = 1
# Two ways share the lane behind them.
MERGE = 2

# A piece of the lane graph as a record; see `Piece`.
PIECE = np.dtype(
    [
        ("first", int),  # Row of its first point.
        ("num_points", int),
        ("step", float),  # Distance between points [m].
        ("length", float),  # [m]
        ("is_way", bool),
        ("after_first", int),  # Row of its first successor.
        ("after_count", int),
        ("left", int),
        ("right", int),
        ("junction", int),
        ("phase", int),
    ],
    align=True,
)


class Streets(NamedTuple):
    """P pieces and C crossings of a lane graph, and the ego car at K times.

    Attributes:
        pieces: (P,) records of dtype `PIECE`.
        points: (M, 3) points of all pieces [m].
        speed: (M,) allowed speed at each point, reduced in bends [m/s].
        after: numbers of the pieces that follow a piece, for all pieces in
            turn; `pieces` says which rows belong to a piece.
        liked: for each entry of `after`, the cumulative share of drivers that
            take this piece or an earlier entry.
        signals: program of all signals.
        begin, clear, joint: (2, P + C, P + C) see
            `cns_drake.traffic.streets.find_conflicts`.
        over: (P, C) place on a crossing's line where a path through a junction
            leads over the crossing [m]; NaN if the path does not cross.
        until: (K, P + C) float32 time until the ego car reaches the piece or
        crossing [s]; 0 while the ego car is there, inf if the ego car never
        gets there. ego_rear, ego_front: (K, P) float32 distances along a piece
        of the ego
            car's rear and front while it is on the piece [m].
        ego_speed: (K, P) float32 speed of the ego car along the piece [m/s];
            negative against its direction.
    """

    pieces: np.ndarray
    points: np.ndarray
    speed: np.ndarray
    after: np.ndarray
    liked: np.ndarray
    signals: Signals
    begin: np.ndarray
    clear: np.ndarray
    joint: np.ndarray
    over: np.ndarray
    until: np.ndarray
    ego_rear: np.ndarray
    ego_front: np.ndarray
    ego_speed: np.ndarray


class EgoBox(NamedTuple):
    """The rectangle on the ground that the ego car covers, in the car's frame.

    Attributes:
        rear: x of the rear end [m], negative.
        front: x of the front end [m].
        half_width: half of the width [m].
    """

    rear: float
    front: float
    half_width: float

    @property
    def half_size(self) -> tuple[float, float]:
        """Half the length and half the width of the box [m]."""
        return (self.front - self.rear) / 2, self.half_width

    def middles(self, xy: np.ndarray, yaw: np.ndarray) -> np.ndarray:
        """Returns x, y [m] and yaw [rad] of the box's centre, (N, 3).

        Args:
            xy: (N, 2) positions of the car's frame [m].
            yaw: (N,) headings of the car [rad].
        """
        ahead = np.column_stack([cos(yaw), sin(yaw)])
        middle = (self.rear + self.front) / 2
        return np.column_stack([xy + middle * ahead, yaw])

    def corners(self, xy: np.ndarray, yaw: np.ndarray) -> np.ndarray:
        """Returns the corners of the car's box at N poses, (N, 4, 2) [m].

        Args:
            xy: (N, 2) positions of the car's frame [m].
            yaw: (N,) headings of the car [rad].
        """
        ahead = np.column_stack([cos(yaw), sin(yaw)])
        return outlines(xy, ahead, -self.rear, self.front, self.half_width)


def make_streets(
    graph: LaneGraph, box: EgoBox, xy: np.ndarray, yaw: np.ndarray
) -> Streets:
    """Converts a lane graph and the ego car's motion to arrays for numba.

    Args:
        graph: the lanes.
        box: the ego car's box.
        xy: (K, 2) positions of the ego car's frame, one for each time step [m].
        yaw: (K,) headings of the ego car [rad].
    """
    pieces = graph.pieces
    rows = np.zeros(len(pieces), PIECE)
    count = np.array([len(piece.points) for piece in pieces])
    after_count = np.array([len(piece.after) for piece in pieces])
    rows["num_points"] = count
    rows["first"] = np.cumsum(count) - count
    rows["after_count"] = after_count
    rows["after_first"] = np.cumsum(after_count) - after_count
    for name in ("length", "is_way", "left", "right", "junction", "phase"):
        rows[name] = [getattr(piece, name) for piece in pieces]
    rows["step"] = rows["length"] / (count - 1)
    conflicts = find_conflicts(graph)
    shares = [way_shares(graph, k) for k in range(len(pieces))]
    return Streets(
        rows,
        np.concatenate([piece.points for piece in pieces]),
        np.concatenate([_speeds(piece) for piece in pieces]),
        np.array([a for piece in pieces for a in piece.after]),
        np.concatenate([np.cumsum(one) for one in shares]),
        make_signals(graph, conflicts[0][0]),
        *conflicts,
        _places_on_crossings(graph),
        *_find_ego(graph, box, xy, yaw),
    )


def _places_on_crossings(graph: LaneGraph) -> np.ndarray:
    """Returns `Streets.over` of a graph."""
    ways = [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]
    lines = [shapely.LineString(one.line[:, :2]) for one in graph.crossings]
    over = np.full((len(ways), len(lines)), np.nan)
    tree = shapely.STRtree(ways)
    for c, line in enumerate(lines):
        for way in tree.query(line, "intersects"):
            where = shapely.intersection(ways[way], line)
            over[way, c] = line.project(where.centroid)
    return over


def _speeds(piece: Piece) -> np.ndarray:
    """Returns the allowed speed at each point of a piece [m/s]."""
    xy = piece.points[:, :2]
    speed = np.full(len(xy), piece.limit)
    step = piece.length / (len(xy) - 1)
    reach = min(_CHORD, (len(xy) - 1) // 2)
    if reach > 0:
        a, b, c = xy[: -2 * reach], xy[reach:-reach], xy[2 * reach :]
        u, w = b - a, c - b
        turn = np.abs(
            arctan2(
                u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0], np.sum(u * w, axis=1)
            )
        )
        curvature = np.pad(turn / (reach * step), reach, mode="edge")
        bend = np.sqrt(_LATERAL / np.maximum(curvature, 1e-6))
        speed = np.minimum(speed, np.maximum(bend, _SLOWEST))
    for k in range(len(speed) - 2, -1, -1):
        ahead = np.sqrt(speed[k + 1] ** 2 + 2.0 * _BEFORE_BENDS * step)
        speed[k] = min(speed[k], ahead)
    return speed


def find_conflicts(
    graph: LaneGraph,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns where vehicles are in conflict with each other or with crossings.

    A path through a junction is called a way. Two different ways are in
    conflict if the areas that vehicles sweep on them overlap. A way and a
    crossing are in conflict if the area swept on the way overlaps the crossing.
    A lane is in conflict only with crossings whose attribute `marked` is False.

    Args:
        graph: lane graph with P pieces (ways and parts of lanes) and C
            crossings.

    Returns:
        Three arrays (2, P + C, P + C) with indices `k, a, b`. `k` is 0 for two
        small vehicles, and 1 if at least one is large. `a` and `b` are numbers
        of pieces or, from P on, of crossings.

        - How far the front of a vehicle has gone along `a` when the vehicle
          reaches the area of `b` [m]; inf without a conflict, or if `a` is a
          crossing.
        - How far the rear of a vehicle has gone along `a` when the vehicle has
          left the area of `b` [m]; 0 without a conflict, or if `a` is a
          crossing.
        - `SPLIT` for two ways that overlap only at their beginning, because
          they come from the same lane; `MERGE` for two ways that overlap only
          at their end, because they lead to the same lane; otherwise 0.
    """
    small_axles = (-1.6, 1.75)
    num_pieces = len(graph.pieces)
    number = num_pieces + len(graph.crossings)
    begin = np.full((2, number, number), np.inf)
    clear = np.zeros(begin.shape)
    joint = np.zeros(begin.shape, np.int8)
    origin = {way: k for k in graph.lanes for way in graph.pieces[k].after}
    for k, (size, axles) in enumerate(
        ((SMALL_SIZE, small_axles), (LARGEST.size[:2], LARGEST.axles))
    ):
        swept = [
            swept_hulls(piece, size, axles) if piece.is_way else None
            for piece in graph.pieces
        ]
        areas = [
            shapely.Polygon() if one is None else shapely.union_all(one[1])
            for one in swept
        ]
        areas += [crossing.area for crossing in graph.crossings]
        tree = shapely.STRtree(areas)
        pairs = tree.query(areas, predicate="intersects").T.tolist()
        shapely.prepare(areas)
        for one, other in pairs:
            if one < num_pieces and one != other:
                front, hulls = swept[one]
                meets = np.flatnonzero(shapely.intersects(areas[other], hulls))
                first, last = meets[0], meets[-1]
                begin[k, one, other] = front[first]
                clear[k, one, other] = max(front[last + 1] - size[0], _STEP)
                if other >= num_pieces or last - first >= len(meets):
                    continue
                if first == 0 and origin.get(one, -1) == origin.get(other, -2):
                    joint[k, one, other] = SPLIT
                elif (
                    last == len(hulls) - 1
                    and graph.pieces[one].after == graph.pieces[other].after
                ):
                    joint[k, one, other] = MERGE
    for c, crossing in enumerate(graph.crossings, num_pieces):
        for k in [] if crossing.marked else graph.lanes:
            line = shapely.LineString(graph.pieces[k].points[:, :2])
            if line.intersects(crossing.area):
                ends = shapely.get_coordinates(line & crossing.area)[[0, -1]]
                begin[:, k, c], clear[:, k, c] = sorted(
                    line.project(shapely.Point(end)) for end in ends
                )
    return begin, clear, np.minimum(joint, joint.transpose(0, 2, 1))


def swept_hulls(
    piece: Piece, size: tuple[float, float], axles: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the areas that a vehicle sweeps on a piece, step by step.

    The areas include a lateral clearance of 0.25 m on either side.

    Args:
        piece: the piece of the lane graph along which the vehicle drives.
        size: length and width of the vehicle [m].
        axles: x of the rear and the front axle from the vehicle's middle [m].

    Returns:
        N + 1 distances of the front bumper along the piece [m]; the N areas
        swept from each distance to the next, as seen from above [m].
    """
    line = piece.points[:, :2]
    along = distances_along(line)
    length = along[-1]

    def at(s: np.ndarray) -> np.ndarray:
        """Returns the places (M, 2) at distances (M,) along the way [m].

        Beyond its ends, the way goes on straight.
        """
        inside = np.clip(s, 0.0, length)
        xy = np.column_stack([np.interp(inside, along, x) for x in line.T])
        first = (line[1] - line[0]) / math.dist(line[1], line[0])
        last = (line[-1] - line[-2]) / math.dist(line[-1], line[-2])
        xy += np.minimum(s, 0.0)[:, None] * first
        return xy + np.maximum(s - length, 0.0)[:, None] * last

    count = int(np.ceil((length + size[0]) / _STEP)) + 1
    front = np.linspace(0.0, length + size[0], count)
    middle = front - size[0] / 2
    rear_axle, front_axle = at(middle + axles[0]), at(middle + axles[1])
    ahead = front_axle - rear_axle
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    centre = rear_axle - axles[0] * ahead
    reach = size[0] / 2
    half = size[1] / 2 + _CLEARANCE
    corners = outlines(centre, ahead, reach, reach, half)
    points = np.concatenate([corners[:-1], corners[1:]], axis=1)
    return front, np.array(shapely.convex_hull(shapely.multipoints(points)))


def _find_ego(
    graph: LaneGraph, box: EgoBox, xy: np.ndarray, yaw: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Returns the fields of `Streets` from `until` on; see `make_streets`."""
    # A car that stands is processed only once.
    poses = np.column_stack([xy, yaw])
    is_new = np.append(True, (np.diff(poses, axis=0) != 0.0).any(axis=1))
    corners = box.corners(xy[is_new], yaw[is_new])
    boxes = shapely.polygons(corners)
    lines = np.array(
        [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]
    )
    areas = [
        line.buffer(_HALF_LANE, cap_style="flat", join_style="mitre")
        for line in lines
    ] + [crossing.area for crossing in graph.crossings]
    until = np.full((len(corners), len(areas)), np.inf, np.float32)
    rear, front, x, y = np.zeros((4, len(corners), len(lines)))
    which, places = shapely.STRtree(areas).query(boxes, predicate="intersects")
    until[which, places] = 0.0
    on_piece = places < len(lines)
    which, places = which[on_piece], places[on_piece]
    along = shapely.line_locate_point(
        lines[places][:, None], shapely.points(corners[which])
    )
    behind, ahead = along.min(axis=1), along.max(axis=1)
    rear[which, places], front[which, places] = behind, ahead
    tangent = np.subtract(
        *(
            shapely.get_coordinates(
                shapely.line_interpolate_point(lines[places], end)
            )
            for end in (ahead, behind)
        )
    )
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-6)[:, None]
    x[which, places], y[which, places] = tangent.T
    velocity = np.gradient(xy, STEP, axis=0)
    pose = np.cumsum(is_new) - 1
    speed = velocity[:, :1] * x[pose] + velocity[:, 1:] * y[pose]
    until = until[pose]
    for k in range(len(xy) - 2, -1, -1):
        np.minimum(until[k], until[k + 1] + STEP, out=until[k])
    return until, *(
        each.astype(np.float32) for each in (rear[pose], front[pose], speed)
    )


def places_on(
    streets: Streets, pieces: np.ndarray, s: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns x, y and z of places, given by pieces and distances.

    Beyond its ends, a piece goes straight on.

    Args:
        streets: arrays of all pieces.
        pieces: (...) numbers of the pieces.
        s: (...) distances along the pieces [m].

    Returns:
        Three arrays (...) [m].
    """
    rows = streets.pieces[pieces]
    at = s / rows["step"]
    k = np.minimum(np.maximum(np.floor(at), 0.0), rows["num_points"] - 2.0)
    row = rows["first"] + k.astype(int)
    share = at - k
    here, there = streets.points[row], streets.points[row + 1]
    place = here + share[..., None] * (there - here)
    return place[..., 0], place[..., 1], place[..., 2]


@compiled
def speed_on(streets: Streets, piece: int, s: float) -> float:
    """Returns the allowed speed on a piece of a lane graph [m/s].

    Args:
        streets: arrays of all pieces.
        piece: number of the piece.
        s: distance along the piece [m].
    """
    row = streets.pieces[piece]
    k = min(max(int(s / row.step), 0), row.num_points - 1)
    return streets.speed[row.first + k]


@compiled
def is_ego_far(
    streets: Streets, k: int, lane: int, s: float, wait: float = WAIT
) -> bool:
    """Returns whether a vehicle can leave a lane before the ego car comes.

    Args:
        streets: arrays of all lanes, with the times of the ego car.
        k: number of the time step.
        lane: number of the lane.
        s: distance of the vehicle along the lane [m].
        wait: time that the vehicle may have to wait at the lane's end [s].
    """
    until = streets.until[k, lane]
    if until == 0.0:
        # A vehicle may follow the ego car.
        return streets.ego_speed[k, lane] >= 0.0 and (
            streets.ego_rear[k, lane] > s + 2.0
        )
    row = streets.pieces[lane]
    speed = _SLOW_PART * streets.speed[row.first]
    return until > (row.length - s) / speed + wait
