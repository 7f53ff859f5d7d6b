import math

import numpy as np
import pytest
from shapely.geometry import Point, Polygon, box

from cns_drake.city.facades import (
    outlines,
)

_C = math.cos(0.7)
_S = math.sin(0.7)
# A rectangle of 14 m by 9 m, turned by 0.7 rad.
TURNED = outlines.rectangle(1, 2, 15, 11) @ np.array([[_C, _S], [-_S, _C]])
COURT = outlines.u_shape(0, 0, 30, 20, 7, 8)


def area(points) -> float:
    return Polygon(points).area


@pytest.mark.parametrize("distance", [0.8, -0.8])
@pytest.mark.parametrize("points", [TURNED, COURT], ids=["turned", "court"])
def test_inset_is_a_mitred_buffer(points, distance):
    moved = Polygon(outlines.inset(points, distance))
    oracle = Polygon(points).buffer(-distance, join_style="mitre")
    assert moved.symmetric_difference(oracle).area < 1e-9


def test_inset_moves_each_edge_by_its_own_distance():
    moved = outlines.inset(outlines.rectangle(0, 0, 10, 6), (1, 2, 3, 4))
    np.testing.assert_allclose(moved, outlines.rectangle(4, 1, 8, 3))


def test_inset_limit_leaves_every_edge_a_length():
    ring = outlines.rounded(outlines.rectangle(0, 0, 30, 20), {0: 5.0}, 2.0)
    limit = outlines.inset_limit(ring)
    assert Polygon(outlines.inset(ring, limit)).is_valid
    # The chords of the arc vanish near its centre, at 0.7 of the radius: the
    # outer half chords belong to no corner.
    assert 0.6 * 5.0 < limit < 0.8 * 5.0


@pytest.mark.parametrize("corner", range(4))
def test_rounded_corner_follows_its_circle_and_keeps_the_front(corner):
    points = outlines.rectangle(0, 0, 20, 12)
    ring = outlines.rounded(points, {corner: 4.0}, 1.0)
    rectangle = box(0, 0, 20, 12)
    center = np.clip(points[corner], (4, 4), (16, 8))
    lost = rectangle.area - area(ring)
    assert lost == pytest.approx((1 - math.pi / 4) * 16, rel=0.06)
    on_arc = np.abs(np.linalg.norm(ring - center, axis=1) - 4.0) < 1e-9
    assert on_arc.sum() >= 7
    chords = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    assert chords[on_arc[:-1] & on_arc[1:]].max() <= 1.0
    # The first edge still lies at y = 0.
    assert np.all(ring[:2, 1] == pytest.approx(0.0))
    assert ring[1, 0] > ring[0, 0]


def test_stadium_has_half_circles_left_and_right():
    ring = outlines.stadium(0, 0, 40, 12, 1.0)
    assert area(ring) == pytest.approx(28 * 12 + math.pi * 36, rel=0.01)
    np.testing.assert_allclose(ring[:2], [(6, 0), (34, 0)], atol=1e-9)
    assert Polygon(ring).exterior.is_ccw


def test_chamfers_and_notches_take_their_corners_out():
    square = outlines.rectangle(0, 0, 10, 10)
    assert area(outlines.chamfered(square, 2.0)) == pytest.approx(100 - 8)
    notched = outlines.notched(square, 2.0)
    assert area(notched) == pytest.approx(100 - 16)
    np.testing.assert_allclose(notched[:2], [(2, 0), (8, 0)])
    # Reflex corners stay.
    assert len(outlines.chamfered(COURT, 1.0)) == 8 + 6


def test_mirrored_outline_keeps_front_and_turning():
    shape = outlines.l_shape(0, 0, 20, 15, 6, 8)
    mirrored = outlines.mirrored(shape)
    assert area(mirrored) == pytest.approx(area(shape))
    assert Polygon(mirrored).exterior.is_ccw
    np.testing.assert_allclose(mirrored[:2], [(0, 0), (20, 0)])
    assert Polygon(mirrored).contains(Point(17, 14))
