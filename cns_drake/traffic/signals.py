"""Programs of signals: when ways are green, and when walkers may cross.

All signals have one cycle. Green is split among the phases of a junction by the
flow that comes in, and offsets of the junctions are such that vehicles which
leave one on green wait little at the next (a green wave, where there is one).
"""

from typing import NamedTuple

import numpy as np

from cns_drake.traffic.lane_graph import LaneGraph

# Duration of a cycle at least, of red for all after each phase, and of a phase
# at least [s].
_CYCLE, _RED, _LEAST = 60.0, 4.0, 14.0
# Speed of a column of vehicles at most [m/s], and the parts of its green at
# which vehicles leave a junction.
_PACE, _LEAVE = 9.0, np.array([0.1, 0.25, 0.4, 0.6])
# Distance of the offsets that are tried [s], and number of rounds.
_STEP, _ROUNDS = 2.0, 3
# A crossing so near to the stop line lies before it [m].
_AT_LINE = 6.0
# Steps of a vehicle that takes any way.
_WANDERS = 200
# Drivers who go straight on, and who turn round, for each one who turns; and
# the cosine of the least turn.
_STRAIGHT, _ROUND, _TURN = 3.0, 0.02, 0.7


class Signals(NamedTuple):
    """The program of P pieces and C crossings.

    Attributes:
        cycle: its duration [s].
        green_from, green_for: (P + C,) where a cycle's green, or that for
            walkers, begins and how long it lasts; the whole cycle without a
            signal [s].
    """

    cycle: float
    green_from: np.ndarray
    green_for: np.ndarray


def make_signals(graph: LaneGraph, begin: np.ndarray) -> Signals:
    """Returns the program of all signals.

    Where ways begin to meet crossings is (P + C, P + C), see `find_conflicts`.
    """
    pieces = graph.pieces
    flow = _flows(graph)
    junction = np.array([piece.junction for piece in pieces])
    phase = np.array([piece.phase for piece in pieces])
    # Way -> the lane before it.
    origin = np.zeros(len(pieces), int)
    for k in graph.lanes:
        origin[list(pieces[k].after)] = k
    cycle = max(_CYCLE, (phase.max() + 1) * (_RED + _LEAST))
    green_from, green_for = np.zeros(len(begin)), np.full(len(begin), cycle)
    place = begin[: len(pieces), len(pieces) :]
    # No walker goes before vehicles that start.
    cost = flow[:, None] * np.where(place < _AT_LINE, 1e3, np.isfinite(place))
    # The junction whose signal each way and crossing has, -1 for none.
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
        free = cycle - len(own) * (_RED + _LEAST)
        green = _LEAST + free * need / need.sum()
        starts = np.cumsum(green + _RED) - green - _RED
        for ways, start, lasts in zip(own, starts, green, strict=True):
            green_from[ways], green_for[ways] = start, lasts
        for column in np.flatnonzero(owner[len(pieces) :] == j):
            # Walkers cross while the least flow leads over.
            crossed = [cost[ways, column].sum() for ways in own]
            k, row = int(np.argmin(crossed)), len(pieces) + column
            green_from[row], green_for[row] = starts[k], green[k]
    offsets = _offsets(
        graph, flow, owner, Signals(cycle, green_from, green_for)
    )
    green_from += np.where(owner >= 0, offsets[owner], 0.0)
    return Signals(cycle, green_from % cycle, green_for)


def way_shares(graph: LaneGraph, lane: int) -> np.ndarray:
    """Returns the shares of drivers that take each way behind a lane."""
    after = graph.pieces[lane].after
    likes = []
    for way in after:
        steps = np.diff(graph.pieces[way].points[:, :2], axis=0)[[0, -1]]
        a, b = steps / np.linalg.norm(steps, axis=1)[:, None]
        turn = a @ b
        likes.append(
            _STRAIGHT if turn > _TURN else 1.0 if turn > -_TURN else _ROUND
        )
    return np.array(likes) / sum(likes)


def _flows(graph: LaneGraph) -> np.ndarray:
    """Returns the (P,) shares of vehicles that take any way at each junction.

    They are the mean over a long time.
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
    """Returns the (J,) offsets of the junctions' cycles [s].

    One junction after the other takes the offset with which the (P,) flow of
    vehicles waits least. The junction whose signal each place has is (P + C,),
    -1 for none.
    """
    cycle, green_from, green_for = signals
    # Behind a way are a lane and its first way.
    lane = np.array([(*p.after, k)[0] for k, p in enumerate(graph.pieces)])
    after, number = lane[lane], len(lane)
    time = np.array([p.length / min(p.limit, _PACE) for p in graph.pieces])
    way = np.flatnonzero(
        (owner[:number] >= 0)
        & (owner[after] >= 0)
        & (owner[after] != owner[:number])
    )
    leave = green_from[way] + time[way] + time[lane[way]]
    leave = leave[:, None] + green_for[way, None] * _LEAVE
    weight, after = flow[way], after[way]
    last, begins = green_for[after, None], green_from[after, None]
    offsets = np.zeros(1 + max(0, owner.max()))

    def wait() -> float:
        shift = offsets[owner[way]] - offsets[owner[after]]
        late = (leave - begins + shift[:, None]) % cycle
        return float(weight @ np.where(late < last, 0.0, cycle - late).sum(1))

    for _ in range(_ROUNDS):
        for j in np.unique(owner[way]):
            found = []
            for offset in np.arange(0.0, cycle, _STEP):
                offsets[j] = offset
                found.append(wait())
            offsets[j] = _STEP * int(np.argmin(found))
    return offsets
