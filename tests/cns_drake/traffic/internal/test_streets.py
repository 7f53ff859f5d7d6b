"""Allowed speeds, swept areas, and the ego car's way over lanes."""

import numpy as np
import pytest
import shapely

from cns_drake.traffic import EgoBox, LaneGraph, Piece, make_crossing
from cns_drake.traffic.conflicts import find_conflicts, swept_hulls
from cns_drake.traffic.ego_car import STEP
from cns_drake.traffic.streets import (
    is_ego_far,
    make_streets,
    places_on,
    speed_on,
)
from cns_drake.traffic.vehicle_kinds import LARGEST, SMALL_SIZE

BOX = EgoBox(-1.0, 3.0, 1.1)
ANGLE = 0.4
AHEAD = np.array([np.cos(ANGLE), np.sin(ANGLE)])
LEFT = np.array([-AHEAD[1], AHEAD[0]])


def place(s, aside=0.0):
    """Returns places (N, 2) at distances along a line, and beside it [m]."""
    return np.add.outer(s, [0.0, 0.0]) * AHEAD + aside * LEFT + (5.0, -7.0)


def straight(first, last, way, *after):
    s = np.linspace(first, last, int(2 * (last - first)) + 1)
    points = np.column_stack([place(s), 0.02 * s])
    return Piece(points, 10.0, way, after, junction=0)


# A lane, a way, and a lane on one line; a crossing leads over the way, from
# 5 m left of it to 3 m right of it, and is 2.4 m wide.
ENDS = np.column_stack([place([110.0] * 2), [0, 0]])
ENDS[:, :2] += np.outer([5.0, -3.0], LEFT)
GRAPH = LaneGraph(
    (
        straight(0, 100, False, 1),
        straight(100, 120, True, 2),
        straight(120, 220, False, 1),
    ),
    (make_crossing(ENDS, 2.4),),
)
# With its slope of 2 % [m].
LENGTH = 100.0 * np.hypot(1.0, 0.02)


def drive(sign=1, aside=0.0):
    """Returns the streets while the ego car drives at 8 m/s, and its places.

    They are those of its frame, from 20 m before the lanes to 10 m before
    their end.
    """
    s = -20.0 + 8.0 * STEP * np.arange(288)
    yaw = np.full(len(s), ANGLE + np.pi * (sign < 0))
    s = s[::sign]
    return make_streets(GRAPH, BOX, place(s, aside), yaw), s


def test_the_outline_of_the_ego_car():
    xy, yaw = np.array([[3.0, -2.0], [1.0, 4.0]]), np.array([0.7, -2.0])
    corners = BOX.corners(xy, yaw)
    outline = shapely.box(-1.0, -1.1, 3.0, 1.1)
    for here, angle, own, middle in zip(
        xy, yaw, corners, BOX.middles(xy, yaw), strict=True
    ):
        turned = shapely.affinity.rotate(
            outline, angle, (0, 0), use_radians=True
        )
        moved = shapely.affinity.translate(turned, *here)
        assert shapely.Polygon(own).symmetric_difference(moved).area < 1e-12
        centre = shapely.get_coordinates(moved.centroid)[0]
        np.testing.assert_allclose(middle, [*centre, angle])
    assert BOX.half_size == (2.0, 1.1)


