"""Polygons on the ground: their tiles and their order."""

import pytest
from shapely.geometry import Point, box
from shapely.ops import unary_union

from cns_drake.city import polygons_of, snap
from cns_drake.city.geometry.polygons import tiles


def test_tiles_share_out_the_whole_area():
    hole = box(36, -33, 44, -28)
    area = snap(Point(40, -30).buffer(20).difference(hole))
    pieces = list(tiles(area, 16.0))
    assert len(pieces) > 4
    assert sum(p.area for p in pieces) == pytest.approx(area.area, abs=0.05)
    for k, piece in enumerate(pieces):
        for other in pieces[:k]:
            assert piece.intersection(other).area < 1e-9
        x0, y0, x1, y1 = piece.bounds
        assert x1 - x0 <= 16.0 + 1e-9
        assert y1 - y0 <= 16.0 + 1e-9


def test_polygons_come_in_an_order_of_their_own():
    parts = [box(5, 0, 6, 1), box(0, 0, 1, 1), box(0, 5, 1, 6)]
    there = polygons_of(unary_union(parts))
    back = polygons_of(unary_union(parts[::-1]))
    assert [p.bounds for p in there] == [p.bounds for p in back]
    assert len(there) == 3
