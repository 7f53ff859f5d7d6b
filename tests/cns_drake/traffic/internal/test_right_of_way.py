"""Vehicles on ways that cross, split and join: closed forms."""

from dataclasses import replace
from types import SimpleNamespace

from helpers.vehicle_records import make_vehicles
import numpy as np
import pytest

from cns_drake.traffic import CURRENT, EgoBox, LaneGraph, Piece, make_crossing
from cns_drake.traffic.car_following import accelerations
from cns_drake.traffic.conflicts import MERGE, SPLIT
from cns_drake.traffic.ego_car import STEP
from cns_drake.traffic.giving_way import find_prior
from cns_drake.traffic.occupants import find_occupants
from cns_drake.traffic.right_of_way import grant_ways
from cns_drake.traffic.streets import make_streets
from cns_drake.traffic.vehicle_records import begin_traffic, make_crossings
from cns_drake.traffic.vehicle_steps import advance

C = np.cos(0.4)
S = np.sin(0.4)
R = np.array([[C, -S, 0.0], [S, C, 0.0], [0.0, 0.0, 1.0]])


def line(start, end):
    """Returns points half a metre apart on a line, turned by 0.4 rad."""
    start, end = np.array([*start, 0.0]), np.array([*end, 0.0])
    count = int(np.linalg.norm(end - start) / 0.5) + 1
    return np.linspace(start, end, count) @ R.T


def junction(phases=(-1, -1), walkers=False):
    """Two straight ways of 40 m that cross at right angles at their 20 m."""
    pieces = [
        piece
        for first, along, phase in zip(
            (0, 3), ((1, 0), (0, 1)), phases, strict=True
        )
        for piece in (
            Piece(
                line(*(np.multiply(along, s) for s in (-120, -20))),
                10.0,
                False,
                (first + 1,),
                junction=0,
            ),
            Piece(
                line(*(np.multiply(along, s) for s in (-20, 20))),
                10.0,
                True,
                (first + 2,),
                junction=0,
                phase=phase,
            ),
            Piece(
                line(*(np.multiply(along, s) for s in (20, 120))),
                10.0,
                False,
                (first + 1,),
                junction=0,
            ),
        )
    ]
    crossings = []
    if walkers:
        ends = np.array([[10.0, 4.0, 0.0], [10.0, -4.0, 0.0]]) @ R.T
        crossings = [make_crossing(ends, 2.4)]
    graph = LaneGraph(tuple(pieces), tuple(crossings))
    far = np.tile((1e4, 0.0), (1200, 1))
    streets = make_streets(graph, EgoBox(-1.0, 3.0, 1.0), far, np.zeros(1200))
    return graph, streets


def vehicles(*states):
    """Returns records of vehicles: the lane, the place on it, the speed."""
    return make_vehicles(
        *((range(lane, lane + 3), s, v) for lane, s, v in states)
    )


def traffic_of(graph, streets, cars):
    return begin_traffic(streets, cars, make_crossings(graph), 1)


def on_way(cars, i, way, s, order):
    cars["path"][i, CURRENT - 1 : CURRENT + 2] = way - 1, way, way + 1
    cars["s"][i], cars["held"][i], cars["order"][i] = s, way, order


def test_later_ones_wait_for_earlier_ones_alone():
    cars = vehicles((0, 0, 0), (3, 0, 0))
    traffic = traffic_of(*junction(), cars)
    on_way(cars, 0, 1, 5.0, 7)
    on_way(cars, 1, 4, 8.0, 8)
    # The strips are 2.26 m wide, with 0.25 m beside them.
    before = 20.0 - 2.26 / 2 - 0.25
    stop, gap, _ = find_prior(traffic, 1)
    assert before - 8.0 - 1.01 <= stop <= before - 8.0
    assert gap == np.inf
    assert find_prior(traffic, 0)[:2] == (np.inf, np.inf)
    cars["order"] = 8, 7
    assert find_prior(traffic, 1)[:2] == (np.inf, np.inf)
    # Once the rear of the first has passed, the second goes on.
    cars["order"] = 7, 8
    for rear, waits in ((21.0, True), (22.6, False)):
        cars["s"][0] = rear + 4.0
        assert np.isfinite(find_prior(traffic, 1)[0]) == waits