@pytest.mark.parametrize("sign", [1, -1])
def test_when_the_ego_car_is_on_a_lane(sign):
    """Its speed is that of the drive in the first and last frame as well."""
    streets, s = drive(sign)
    front, rear = s + sign * 3.0, s - sign * 1.0
    low, high = np.sort([front, rear], axis=0)
    # The crossing comes last.
    for column, (begin, end) in enumerate(
        ((0, 100), (100, 120), (120, 220), (108.8, 111.2))
    ):
        until = streets.until[:, column]
        here = (high >= begin) & (low <= end)
        np.testing.assert_array_equal(until == 0.0, here)
        first, last = np.flatnonzero(here)[[0, -1]]
        expected = STEP * (first - np.arange(first))
        np.testing.assert_allclose(until[:first], expected, rtol=1e-5)
        assert np.isinf(until[last + 1 :]).all()
        if column < 3:
            for found, expected in (
                (streets.ego_rear, low), (streets.ego_front, high)
            ):  # fmt: skip
                along = np.clip(expected - begin, 0.0, end - begin)
                np.testing.assert_allclose(
                    found[here, column], along[here], atol=1e-4
                )
            inside = here & (high > begin) & (low < end)
            speed = streets.ego_speed[inside, column]
            np.testing.assert_allclose(speed, sign * 8.0, rtol=1e-4)


def test_a_car_beside_a_lane_is_on_it_within_its_strip():
    """Half the strip is 1.45 m wide, half the car 1.1 m."""
    for aside, is_there in ((2.54, True), (2.56, False), (-2.54, True)):
        until = drive(aside=aside)[0].until
        assert (until[:, 0] == 0.0).any() == is_there


def test_vehicles_leave_a_lane_before_the_ego_car_is_there():
    """At 0.6 of the limit of 10 m/s, and with a wait at the lane's end."""
    streets, s = drive()
    # Lane 2 begins at 120 m.
    until = np.flatnonzero(s + 3.0 >= 120.0)[0] * STEP
    for wait in (5.0, 10.0):
        s_free = LENGTH - 6.0 * (until - wait)
        for beyond in (-0.01, 0.01):
            is_far = is_ego_far(streets, 0, 2, s_free + beyond, wait)
            assert is_far == (beyond > 0)
    # It is on the first lane: vehicles may follow 2 m behind it.
    k = 100
    rear = s[100] - 1.0
    assert is_ego_far(streets, k, 0, rear - 2.01, 5.0)
    assert not is_ego_far(streets, k, 0, rear - 1.99, 5.0)
    oncoming, _ = drive(-1)
    assert not is_ego_far(oncoming, 200, 0, 1.0, 5.0)


def test_where_a_way_leads_over_a_crossing():
    over = drive()[0].over
    assert over.shape == (3, 1)
    assert over[1, 0] == pytest.approx(5.0)
    assert np.isnan(over[[0, 2], 0]).all()


def test_pieces_go_straight_on_beyond_their_ends():
    streets, _ = drive()
    s = np.array([-3.0, 0.0, 12.3, 20.0, 26.0])
    x, y, z = places_on(streets, np.full(5, 1), s)
    along = 100.0 + 100.0 / LENGTH * s
    expected = np.column_stack([place(along), 0.02 * along])
    np.testing.assert_allclose(np.transpose([x, y, z]), expected, atol=1e-9)


@pytest.mark.parametrize(
    ("radius", "speed"), [(15.0, np.sqrt(2.2 * 15.0)), (2.0, 2.5)]
)
def test_vehicles_brake_before_a_bend(radius, speed):
    """A lane of 60 m, then half a circle, with 2.2 m/s^2 in the bend."""
    angle = np.linspace(0.0, np.pi, int(2 * radius * np.pi) + 1)[1:]
    arc = [60.0 + radius * np.sin(angle), radius * (1 - np.cos(angle))]
    x = np.arange(0.0, 60.1, 0.5)
    xy = np.concatenate([np.transpose([x, 0 * x]), np.transpose(arc)])
    xy = xy @ np.array([AHEAD, LEFT])
    lane = Piece(np.column_stack([xy, 0 * xy[:, 0]]), 14.0, False, (0,))
    far = np.tile((1e4, 0.0), (2, 1))
    streets = make_streets(LaneGraph((lane,)), BOX, far, np.zeros(2))
    middle = 60.0 + 0.5 * np.pi * radius
    assert speed_on(streets, 0, middle) == pytest.approx(speed, rel=0.01)
    # Before it, 1.5 m/s^2; all of a chord of 2 m is then in the bend.
    for s in (30.0, 45.0, 55.0):
        low, high = np.sqrt(speed**2 + 3.0 * (60.0 - s + np.array([0.0, 3.0])))
        assert low < speed_on(streets, 0, s) < min(high, 14.0 + 1e-9)
    assert speed_on(streets, 0, 0.0) == speed_on(streets, 0, -5.0)
    at_end = speed_on(streets, 0, lane.length)
    assert at_end == speed_on(streets, 0, lane.length + 9.0)


