"""Programs of signals: splits, coordination, and walkers' green."""

from itertools import pairwise

import numpy as np
import pytest

from cns_drake.roads import load_road_network
from cns_drake.scenarios import shipped_maps
from cns_drake.traffic import LaneGraph, Piece, make_lane_graph
from cns_drake.traffic.conflicts import find_conflicts
from cns_drake.traffic.streets import make_signals
from cns_drake.traffic.traffic_flow import way_shares

AHEAD = np.array([0.8, 0.6, 0.0])
ASIDE = np.array([-0.6, 0.8, 0.0])


def piece(
    start, along, length, *after, junction, phase=-1, way=False, limit=9.0
):
    s = np.linspace(0.0, length, int(2 * length) + 1)[:, None]
    return Piece(start + s * along, limit, way, after, -1, -1, junction, phase)


def green_at(signals, place, t):
    late = (t - signals.green_from[place]) % signals.cycle
    return late < signals.green_for[place]


@pytest.mark.parametrize(("limit", "time"), [(7.5, 12.0), (20.0, 10.0)])
def test_vehicles_that_leave_one_signal_on_green_meet_green(limit, time):
    """A street of 90 m ways and lanes, and a road across at each.

    No column is faster than 9 m/s.
    """
    pieces = []
    count = 4
    for j in range(count):
        at = 90.0 * j * AHEAD
        first = len(pieces)
        across = at + 70.0 * AHEAD - 40.0 * ASIDE
        # Behind the last one a way without a signal leads back.
        pieces += [
            piece(at, AHEAD, 60.0, first + 1, junction=j, limit=limit),
            piece(at + 60 * AHEAD, AHEAD, 30.0, first + 4, junction=j, phase=0,
                  way=True, limit=limit),
            piece(across, ASIDE, 30.0, first + 3, junction=j),
            piece(across + 30 * ASIDE, ASIDE, 20.0, first + 2, junction=j,
                  phase=1, way=True),
        ]  # fmt: skip
    at = 90.0 * count * AHEAD
    first = len(pieces)
    pieces += [
        piece(at, AHEAD, 60.0, first + 1, junction=count, limit=limit),
        piece(at + 60 * AHEAD, AHEAD, 30.0, 0, junction=count, way=True),
    ]
    graph = LaneGraph(tuple(pieces))
    signals = make_signals(graph, find_conflicts(graph)[0][0])
    assert 60.0 <= signals.cycle <= 90.0
    ways = 4 * np.arange(count) + 1
    for way, other in pairwise(ways):
        start, lasts = signals.green_from[way], signals.green_for[way]
        # The column leaves in the first six tenths of green.
        leaves = start + np.array([0.1, 0.25, 0.4, 0.6]) * lasts
        assert green_at(signals, other, leaves + time).all()
    # Red for all between the phases of a junction, for 4 s.
    t = np.arange(0.0, signals.cycle, 0.05)
    for way in ways:
        both = np.array([green_at(signals, k, t) for k in (way, way + 2)])
        assert both.sum(axis=0).max() == 1
        assert (both.sum(axis=0) == 0).mean() * signals.cycle == pytest.approx(
            8.0, abs=0.2
        )


def two_phases():
    """From one lane, one half goes on to the other, and all come back.

    Ways 2 and 3 have the first phase, 4 has the second, and 6 has no signal.
    """
    x = 30.0 * AHEAD
    return LaneGraph(
        (
            piece(0 * x, AHEAD, 30.0, 2, 3, junction=0),
            piece(9 * ASIDE, AHEAD, 30.0, 4, junction=0),
            piece(x, AHEAD, 20.0, 0, junction=0, phase=0, way=True),
            piece(x, ASIDE, 20.0, 1, junction=0, phase=0, way=True),
            piece(x + 9 * ASIDE, AHEAD, 20.0, 0, junction=0, phase=1, way=True),
            piece(9 * x, AHEAD, 30.0, 6, junction=1),
            piece(10 * x, AHEAD, 20.0, 5, junction=1, way=True),
        ),
    )


@pytest.mark.parametrize(
    ("met", "way"),
    [
        # Twice as many drive in the first phase.
        ({2: 9.0, 3: 9.0, 4: 9.0, 6: 9.0}, 4),
        # Way 4 begins behind the crossing.
        ({2: 9.0, 3: 9.0, 4: 3.0, 6: 9.0}, 2),
        ({6: 9.0}, 6),
    ],
)
def test_walkers_have_green_while_the_fewest_drive_over(met, way):
    graph = two_phases()
    begin = np.full((8, 8), np.inf)
    begin[list(met), 7] = list(met.values())
    signals = make_signals(graph, begin)
    assert signals.green_from[7] == signals.green_from[way]
    assert signals.green_for[7] == signals.green_for[way]
    # All day where there is no signal.
    assert (signals.green_for[7] == signals.cycle) == (way == 6)


def test_green_is_split_by_flow():
    graph = two_phases()
    np.testing.assert_allclose(way_shares(graph, 0), [0.5, 0.5])
    signals = make_signals(graph, find_conflicts(graph)[0][0])
    one, other = signals.green_for[[2, 4]]
    assert one + other == pytest.approx(signals.cycle - 8.0)
    assert (one - 14.0) / (other - 14.0) == pytest.approx(2.0, rel=0.02)


def test_most_drivers_go_straight_on_and_few_turn_round():
    angle = np.linspace(0.0, 1.0, 9)[:, None]
    ways = []
    for turn in (0.3, np.pi / 2, -np.pi / 2, np.pi):
        arc = np.cos(turn * angle) * AHEAD + np.sin(turn * angle) * ASIDE
        ways.append(Piece(np.cumsum(arc, axis=0), 9.0, True, (0,), junction=0))
    lane = piece(0 * AHEAD, AHEAD, 30.0, 1, 2, 3, 4, junction=0)
    shares = way_shares(LaneGraph((lane, *ways)), 0)
    np.testing.assert_allclose(shares / shares[1], [3.0, 1.0, 1.0, 0.02])


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["metropolis", "downtown"])
def test_walkers_cross_while_vehicles_before_them_wait(name):
    network = load_road_network(shipped_maps()[name] / "roads.yaml")
    graph = make_lane_graph(network)
    begin = find_conflicts(graph)[0][0]
    signals = make_signals(graph, begin)
    t = np.arange(0.0, signals.cycle, 0.1)
    number = len(graph.pieces)
    with_signal = 0
    for c in range(number, len(begin)):
        walk = green_at(signals, c, t)
        for way in np.flatnonzero(begin[:number, c] < 4.0):
            if signals.green_for[way] < signals.cycle:
                assert not (walk & green_at(signals, way, t)).any()
                with_signal += 1
    assert with_signal > 20