@pytest.mark.parametrize("order", [3, 9])
def test_vehicles_wait_for_walkers_who_asked_before(order):
    cars = vehicles((0, 0, 0))
    traffic = traffic_of(*junction(walkers=True), cars)
    traffic.crossings["order"] = order
    on_way(cars, 0, 1, 12.0, 5)
    stop, *_ = find_prior(traffic, 0)
    if order == 3:
        # The crossing begins at 28.8 m.
        assert 28.8 - 12.0 - 1.01 <= stop <= 28.8 - 12.0
    else:
        assert stop == np.inf


def test_follows_on_ways_from_one_lane_and_to_one():
    """Bends of 90 deg to either side, from one lane or into one."""
    angle = np.linspace(0.0, np.pi / 2, 40)
    left = np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle]) * 15
    right = left * (1, -1, 1)
    far = np.tile((1e4, 0.0), (2, 1))
    box = EgoBox(-1.0, 3.0, 1.0)
    for sign, kind in ((1, SPLIT), (-1, MERGE)):
        ways = [sign * one[::sign] for one in (left, right)]
        lanes = [
            line((-60, 0), (0, 0)) @ R
            if kind == SPLIT
            else line((0, 0), (60, 0)) @ R
        ]
        pieces = [Piece(p @ R.T, 9.0, False, junction=0) for p in lanes]
        pieces += [
            Piece(p @ R.T, 9.0, True, (0,) * (kind == MERGE), junction=0)
            for p in ways
        ]
        if kind == SPLIT:
            pieces[0] = Piece(lanes[0] @ R.T, 9.0, False, (1, 2), junction=0)
        graph = LaneGraph(tuple(pieces))
        streets = make_streets(graph, box, far, np.zeros(2))
        assert streets.joint[0, 1, 2] == streets.joint[0, 2, 1] == kind
        cars = vehicles((0, 0, 0), (0, 0, 0))
        cars["path"] = -1
        length = streets.pieces["length"][1]
        places = (5.5, 0.5) if kind == SPLIT else (length - 0.5, length - 5.5)
        for i, s in enumerate(places):
            cars["path"][i, CURRENT], cars["s"][i] = 1 + i, s
            cars["held"][i], cars["order"][i], cars["v"][i] = 1 + i, i, 6.0 - i
        traffic = traffic_of(graph, streets, cars)
        stop, gap, speed = find_prior(traffic, 1)
        assert stop == np.inf
        assert gap == pytest.approx(1.0, abs=0.01)
        assert speed == 6.0


def drive(phases, states, steps=600, walkers=False):
    """Returns places and speeds (T, N) along the way of vehicles."""
    graph, streets = junction(phases, walkers)
    cars = vehicles(*states)
    traffic = traffic_of(graph, streets, cars)
    along = {0: -100.0, 1: 0.0, 2: 40.0, 3: -100.0, 4: 0.0, 5: 40.0}
    places = []
    for k in range(steps):
        places.append([along[c["path"][CURRENT]] + c["s"] for c in cars])
        find_occupants(traffic, k)
        grant_ways(traffic, k)
        advance(traffic, accelerations(traffic))
    return SimpleNamespace(s=np.array(places), cars=cars)


def test_two_who_cross_never_are_there_together():
    found = drive((-1, -1), ((0, 60.0, 8.0), (3, 61.0, 8.0)))
    inside = (found.s > 20 - 1.13) & (found.s - 4.0 < 20 + 1.13)
    assert inside.any(axis=0).all()
    assert not inside.all(axis=1).any()


