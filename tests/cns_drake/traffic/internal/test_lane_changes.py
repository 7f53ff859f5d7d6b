"""Changes of lanes (MOBIL), first places, and drawn ways: closed forms."""

from helpers.vehicle_records import make_vehicles
import numpy as np
import pytest

from cns_drake.traffic import CURRENT, EgoBox, LaneGraph, Piece
from cns_drake.traffic.lane_changes import change_lanes
from cns_drake.traffic.occupants import find_ahead, find_occupants
from cns_drake.traffic.random_numbers import uniform
from cns_drake.traffic.streets import make_streets
from cns_drake.traffic.traffic_planning import place_vehicles
from cns_drake.traffic.vehicle_kinds import KINDS, STANDSTILL_GAP
from cns_drake.traffic.vehicle_records import CROSSING, begin_traffic
from cns_drake.traffic.vehicle_steps import choose_way

# Acceleration, deceleration and headway of the drivers [m/s^2, m/s^2, s].
A = 1.5
B = 2.0
T = 1.3
# Allowed speed, and speed of the vehicles [m/s].
V0 = 15.0
V = 10.0
# The model's wanted gap at equal speeds [m].
WANTED = STANDSTILL_GAP + V * T
# The model's free acceleration [m/s^2].
FREE = A * (1 - (V / V0) ** 4)


def two_lanes(length=400.0):
    """Two lanes beside each other, with a way from each to both of them."""
    x = np.linspace(0.0, length, int(2 * length) + 1)
    lanes = [
        Piece(np.column_stack([x, y + 0 * x, 0 * x]), V0, False, (2, 3),
              left=left, right=right, junction=0)
        for y, left, right in ((0.0, 1, -1), (3.5, -1, 0))
    ]  # fmt: skip
    ways = [
        Piece(lanes[0].points[:40] - (0, 50.0 * k, 0), V0, True, (k,),
              junction=0)
        for k in range(2)
    ]  # fmt: skip
    far = np.tile((1e4, 0.0), (12, 1))
    graph = LaneGraph((*lanes, *ways))
    return make_streets(graph, EgoBox(-1, 3, 1), far, np.zeros(12))


STREETS = two_lanes()


def vehicles(*states):
    """Returns records of vehicles: the lane, the place on it, the speed."""
    states = (((lane, 2), s, v) for lane, s, v in states)
    return make_vehicles(*states, top=40.0, a=A, b=B, headway=T)


def traffic_of(streets, cars, seed=0):
    return begin_traffic(streets, cars, np.zeros(0, CROSSING), seed)


def changes(*states, k=0, **fields):
    """Returns whether the first vehicle changes to the left lane, and all."""
    cars = vehicles(*states)
    for name, value in fields.items():
        cars[name][0] = value
    traffic = traffic_of(STREETS, cars)
    find_occupants(traffic, 0)
    change_lanes(traffic, k)
    return bool(cars["path"][0, CURRENT] == 1), cars


def test_changes_behind_a_slow_vehicle():
    slow = (0, 130.0, 4.0)
    has_changed, cars = changes((0, 100.0, V), slow)
    assert has_changed
    assert cars["left_lane"].tolist() == [0, -1]
    assert cars["change_start"][0] == cars["s"][0] == 100.0
    # For 4 s, and at least 20 m.
    assert cars["change_length"][0] == 40.0
    assert (cars["path"][0, CURRENT + 1 :] == -1).all()
    assert changes((0, 100.0, 4.0), (0, 110.0, 0.0))[1]["change_length"][
        0
    ] == pytest.approx(20.0)
    # Every tenth step, and not in the middle of something else.
    assert not changes((0, 100.0, V), slow, k=1)[0]
    assert changes((0, 100.0, V), slow, k=10)[0]
    for name, value in (("granted", True), ("guided", True), ("left_lane", 1)):
        assert not changes((0, 100.0, V), slow, **{name: value})[0]
    assert not changes((0, 100.0, 2.9), (0, 106.0, 0.0))[0]
    # With its own length, 40 m and 30 m left of the lane.
    for rest, expected in ((74.01, True), (73.99, False)):
        s = 400.0 - rest
        assert changes((0, s, V), (0, s + 30, 4.0))[0] == expected


@pytest.mark.parametrize("error", [-0.02, 0.02])
def test_changes_for_a_gain_alone(error):
    """The gain is 0.25 m/s^2; all drive at 10 m/s."""
    gap = (1 + error) * WANTED * np.sqrt(A / 0.25)
    assert changes((0, 100.0, V), (0, 104.0 + gap, V))[0] == (error < 0)
    # That for others counts a fifth.
    behind = 25.0
    cost = A * (WANTED / behind) ** 2
    gap = (1 + error) * WANTED * np.sqrt(A / (0.25 + 0.2 * cost))
    other = 1, 96.0 - behind, V
    found, _ = changes((0, 100.0, V), (0, 104.0 + gap, V), other)
    assert found == (error < 0)
    # One far ahead in the other lane takes from the gain.
    ahead = 60.0
    loss = A * (WANTED / ahead) ** 2
    gap = (1 + error) * WANTED * np.sqrt(A / (0.25 + loss))
    other = 1, 104.0 + ahead, V
    found, _ = changes((0, 100.0, V), (0, 104.0 + gap, V), other)
    assert found == (error < 0)


