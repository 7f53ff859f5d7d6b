"""Walkways around objects: the free parts of their widths."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
import shapely.affinity

from cns_drake.traffic import Walkway, kept_clear


def straight(length=20.0, half_width=1.0):
    """Returns a walkway along x."""
    x = np.arange(0.0, length + 0.1, 0.5)
    points = np.column_stack([x, 0 * x, 0 * x])
    return Walkway(points, half_width, 0, 1)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_walkways_pass_things(turn):
    """Offsets are to the right: a thing on the left raises the least."""
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    thing = shapely.affinity.rotate(
        shapely.box(9.8, 0.6, 10.2, 3.0), turn, (0, 0), use_radians=True
    )
    way = replace(straight(), points=straight().points @ R.T)
    (found,) = kept_clear([way], [thing])
    np.testing.assert_array_equal(found.points, way.points)
    low, high = found.limits.T
    assert (high == 1.0).all()
    # 0.53 m beside the thing, rounded up to one of 20 parts.
    assert low[20] == pytest.approx(0.0)
    assert (low[19:22] == low[20]).all()
    # Walkers step aside by two parts from point to point.
    np.testing.assert_allclose(low[22:26], [-0.1, -0.3, -0.5, -0.7])
    np.testing.assert_allclose(low[18:14:-1], [-0.1, -0.3, -0.5, -0.7])
    assert (low[:14] == -1.0).all()
    assert (low[27:] == -1.0).all()
    assert not found.narrow.any()
    assert kept_clear([way], [])[0].limits.tolist() == [[-1.0, 1.0]] * 41


@pytest.mark.parametrize(
    ("edge", "low", "is_narrow"), [(0.59, 0.0, False), (0.49, -0.1, True)]
)
def test_walkers_face_along_where_it_is_narrow(edge, low, is_narrow):
    """Where a box that may face anywhere has less than half of the way."""
    hedge = shapely.box(5.0, edge, 15.0, 3.0)
    (way,) = kept_clear([straight()], [hedge])
    assert way.narrow[20] == is_narrow
    np.testing.assert_allclose(way.limits[20], [low, 1.0], atol=1e-9)
    assert not way.narrow[[0, -1]].any()


def test_walkways_end_where_things_bar_the_way():
    wall = shapely.box(9.9, -2.0, 10.1, 2.0)
    before, after = kept_clear([straight()], [wall])
    assert before.points[-1, 0] < 9.9 - 0.36 < 10.1 + 0.36 < after.points[0, 0]
    assert (before.start, after.end) == (0, 1)
    assert len({0, 1, before.end, after.start}) == 4
    # Nobody crosses to where there is no walkway.
    crossings = [replace(straight(), start=a, crossing=0) for a in (0, 7)]
    for crossing, is_kept in zip(crossings, (True, False), strict=True):
        found = kept_clear([straight(), crossing], [])
        assert (crossing.crossing in [w.crossing for w in found]) == is_kept
    found = kept_clear([straight(), crossings[0]], [wall])
    assert [way.crossing for way in found] == [-1, -1]


def test_walkways_are_free_where_walkers_begin_them():
    """They may stand two metres before the first point."""
    for x, low in ((-1.9, -0.4), (-2.8, -1.0), (21.9, -0.4), (22.8, -1.0)):
        post = shapely.Point(x, 1.15).buffer(0.2)
        (way,) = kept_clear([straight()], [post])
        row = 0 if x < 0.0 else -1
        np.testing.assert_allclose(way.limits[row], [low, 1.0])
    # What bars the whole way there stands behind those who wait.
    wall = shapely.box(-1.1, -2.0, -0.9, 2.0)
    (way,) = kept_clear([straight()], [wall])
    np.testing.assert_allclose(way.limits[0], [-1.0, 1.0])
