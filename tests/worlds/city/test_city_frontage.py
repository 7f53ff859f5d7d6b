"""Lines along streets and lots on them, on a cross of two streets."""

import math

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate
from shapely.geometry import LineString, Point, box
from shapely.ops import unary_union

from worlds.city import lines_along, lot_at, station_at

YAW = math.radians(23.0)


def cross():
    """Returns two 10 m wide streets that cross, turned by YAW."""
    streets = unary_union([box(-100, -5, 100, 5), box(-5, -100, 5, 100)])
    return rotate(streets, math.degrees(YAW), origin=(0, 0))


def test_lines_run_beside_the_streets_and_split_at_corners():
    lines = lines_along(cross(), Point(0, 0).buffer(80), 3.0)
    # Two arms of 72 m or so around each of the four corners.
    assert len(lines) == 8
    for line in lines:
        for s in np.linspace(0, line.length, 7):
            distance = cross().distance(line.interpolate(s))
            assert distance == pytest.approx(3.0, abs=0.02)


def test_the_street_is_on_the_right():
    for line in lines_along(cross(), Point(0, 0).buffer(80), 3.0):
        at = station_at(line, 0.5 * line.length)
        right = Point(at.x + math.sin(at.yaw), at.y - math.cos(at.yaw))
        assert cross().distance(right) == pytest.approx(2.0, abs=0.02)


def test_a_lot_fronts_the_street():
    line = lines_along(cross(), Point(0, 0).buffer(80), 3.0)[0]
    lot = lot_at(line, 10.0, 14.0, 9.0)
    assert lot.width == pytest.approx(14.0)
    area = lot.footprint_W
    assert area.area == pytest.approx(14.0 * 9.0)
    assert cross().distance(area) == pytest.approx(3.0, abs=0.02)
    # The front, y = -depth / 2 in S, is the side at the street.
    c, s = math.cos(lot.yaw), math.sin(lot.yaw)
    front = Point(lot.x + s * 4.5, lot.y - c * 4.5)
    back = Point(lot.x - s * 4.5, lot.y + c * 4.5)
    assert cross().distance(front) == pytest.approx(3.0, abs=0.02)
    assert cross().distance(back) == pytest.approx(12.0, abs=0.02)


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_a_lot_on_a_bend_keeps_its_setback(side):
    # A street around a disc (lots outside), or outside one (lots inside).
    disc = Point(0, 0).buffer(60, quad_segs=64)
    street = disc if side == "outside" else Point(0, 0).buffer(200) - disc
    line = lines_along(street, Point(0, 0).buffer(90), 4.0)[0]
    lot = lot_at(line, 20.0, 20.0, 10.0)
    assert street.distance(lot.footprint_W) > 3.85
    assert lot.width < 20.0
    tight = Point(0, 0).buffer(12)
    line = lines_along(tight, Point(0, 0).buffer(60), 4.0)[0]
    assert lot_at(line, 0.0, 20.0, 10.0) is None


def test_a_lot_must_end_on_its_line():
    line = LineString([(0, 0), (30, 0)])
    assert lot_at(line, 10.0, 20.0, 8.0) is not None
    assert lot_at(line, 10.1, 20.0, 8.0) is None


def test_no_line_outside_the_area():
    assert lines_along(cross(), box(500, 500, 510, 510), 3.0) == []
    assert shapely.get_parts(cross()).size == 1
