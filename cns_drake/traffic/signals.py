"""Signal programs of junctions.

All signals have the same cycle. The green time of a junction is divided among
its phases in proportion to the incoming flow. The offsets of the junctions are
chosen so that vehicles that leave a junction on green wait little at the next
junction (a green wave, where possible).
"""

from typing import NamedTuple

import numpy as np

from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.traffic_flow import flows

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
            b; see `cns_drake.traffic.conflicts.find_conflicts`.
    """
    pieces = graph.pieces
    flow = flows(graph)
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