@pytest.mark.parametrize("error", [-0.02, 0.02])
def test_nobody_has_to_brake_hard(error):
    """At 2.5 m/s^2 at most, whatever the gain."""
    gap = (1 + error) * WANTED * np.sqrt(A / (FREE + 2.5))
    other = 1, 96.0 - gap, V
    found, _ = changes((0, 100.0, V), (0, 110.0, V), other)
    assert found == (error > 0)


@pytest.mark.parametrize(
    ("s", "is_free"),
    [(91.5, True), (92.5, False), (100.0, False), (107.5, False),
     (108.5, True)],
)  # fmt: skip
def test_nobody_is_beside_it(s, is_free):
    """From 4 m behind to 4 m ahead of a car of 4 m."""
    v = 20.0 if s > 100.0 else 0.5
    found, _ = changes((0, 100.0, V), (0, 104.5, 0.0), (1, s, v))
    assert found == is_free


def test_the_ego_car_is_another_one_than_all_vehicles():
    names = ("until", "ego_rear", "ego_front", "ego_speed")
    streets = STREETS._replace(
        **{name: getattr(STREETS, name).copy() for name in names}
    )
    for name, value in zip(names, (0.0, 140.0, 144.0, 3.0), strict=True):
        getattr(streets, name)[0, 0] = value
    cars = vehicles((0, 100.0, V), (0, 110.0, V), (0, 170.0, V))
    traffic = traffic_of(streets, cars)
    find_occupants(traffic, 0)
    assert find_ahead(traffic, 0, 110.0, 1) == (30.0, 3.0)
    assert find_ahead(traffic, 0, 100.0, 0) == (6.0, V)
    assert find_ahead(traffic, 0, 170.0, 2)[0] == np.inf
    # The first of two at one place is ahead.
    assert find_ahead(traffic, 0, 170.0, 3) == (-4.0, V)


def test_vehicles_begin_apart_from_each_other_and_from_the_lines():
    """9 m apart, 1 m from the lane's ends; they can stop before its end."""
    streets = two_lanes(60.0)
    rng = np.random.default_rng(5)
    places, speeds = [], []
    for _ in range(150):
        kinds = [KINDS[k] for k in rng.integers(len(KINDS), size=6)]
        cars, found = place_vehicles(kinds, streets, rng)
        assert [kinds[k].size[0] for k in found] == cars["length"].tolist()
        for lane in (0, 1):
            own = cars[cars["path"][:, CURRENT] == lane]
            own = own[np.argsort(own["s"])]
            gaps = own["s"][1:] - own["length"][1:] - own["s"][:-1]
            assert (gaps >= 9.0).all()
            places += [own["s"] - own["length"], 60.0 - own["s"]]
            speeds += [own["v"], own["s"], own["top"]]
        left = np.minimum(60.0 - cars["s"], 4.5)
        assert (cars["v"] <= np.sqrt(1.5 * left) + 1e-9).all()
        assert (cars["v"] > 0.0).all()
    behind, before = np.concatenate(places[::2]), np.concatenate(places[1::2])
    for least in (behind.min(), before.min()):
        assert 1.0 <= least < 1.2


def test_equal_draws_for_equal_seeds():
    """SplitMix64's finalizer, in Python's integers."""
    mask = 2**64 - 1
    for seed, who, draw in ((1, 2, 3), (2**31 - 1, 700, 12), (0, 0, 1)):
        z = seed * 0x9E3779B97F4A7C15 + who * 0xD1B54A32D192ED03
        z = (z + draw * 0x8CB92BA72F3D8DD7) & mask
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        z ^= z >> 31
        assert uniform(seed, who, draw) == (z >> 11) / 2.0**53


@pytest.mark.parametrize(
    ("others", "expected"),
    [((), 0.75), ((0,), 0.75**2), ((1,), 1 - 0.25**2)],
)
def test_of_two_drawn_ways_that_to_the_emptier_lane(others, expected):
    """Three of four like the first way, which leads to the first lane."""
    streets = STREETS._replace(liked=np.array([0.75, 1.0] * 2 + [1.0] * 2))
    cars = vehicles((0, 100.0, V), *((lane, 300.0, V) for lane in others))
    cars["path"][:, CURRENT + 1 :] = -1
    if others != (0,):
        cars = np.append(cars, vehicles((1, 200.0, V)))
        cars["path"][-1, CURRENT + 1 :] = -1
    traffic = traffic_of(streets, cars, seed=7)
    number = 600
    first = 0
    for _ in range(number):
        choose_way(traffic, 0)
        way, beyond = cars["path"][0, CURRENT + 1 : CURRENT + 3]
        assert way == beyond + 2
        first += way == 2
        cars["path"][0, CURRENT + 1 :] = -1
    assert cars["draws"][0] == 2 * number
    spread = np.sqrt(number * expected * (1 - expected))
    assert abs(first - number * expected) < 4 * spread
