"""Occupied ground stays free of other structures."""

import numpy as np
from shapely.geometry import box

from worlds.shapes import Occupancy


def test_polygons_may_touch_but_not_overlap():
    ground = Occupancy()
    ground.add(box(0, 0, 10, 10))
    assert ground.is_free(box(10, 0, 20, 10))
    assert not ground.is_free(box(9.99, 0, 20, 10))
    assert not ground.is_free(box(2, 2, 3, 3))
    assert not ground.is_free(box(-5, -5, 15, 15))


def test_clearance_is_a_distance():
    ground = Occupancy()
    ground.add(box(0, 0, 10, 10))
    assert ground.is_free(box(12.01, 0, 20, 10), 2.0)
    assert not ground.is_free(box(11.99, 0, 20, 10), 2.0)
    # At the corner the bounds are closer than the polygons.
    assert ground.is_free(box(11.5, 11.5, 12, 12), 2.0)
    assert not ground.is_free(box(11.4, 11.4, 12, 12), 2.0)


def test_an_ignored_polygon_may_be_near_but_not_overlap():
    ground = Occupancy()
    neighbour = box(0, 0, 10, 10)
    ground.add(neighbour)
    assert ground.is_free(box(10, 0, 20, 10), 3.0, neighbour)
    assert not ground.is_free(box(9, 0, 20, 10), 3.0, neighbour)


def test_it_agrees_with_brute_force():
    rng = np.random.default_rng(4)
    corners = rng.uniform(0, 100, (300, 2))
    boxes = [box(x, y, x + 4, y + 3) for x, y in corners]
    ground = Occupancy()
    taken = []
    for candidate in boxes:
        free = all(candidate.distance(other) >= 1.0 for other in taken)
        assert ground.is_free(candidate, 1.0) == free
        if free:
            ground.add(candidate)
            taken.append(candidate)
    assert 100 < len(taken) < 300
