"""Polygons on the ground: their tiles and their order."""

from shapely.geometry import box
from shapely.ops import unary_union

from worlds.shapes import polygons_of


def test_polygons_come_in_an_order_of_their_own():
    parts = [box(5, 0, 6, 1), box(0, 0, 1, 1), box(0, 5, 1, 6)]
    there = polygons_of(unary_union(parts))
    back = polygons_of(unary_union(parts[::-1]))
    assert [p.bounds for p in there] == [p.bounds for p in back]
    assert len(there) == 3
