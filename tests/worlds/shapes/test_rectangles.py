"""Rectangles within polygons."""

import pytest
from shapely.geometry import box

from worlds.shapes import largest_rectangle


def test_the_rectangle_lies_within_the_lot():
    corner = box(0, 0, 20, 10).union(box(0, 0, 8, 25))
    inner = largest_rectangle(corner)
    assert corner.covers(inner)
    assert inner.area == pytest.approx(200.0)
    round_lot = box(0, 0, 30, 20).buffer(-6).buffer(6)
    assert round_lot.buffer(0.02).covers(largest_rectangle(round_lot))
    assert largest_rectangle(box(1, 2, 5, 9)).equals(box(1, 2, 5, 9))
