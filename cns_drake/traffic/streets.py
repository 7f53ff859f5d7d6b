"""Lanes, signal programs and the ego car's path, as arrays for fast loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely

from cns_drake.base import arctan2, compiled
from cns_drake.traffic.conflicts import find_conflicts
from cns_drake.traffic.ego_car import EgoBox, find_ego
from cns_drake.traffic.lane_graph import LaneGraph, Piece
from cns_drake.traffic.traffic_flow import flows, way_shares

# Greatest lateral acceleration in bends [m/s^2].
_LATERAL = 2.2
# Greatest braking before bends [m/s^2].
_BEFORE_BENDS = 1.5
# Speed below which bends do not reduce it [m/s].
_SLOWEST = 2.5
# The curvature is that of chords over this many points to both sides.
_CHORD = 4
# When the ego car enters a lane, the lane must be empty. Drivers assume that
# they drive at this share of the speed limit.
_SLOW_PART = 0.6
# Drivers assume that they wait for this time at the lane's end [s].
WAIT = 20.0
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
        begin, clear, joint: (2, P + C, P + C), see
            `cns_drake.traffic.conflicts.find_conflicts`.
        over: (P, C) place on a crossing's line where a path through a junction
            leads over the crossing [m]; NaN if the path does not cross.
        until: (K, P + C) float32 time until the ego car reaches the piece or
            crossing [s]; 0 while the ego car is there, inf if the ego car never
            gets there.
        ego_rear, ego_front: (K, P) float32 distances of the ego car's rear and
            front along a piece while the car is on the piece [m].
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
        np.concatenate([_allowed_speeds(piece) for piece in pieces]),
        np.array([a for piece in pieces for a in piece.after]),
        np.concatenate([np.cumsum(of_piece) for of_piece in shares]),
        make_signals(graph, conflicts[0][0]),
        *conflicts,
        _places_on_crossings(graph),
        *find_ego(graph, box, xy, yaw),
    )


def _places_on_crossings(graph: LaneGraph) -> np.ndarray:
    """Returns `Streets.over` of a graph."""
    ways = [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]
    lines = [
        shapely.LineString(crossing.line[:, :2]) for crossing in graph.crossings
    ]
    over = np.full((len(ways), len(lines)), np.nan)
    tree = shapely.STRtree(ways)
    for c, line in enumerate(lines):
        for way in tree.query(line, "intersects"):
            where = shapely.intersection(ways[way], line)
            over[way, c] = line.project(where.centroid)
    return over


def _allowed_speeds(piece: Piece) -> np.ndarray:
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


# Signal programs of junctions. All signals have the same cycle. The green time
# of a junction is divided among its phases in proportion to the incoming flow.
# The offsets of the junctions are chosen so that vehicles that leave a junction
# on green wait little at the next junction (a green wave, where possible).

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
# A vehicle that starts towards a crossing at its stop line disturbs pedestrians
# as much as this many vehicles that meet them behind the junction. Pedestrians
# have no green together with such vehicles unless all phases have some.
_STARTING_WEIGHT = 1e3


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


class _Columns(NamedTuple):
    """The columns of vehicles that go from one signal to another.

    Attributes:
        way: (W,) the way on which a column leaves the first junction.
        next_way: (W,) the way on which it meets the signal of the next one.
        arrival: (W, S) times after the start of the first junction's cycle at
            which shares of the column reach the next signal [s].
        flow: (W,) flow of vehicles in the column.
    """

    way: np.ndarray
    next_way: np.ndarray
    arrival: np.ndarray
    flow: np.ndarray


def make_signals(graph: LaneGraph, begin: np.ndarray) -> Signals:
    """Returns the signal program of all traffic lights.

    Args:
        graph: lane graph with P pieces and C crossings.
        begin: (P + C, P + C) distances along piece a at which the front of a
            small vehicle reaches piece or crossing b [m], with the indices a,
            b; see `cns_drake.traffic.conflicts.find_conflicts`.
    """
    number = len(graph.pieces)
    flow = flows(graph)
    phase = np.array([piece.phase for piece in graph.pieces])
    cycle = max(_LEAST_CYCLE, (phase.max() + 1) * (_ALL_RED + _LEAST_PHASE))
    green_from, green_for = np.zeros(len(begin)), np.full(len(begin), cycle)
    reach = begin[:number, number:]
    weight = np.where(reach < _AT_LINE, _STARTING_WEIGHT, np.isfinite(reach))
    # The flow over each crossing from each piece, (P, C).
    crossing_flow = flow[:, None] * weight
    owner = _owners(graph, reach)
    for j in np.unique(owner[owner >= 0]):
        phases = _ways_by_phase(graph, j)
        if len(phases) == 1:
            # All ways have green during the whole cycle.
            continue
        starts, green = _divide_cycle(cycle, _needs(graph, phases, flow))
        for ways, start, lasts in zip(phases, starts, green, strict=True):
            green_from[ways], green_for[ways] = start, lasts
        for crossing in np.flatnonzero(owner[number:] == j):
            k = _quietest_phase(phases, crossing_flow[:, crossing])
            row = number + crossing
            green_from[row], green_for[row] = starts[k], green[k]
    signals = Signals(cycle, green_from, green_for)
    offsets = _offsets(
        _find_columns(graph, flow, owner, signals), owner, signals
    )
    green_from += np.where(owner >= 0, offsets[owner], 0.0)
    return Signals(cycle, green_from % cycle, green_for)


def _owners(graph: LaneGraph, reach: np.ndarray) -> np.ndarray:
    """Returns the junctions whose signals pieces and crossings have, (P + C,).

    The result is -1 where there is no signal. A crossing has the signal of a
    junction whose ways lead over it.

    Args:
        graph: lane graph with P pieces and C crossings.
        reach: (P, C) distances along pieces to crossings [m]; infinite where a
            piece does not lead over a crossing.
    """
    of_pieces = np.array(
        [piece.junction if piece.phase >= 0 else -1 for piece in graph.pieces]
    )
    of_crossings = [
        max(of_pieces[np.isfinite(column)], default=-1) for column in reach.T
    ]
    return np.array([*of_pieces, *of_crossings])


def _ways_by_phase(graph: LaneGraph, junction: int) -> list[np.ndarray]:
    """Returns the numbers of a junction's ways in each phase of its signal."""
    phases: dict[int, list[int]] = {}
    for k, piece in enumerate(graph.pieces):
        if piece.junction == junction and piece.phase >= 0:
            phases.setdefault(piece.phase, []).append(k)
    return [np.array(ways) for _, ways in sorted(phases.items())]


