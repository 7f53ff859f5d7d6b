"""Walkers of the social force model: closed forms."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from cns_drake.traffic import LaneGraph, Walkway, make_crossing
from cns_drake.traffic.ego_car import STEP
from cns_drake.traffic.social_force import WALKER_LENGTH, WALKER_WIDTH
from cns_drake.traffic.vehicle_records import make_crossings
from cns_drake.traffic.walkers import Crowd

# Where all walkways begin [m].
ORIGIN = np.array([4.0, -2.0])


def straight(angle, half_width=3.0, length=60.0, start=0, end=1, crossing=-1):
    """Returns a walkway that rises by 3 % in a direction."""
    s = np.linspace(0.0, length, int(2 * length) + 1)[:, None]
    points = s * [np.cos(angle), np.sin(angle), 0.03] + [*ORIGIN, 1.0]
    return Walkway(points, half_width, start, end, crossing)


class Street:
    """Some walkers on a walkway, at distances along it and to its right."""

    def __init__(self, angle, *places, half_width=3.0, speed=1.0, narrow=False):
        self.ahead = np.array([np.cos(angle), np.sin(angle)])
        self.right = np.array([self.ahead[1], -self.ahead[0]])
        way = straight(angle, half_width)
        way = replace(way, narrow=np.full(len(way.points), narrow))
        crossings = make_crossings(LaneGraph(()))
        rng = np.random.default_rng(1)
        self.crowd = Crowd(len(places), [way], crossings, rng)
        self.walkers = self.crowd.walkers
        walkers = self.walkers
        assert len(walkers) == len(places)
        for one, (s, aside, sign) in zip(walkers, places, strict=True):
            place = s * self.ahead + aside * self.right
            one["xy"] = place + ORIGIN
            one["velocity"] = sign * speed * self.ahead
            one["yaw"] = angle + np.pi * (sign < 0)
            one["path"] = int(sign < 0)
            one["at"] = int(2 * (s if sign > 0 else 60.0 - s))
        walkers["speed"], walkers["aside"] = speed, 0.0

    def place(self):
        """Returns distances (N,) along the walkway, and to its right."""
        xy = self.walkers["xy"] - ORIGIN
        return xy @ self.ahead, xy @ self.right

    def step(self):
        self.crowd.step(0.0, 1)


ANGLES = pytest.mark.parametrize("angle", [0.7, np.pi / 2, -2.0])


@ANGLES
def test_a_walker_alone_relaxes_to_its_speed(angle):
    """Within 0.5 s: the rest shrinks by a fifth in a step of 0.1 s."""
    street = Street(angle, (10.0, 0.0, 1))
    street.walkers["velocity"] = 0.0
    phase = street.walkers["phase"][0]
    s = 10.0
    for k in range(1, 40):
        before = 1.0 - 0.8 ** (k - 1)
        street.step()
        speed = 1.0 - 0.8**k
        velocity = street.walkers["velocity"][0]
        np.testing.assert_allclose(velocity, speed * street.ahead, atol=1e-9)
        s += 0.5 * (before + speed) * STEP
        along, aside = street.place()
        assert along[0] == pytest.approx(s)
        assert aside[0] == pytest.approx(0.0, abs=1e-9)
        # A stride of 0.7 s of its walk and 0.4 m.
        phase += 2 * np.pi * speed * STEP / (0.7 * speed + 0.4)
        assert street.walkers["phase"][0] == pytest.approx(phase)
        x, y, z, yaw, _ = street.crowd.poses(street.walkers)[0]
        np.testing.assert_allclose([x, y], street.walkers["xy"][0])
        # The height is that of the walkway's last part until the next step.
        assert z == pytest.approx(1.0 + 0.03 * s, abs=0.004)
        assert yaw == pytest.approx(angle)


@ANGLES
@pytest.mark.parametrize("apart", [1.4, 1.7])
def test_walkers_keep_away_from_each_other(angle, apart):
    """By 7 m/s^2 at 0.95 m, e times less each 0.3 m; 0.3 to their right."""
    street = Street(angle, (20.0, -apart / 2, 1), (20.0, apart / 2, 1))
    # Each goes straight on.
    street.walkers["aside"] = -apart / 6, apart / 6
    street.step()
    push = 7.0 * np.exp(-(apart - 0.95) / 0.3) * STEP
    change = street.walkers["velocity"] - street.ahead
    across, along = change @ street.right, change @ street.ahead
    np.testing.assert_allclose(across, [-push, push], rtol=0.05)
    # The left one has the other on its right.
    np.testing.assert_allclose(along, [-0.3 * push, 0.3 * push], rtol=0.3)


def test_walkers_turn_slowly_and_speed_up_within_bounds():
    """At 2.5 rad/s, and 2.5 m/s^2 in any direction."""
    street = Street(0.7, (20.0, 0.0, 1), speed=2.0)
    street.walkers["velocity"] = 0.0
    street.walkers["yaw"] = 0.7 + 2.0
    yaw = 0.7 + 2.0
    for _ in range(4):
        before = street.walkers["velocity"][0].copy()
        street.step()
        change = np.linalg.norm(street.walkers["velocity"][0] - before)
        assert change == pytest.approx(2.5 * STEP)
        yaw -= 2.5 * STEP
        assert street.walkers["yaw"][0] == pytest.approx(yaw)
    for _ in range(20):
        street.step()
    assert street.walkers["yaw"][0] == pytest.approx(0.7)


@ANGLES
@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("turn", [1.4, -1.4, 1.8, -1.8])
def test_walkers_face_along_narrow_ways(angle, way, turn):
    """Either way, whichever is nearer; elsewhere, as they go."""
    for narrow in (False, True):
        street = Street(angle, (10.0, 0.0, way), narrow=narrow)
        street.walkers["yaw"] += turn
        for _ in range(30):
            street.step()
        is_back = narrow and abs(turn) > np.pi / 2
        facing = angle + np.pi * ((way < 0) != is_back)
        yaw = street.walkers["yaw"][0]
        assert np.cos(yaw - facing) == pytest.approx(1.0)


@ANGLES
@pytest.mark.parametrize(("speed", "steps"), [(-0.6, 40), (0.6, None)])
def test_walkers_who_are_pushed_back_turn_back_after_4_s(angle, speed, steps):
    street = Street(angle, (30.0, 0.0, 1))
    turned = None
    for k in range(60):
        street.walkers["velocity"] = speed * street.ahead
        street.step()
        if turned is None and street.walkers["path"][0] == 1:
            turned = k + 1
    assert turned == steps


def overlap(street):
    """Returns the area that two walkers share [m^2]."""
    half = np.array([WALKER_LENGTH, WALKER_WIDTH]) / 2
    boxes = []
    for x, y, _, yaw, _ in street.crowd.poses(street.walkers):
        c, s = np.cos(yaw), np.sin(yaw)
        corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)] * half
        boxes.append(
            shapely.Polygon(corners @ np.array([[c, s], [-s, c]]) + [x, y])
        )
    return boxes[0].intersection(boxes[1]).area


@ANGLES
@pytest.mark.parametrize("half_width", [0.8, 3.0])
def test_walkers_who_meet_pass_each_other_on_the_right(angle, half_width):
    street = Street(
        angle, (20.0, 0.0, 1), (30.0, 0.0, -1), half_width=half_width
    )
    for _ in range(120):
        street.step()
        assert overlap(street) == 0.0
        along, aside = street.place()
        assert (np.abs(aside) < half_width + 0.1).all()
        if abs(along[0] - along[1]) < 0.5:
            # The first is to the right of the line, the other to its own.
            assert aside[0] > aside[1] + 0.6
    assert along[0] > 28.0
    assert along[1] < 22.0


@ANGLES
def test_walkers_aim_to_the_right(angle):
    """At part of their half width, of 3 m, until the end of the walkway."""
    street = Street(angle, (5.0, 0.0, 1))
    street.walkers["aside"] = 0.5
    for _ in range(300):
        street.step()
    assert street.place()[1][0] == pytest.approx(1.5, abs=0.05)


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, 2.4])
def test_a_walker_goes_round_a_corner_without_a_stop(angle):
    """A bend of 3 m to the left, after 8 m of a walkway 1 m wide."""
    turn = np.linspace(0.0, np.pi / 2, 10)[:, None]
    s = np.arange(0.0, 8.1, 0.5)[:, None]
    ahead = np.array([np.cos(angle), np.sin(angle)])
    left = np.array([-ahead[1], ahead[0]])
    bend = 3.0 * (np.sin(turn) * ahead + (1 - np.cos(turn)) * left)
    xy = np.concatenate(
        [s * ahead, (8.0 * ahead + bend)[1:-1], 11.0 * ahead + (3.0 + s) * left]
    )
    way = Walkway(np.column_stack([xy, 0 * xy[:, 0]]), 0.5, 0, 1)
    crossings = make_crossings(LaneGraph(()))
    crowd = Crowd(1, [way], crossings, np.random.default_rng(1))
    walkers = crowd.walkers
    walkers["path"], walkers["at"], walkers["xy"] = 0, 4, 2.0 * ahead
    walkers["velocity"], walkers["speed"], walkers["aside"] = ahead, 1.0, 0.0
    walkers["yaw"] = angle
    line = shapely.LineString(xy)
    for _ in range(150):
        crowd.step(0.0, 1)
        place = shapely.Point(walkers["xy"][0])
        assert line.distance(place) < 0.5
        assert np.linalg.norm(walkers["velocity"][0]) > 0.5
    assert 15.5 < line.project(place) < 17.5


def test_few_walkers_cross_and_none_goes_back():
    """One in five, where others go straight on."""
    ways = [
        straight(0.0),
        straight(0.0, start=1, end=2),
        straight(0.0, 0.8, 9.0, start=1, end=3, crossing=0),
    ]
    line = ways[2].points[[0, -1]]
    graph = LaneGraph((), (make_crossing(line, 1.6),))
    crossings = make_crossings(graph)
    crowd = Crowd(1, ways[:2], crossings, np.random.default_rng(2))
    crowd = Crowd(1, ways, crossings, np.random.default_rng(2))
    walkers = crowd.walkers
    number = 500
    crosses = 0
    for seed in range(number):
        walkers["path"], walkers["at"], walkers["next_path"] = 0, 118, -1
        walkers["xy"], walkers["velocity"] = (4.0 + 59.9, -2.0), 0.0
        crowd.step(3.0, seed)
        path, after = walkers["path"][0], walkers["next_path"][0]
        if after == 4:
            # It waits for the crossing.
            assert path == 0
            assert crossings["waits"][0] == 3.0
            crosses += 1
        else:
            assert (path, after) == (2, -1)
            assert np.isinf(crossings["waits"][0])
    assert abs(crosses - 0.2 * number) < 4 * np.sqrt(0.16 * number)


def test_walkers_use_a_crossing_that_is_open():
    """Vehicles may pass behind those who walk away from them."""
    over = straight(0.5, 0.8, 12.0, start=1, end=2, crossing=0)
    graph = LaneGraph((), (make_crossing(over.points[[0, -1]], 1.6),))
    crossings = make_crossings(graph)
    ways = [straight(0.5), over]
    crowd = Crowd(3, ways, crossings, np.random.default_rng(2))
    walkers = crowd.walkers
    ahead = np.array([np.cos(0.5), np.sin(0.5)])
    crossings["users"] = 3
    crossings["is_open"] = True
    for one, (s, path) in zip(
        walkers, ((4.0, 2), (6.0, 2), (9.0, 3)), strict=True
    ):
        one["xy"], one["path"] = s * ahead + ORIGIN, path
        one["at"] = int(2 * (s if path == 2 else 12.0 - s))
        one["velocity"] = (1.0 if path == 2 else -1.0) * ahead
        one["yaw"] = 0.5 + np.pi * (path == 3)
    walkers["xy"][2] += 0.7 * np.array([-ahead[1], ahead[0]])
    walkers["speed"], walkers["aside"] = 1.0, 0.0
    crowd.step(50.0, 1)
    place = (walkers["xy"] - ORIGIN) @ ahead
    one = crossings[0]
    assert one["to_end"] == pytest.approx(place[0])
    assert one["to_start"] == pytest.approx(place[2])
    # Others may follow while it is being opened.
    one["opened"] = 49.9
    crowd.step(50.0, 1)
    assert (one["to_end"], one["to_start"]) == (-np.inf, np.inf)


def test_first_places_and_groups():
    """A third of walkers is in groups, of two who are 1.5 m apart."""
    ways = [straight(a, 1.0, 400.0) for a in (0.3, 1.2, 2.1, -0.7, -1.6)]
    crossings = make_crossings(LaneGraph(()))
    rng = np.random.default_rng(4)
    walkers = Crowd(300, ways, crossings, rng).walkers
    assert len(walkers) == 300
    apart = np.linalg.norm(walkers["xy"][:, None] - walkers["xy"], axis=2)
    np.fill_diagonal(apart, np.inf)
    assert 1.33 < apart.min() < 1.5
    group = walkers["group"]
    number = np.bincount(group, minlength=300)[group]
    assert 0.24 < (number == 2).mean() < 0.42
    assert number.max() == 2
    companions = np.flatnonzero(group != np.arange(300))
    for name in ("speed", "aside", "path"):
        leaders = walkers[name][group[companions]]
        np.testing.assert_array_equal(walkers[name][companions], leaders)
    np.testing.assert_allclose(
        apart[companions, group[companions]], 1.5, atol=0.01
    )
    assert (
        walkers["at"][companions] == walkers["at"][companions - 1] - 3
    ).all()
    # Preferred speeds as measured, of about 1.34 m/s with 0.26 m/s.
    assert np.mean(walkers["speed"]) == pytest.approx(1.34, abs=0.06)
    assert np.std(walkers["speed"]) == pytest.approx(0.26, abs=0.04)