def test_every_driver_stops_where_there_is_no_signal():
    found = drive((-1, -1), ((0, 40.0, 9.0),), 300)
    speed = np.diff(found.s[:, 0]) / STEP
    stands = np.flatnonzero(speed < 0.5)
    # For 3 s, and the time of slowing down and starting.
    assert 3.0 <= len(stands) * STEP < 5.0
    assert (np.abs(found.s[stands, 0] + 1.0) < 3.0).all()
    assert found.s[-1, 0] > 60.0


def test_red_holds_vehicles_while_others_have_green():
    """Green is from 0 to 26 s and from 30 to 56 s; one of each at 20 m."""
    found = drive((0, 1), ((0, 80.0, 9.0), (3, 80.0, 9.0)))
    entered = (found.s > 0.0).argmax(axis=0) * STEP
    assert entered[0] < 5.0
    assert 30.0 < entered[1] < 33.0
    queue = tuple((0, 98.0 - 7.0 * k, 0.0) for k in range(14))
    found = drive((0, 1), ((3, 98.0, 0.0), *queue))
    entered = (found.s > 0.0).argmax(axis=0) * STEP
    assert 30.0 < entered[0] < 33.0
    # Real columns: at first 3 s from vehicle to vehicle, soon 2 to 2.5 s.
    headways = np.diff(entered[1:])
    assert 2.5 < headways[0] < 4.0
    assert ((headways[1:5] > 1.8) & (headways[1:5] < 2.8)).all()
    # Drivers who can stop do so at red; the others enter within 3 s.
    assert not ((entered > 29.0) & (entered < 60.0))[1:].any()


@pytest.mark.parametrize(("v", "loses"), [(0.0, True), (5.0, False)])
def test_who_stands_behind_another_loses_the_permit(v, loses):
    cars = vehicles((0, 80.0, v), (0, 99.0, 0.0))
    traffic = traffic_of(*junction(), cars)
    cars["granted"][0], cars["held"][0] = True, 1
    cars["since"][1] = 0.0
    find_occupants(traffic, 1)
    grant_ways(traffic, 1)
    assert cars["granted"].tolist() == [not loses, False]
    assert cars["held"].tolist() == [-1 if loses else 1, -1]


@pytest.mark.parametrize("other", [90.0, 99.0])
@pytest.mark.parametrize("lane", [0, 3])
def test_a_car_in_two_lanes_asks_as_the_first_in_both(other, lane):
    """The ego car stands 2 m before the line, in lanes of 100 m."""
    cars = vehicles((lane, other, 0.0), (0, 98.0, 0.0))
    traffic = traffic_of(*junction((0, 0)), cars)
    cars["guided"][1], cars["left_lane"][1] = True, 3
    find_occupants(traffic, 1)
    grant_ways(traffic, 1)
    is_ahead = other > 98.0
    assert cars["granted"].tolist() == [is_ahead, not is_ahead]


def granted(graph, streets, cars, t):
    """Returns who has a permit after the first step at a time [s]."""
    traffic = traffic_of(graph, streets, cars)
    k = round(t / STEP)
    find_occupants(traffic, k)
    grant_ways(traffic, k)
    return cars["granted"].tolist()


@pytest.mark.parametrize("v", [0.0, 4.0])
@pytest.mark.parametrize("comes", [False, True])
@pytest.mark.parametrize("more", [-0.01, 0.01])
def test_nobody_enters_without_room_behind_the_way(v, comes, more):
    """For 4 m and a gap of 2.5 m, likewise for one on the way, of 4 m.

    The last vehicle brakes at 4 m/s^2 at most.
    """
    graph, streets = junction()
    rear = (2 if comes else 1) * 6.5 - v**2 / 8.0
    cars = vehicles((0, 99.0, 0.0), (2, rear + 4.0 + more, v), (0, 0.0, 0.0))
    on_way(cars, 2, *((1, 30.0, 1) if comes else (4, 39.0, 1)))
    cars["granted"][2] = False
    cars["since"][0] = 0.0
    cars["path"][1, CURRENT + 1 :] = -1
    is_granted = granted(graph, streets, cars, 5.0)[0]
    assert is_granted == (more > 0)
    # Otherwise it looks for another way after some time.
    assert cars["refused"][0] == (0.0 if is_granted else STEP)