def _needs(
    graph: LaneGraph, phases: list[np.ndarray], flow: np.ndarray
) -> np.ndarray:
    """Returns the greatest flow of one lane into the ways of each phase.

    Args:
        graph: lane graph with P pieces.
        phases: numbers of the ways with green in each phase.
        flow: (P,) flow on each piece.
    """
    # Way -> the lane before it.
    origin = np.zeros(len(graph.pieces), int)
    for k in graph.lanes:
        origin[list(graph.pieces[k].after)] = k
    return np.array(
        [np.bincount(origin[ways], flow[ways]).max() for ways in phases]
    )


def _divide_cycle(
    cycle: float, need: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Divides a cycle among phases in proportion to their need.

    Args:
        cycle: duration of the cycle [s].
        need: (F,) need of each phase, in any unit.

    Returns:
        (F,) times in the cycle at which green begins, and (F,) its durations
        [s].
    """
    free = cycle - len(need) * (_ALL_RED + _LEAST_PHASE)
    green = _LEAST_PHASE + free * need / need.sum()
    return np.cumsum(green + _ALL_RED) - green - _ALL_RED, green


def _quietest_phase(phases: list[np.ndarray], flow: np.ndarray) -> int:
    """Returns the phase in which the least flow leads over a crossing.

    Args:
        phases: numbers of the ways with green in each phase.
        flow: (P,) flow over the crossing from each piece.
    """
    return int(np.argmin([flow[ways].sum() for ways in phases]))


def _find_columns(
    graph: LaneGraph, flow: np.ndarray, owner: np.ndarray, signals: Signals
) -> _Columns:
    """Returns the columns that leave a signal for one of another junction.

    Args:
        graph: lane graph with P pieces and C crossings.
        flow: (P,) flow on each piece.
        owner: (P + C,) the junction whose signal a piece or crossing has; -1
            for none.
        signals: the signal program without offsets.
    """
    pieces = graph.pieces
    # A way leads to one lane. The first of the ways behind a lane stands for
    # all of them. A piece that leads nowhere counts as its own successor.
    following = np.array(
        [(*piece.after, k)[0] for k, piece in enumerate(pieces)]
    )
    # Behind a way follow a lane and the next way.
    next_way = following[following]
    time = np.array(
        [piece.length / min(piece.limit, _COLUMN_SPEED) for piece in pieces]
    )
    of_piece = owner[: len(pieces)]
    way = np.flatnonzero(
        (of_piece >= 0)
        & (of_piece[next_way] >= 0)
        & (of_piece[next_way] != of_piece)
    )
    arrival = signals.green_from[way] + time[way] + time[following[way]]
    leaving = signals.green_for[way, None] * _LEAVING_SHARES
    return _Columns(way, next_way[way], arrival[:, None] + leaving, flow[way])


def _offsets(
    columns: _Columns, owner: np.ndarray, signals: Signals
) -> np.ndarray:
    """Returns the offsets (J,) of the junctions' cycles [s].

    One junction after the other takes the offset with which the columns wait
    least.

    Args:
        columns: columns of vehicles between two signals.
        owner: (P + C,) the junction whose signal a piece or crossing has; -1
            for none.
        signals: the signal program without offsets.
    """
    cycle = signals.cycle
    first, second = owner[columns.way], owner[columns.next_way]
    lasts = signals.green_for[columns.next_way, None]
    since_green = columns.arrival - signals.green_from[columns.next_way, None]
    offsets = np.zeros(1 + max(0, owner.max()))

    def wait() -> float:
        """Returns the sum of all vehicles' waits with the present offsets."""
        shift = offsets[first] - offsets[second]
        late = (since_green + shift[:, None]) % cycle
        waits = np.where(late < lasts, 0.0, cycle - late)
        return float(columns.flow @ waits.sum(1))

    for _ in range(_OFFSET_ROUNDS):
        for j in np.unique(first):
            found = []
            for offset in np.arange(0.0, cycle, _OFFSET_STEP):
                offsets[j] = offset
                found.append(wait())
            offsets[j] = _OFFSET_STEP * int(np.argmin(found))
    return offsets
