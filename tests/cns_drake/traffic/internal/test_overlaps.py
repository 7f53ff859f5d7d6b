"""Overlaps of boxes against polygons of Shapely."""

import numpy as np
import shapely

from cns_drake.traffic import find_overlaps
from cns_drake.traffic.overlaps import boxes_overlap
from cns_drake.traffic.traffic_planning import whom_to_leave_out


def _polygon(pose, half):
    c, s = np.cos(pose[2]), np.sin(pose[2])
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)] * half
    return shapely.Polygon(corners @ np.array([[c, s], [-s, c]]) + pose[:2])


def test_agrees_with_shapely():
    """Also for long boxes that meet end to end."""
    rng = np.random.default_rng(3)
    for number in range(500):
        a, b = rng.uniform(-3, 3, 3), rng.uniform(-3, 3, 3)
        half_a, half_b = rng.uniform(0.2, 2.0, (2, 2))
        if number % 2:
            half_a, half_b = (4.0, 0.3), (0.3, 4.0)
            a[2], b = 0.4, a + 7.8 * np.array([np.cos(0.4), np.sin(0.4), 0])
            b = b + rng.normal(0.0, 0.2, 3)
            b[2] = 0.4 - np.pi / 2
        half = np.array([half_a, half_b])
        one, other = _polygon(a, half[0]), _polygon(b, half[1])
        expected = one.intersection(other).area > 1e-9
        assert boxes_overlap(a, b, *half) == expected
        found = np.zeros((2, 2), bool)
        find_overlaps(np.array([[a, b]]), half, found)
        assert found[0, 1] == found[1, 0] == expected


def test_the_most_involved_goes_first():
    """Only the middle one of three in a row has to go, unless it is the first.

    The last body is out of the world.
    """
    poses = np.array([[[0.0, 0, 0], [2.0, 0, 0], [4.0, 0, 0], [np.nan] * 3]])
    found = np.zeros((4, 4), bool)
    find_overlaps(poses, np.full((4, 2), 1.1), found)
    assert found.tolist() == [
        [False, True, False, False],
        [True, False, True, False],
        [False, True, False, False],
        [False] * 4,
    ]
    assert whom_to_leave_out(found) == [1]
    order = [1, 0, 2, 3]
    assert whom_to_leave_out(found[np.ix_(order, order)]) == [1, 2]