@pytest.mark.parametrize(("t", "waits"), [(24.9, False), (25.1, True)])
def test_room_is_kept_for_the_ego_car_after_a_long_wait(t, waits):
    """It is 10 m long, has waited since 5 s, and a motorcycle has room."""
    graph, _ = junction()
    pieces = list(graph.pieces)
    pieces[4] = replace(pieces[4], after=(2,))
    far = np.tile((1e4, 0.0), (300, 1))
    graph = LaneGraph(tuple(pieces))
    streets = make_streets(graph, EgoBox(-1.0, 3.0, 1.0), far, np.zeros(300))
    cars = vehicles((3, 99.0, 0.0), (2, 10.0, 0.0), (0, 99.0, 0.0))
    cars["path"][0, CURRENT + 2] = 2
    cars["length"], cars["since"] = (2.0, 4.0, 10.0), (6.0, np.inf, 5.0)
    cars["guided"][2] = True
    assert granted(graph, streets, cars, t) == [not waits, False, False]


@pytest.mark.parametrize("error", [-0.05, 0.05])
def test_nobody_enters_shortly_before_the_ego_car(error):
    """It takes 9 s for 45 m at half of the limit, and is 3 s ahead."""
    graph, streets = junction()
    streets.until[:, 1] = 12.0 + error
    cars = vehicles((0, 99.0, 0.0))
    cars["since"] = 0.0
    assert granted(graph, streets, cars, 5.0) == [error > 0]


@pytest.mark.parametrize(("until", "goes"), [(19.9, False), (20.1, True)])
def test_nobody_waits_on_its_way_shortly_before_the_ego_car(until, goes):
    """Otherwise it may enter before the other one has quite passed."""
    graph, streets = junction()
    streets.until[:, 1] = until
    cars = vehicles((0, 99.0, 0.0), (3, 0.0, 0.0))
    on_way(cars, 1, 4, 20.0, 1)
    cars["v"][1], cars["since"][0] = 9.0, 0.0
    assert granted(graph, streets, cars, 5.0)[0] == goes


@pytest.mark.parametrize("error", [-0.05, 0.05])
@pytest.mark.parametrize(("t", "is_green"), [(20.0, True), (27.0, False)])
def test_who_can_stop_at_red_does(t, is_green, error):
    """In 1 s, and at 2 m/s^2, a metre before the line; green is until 26 s."""
    graph, streets = junction((0, 1))
    needed = 1.0 + 8.0 + 8.0**2 / (2 * 2.0)
    cars = vehicles((0, 100.0 - needed - error, 8.0))
    cars["granted"], cars["held"] = True, 1
    (keeps,) = granted(graph, streets, cars, t)
    assert keeps == (is_green or error < 0)
    assert cars["held"][0] == (1 if keeps else -1)


@pytest.mark.parametrize(
    ("v", "phases", "reach"),
    [
        # From 10 m, or 1.4 times the braking distance and 5 m.
        (2.0, (-1, -1), 10.0),
        (8.0, (-1, -1), 1.4 * 16.0 + 5.0),
        # By 3 s and 5 m farther if there is a signal.
        (8.0, (0, 1), 1.4 * 16.0 + 5.0 + 3.0 * 8.0 + 5.0),
    ],
)
@pytest.mark.parametrize("error", [-0.05, 0.05])
def test_from_where_drivers_ask_for_their_way(v, phases, reach, error):
    graph, streets = junction(phases)
    # The ego car is far away, but for those it makes hurry.
    streets.until[:, 0] = 70.0
    cars = vehicles((0, 100.0 - reach - error, v))
    assert granted(graph, streets, cars, 1.0) == [error < 0]