def test_what_a_bus_sweeps_on_a_straight_way():
    """Its rectangle from its first to its last place, with 0.25 m beside it."""
    size = LARGEST.size[:2]
    front, hulls = swept_hulls(GRAPH.pieces[1], size, LARGEST.axles)
    assert front[0] == 0.0
    assert front[-1] == pytest.approx(20.0 + size[0])
    assert len(hulls) == len(front) - 1
    assert 0.9 < np.diff(front).max() <= 1.0
    ends = place(np.array([100.0 - size[0], 120.0 + size[0]]))
    strip = shapely.LineString(ends).buffer(
        size[1] / 2 + 0.25, cap_style="flat"
    )
    area = shapely.union_all(hulls)
    assert area.symmetric_difference(strip).area < 1e-6
    # The first takes the bus from before the way.
    assert shapely.Point(*place([99.9])[0]).intersects(hulls[0])
    assert not shapely.Point(*place([102.0])[0]).intersects(hulls[0])


def bend(radius):
    """Returns a way round three quarters of a circle about the origin."""
    angle = np.linspace(0.0, 1.5 * np.pi, 400)
    points = radius * np.transpose([np.cos(angle), np.sin(angle), 0 * angle])
    return Piece(points, 9.0, True)


def swept_radii(radius, size, axles):
    """Both axles are on a circle, and the body's axis is on a chord."""
    height = radius * np.cos((axles[1] - axles[0]) / 2 / radius)
    half = size[1] / 2 + 0.25
    middle = sum(axles) / 2
    reach = max(size[0] / 2 - middle, size[0] / 2 + middle)
    return height - half, np.hypot(height + half, reach)


def test_what_a_bus_sweeps_in_a_bend():
    size = LARGEST.size[:2]
    axles = (-2.0, 3.6)
    _, hulls = swept_hulls(bend(20.0), size, axles)
    swept = shapely.union_all(hulls)
    inner, outer = swept_radii(20.0, size, axles)
    for heading in (1.5, 2.5, 3.1):
        ray = shapely.LineString(
            np.outer([0.0, 60.0], [np.cos(heading), np.sin(heading)])
        )
        (first, last) = shapely.get_coordinates(ray.intersection(swept))
        # Half a bus turns between one outline and the next, 1 m on.
        assert -0.2 < np.linalg.norm(first) - inner < 1e-3
        assert -0.1 < np.linalg.norm(last) - outer < 1e-2


@pytest.mark.parametrize("size", [0, 1])
def test_which_crossings_vehicles_meet_beside_a_bend(size):
    kinds = (SMALL_SIZE, (-1.6, 1.75)), (LARGEST.size, LARGEST.axles)
    _, outer = swept_radii(20.0, *kinds[size])
    crossings = []
    for gap in (-0.1, 0.1):
        # A metre long, 0.6 m wide.
        x = outer + gap + 0.3
        ends = np.array([[-x, 0.5, 0.0], [-x, -0.5, 0.0]])
        crossings.append(make_crossing(ends, 0.6))
    begin, clear, _ = find_conflicts(LaneGraph((bend(20.0),), tuple(crossings)))
    assert np.isfinite(begin[size, 0, 1:]).tolist() == [True, False]
    assert (clear[size, 0, 1:] > 0.0).tolist() == [True, False]
