"""Areas on the ground: ways, obstacles, sides of buildings, rectangles."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapely.geometry import box

from worlds.shapes import (
    Obstacles,
    Way,
    close_pairs,
    facing_side,
    overlap,
    placed,
    roll_pitch_yaw,
)

BEND = Way(np.array([(0.0, 0.0, 1.0), (6.0, 0.0, 4.0), (6.0, 8.0, 4.0)]))


def test_a_way_is_measured_from_above():
    assert BEND.length == 14.0
    assert BEND.at(2.0) == pytest.approx([2.0, 0.0, 2.0])
    assert Way(np.eye(2)).at(0.0) == pytest.approx([1.0, 0.0])
    places = np.array([(3.0, -2.0), (9.0, 4.0), (-3.0, 4.0)])
    assert BEND.distances(places) == pytest.approx([2.0, 3.0, 5.0])
    assert BEND.covers(places, 2.5).tolist() == [True, False, False]
    assert BEND.distance(box(8.0, 10.0, 9.0, 11.0)) == pytest.approx(8**0.5)


def test_boxes_near_a_way():
    low = np.array([(8.0, 1.0, 5.0), (9.5, 1.0, 5.0), (1.0, -1.0, 0.0)])
    boxes = np.stack([low, low + 1.0], axis=1)
    assert BEND.is_near(boxes, 2.0).tolist() == [True, False, True]
    assert BEND.is_near(boxes[..., :2], 3.5).all()


def test_the_area_beside_a_way_ends_in_half_circles():
    area = Way(np.array([(0.0, 0.0), (10.0, 0.0)])).area(1.0)
    assert area.area == pytest.approx(20.0 + math.pi, rel=0.01)


def test_obstacles_can_be_added():
    standing = Obstacles([("a", box(0, 0, 1, 1)), ("none", box(0, 0, 0, 0))])
    near = box(1.5, 0.0, 2.5, 1.0)
    assert standing.is_free(near)
    standing.add("b", box(2.0, 0.0, 3.0, 1.0))
    standing.add("c", box(7.0, 0.0, 8.0, 1.0))
    assert not standing.is_free(near)
    assert standing.is_free(near, ("b",))
    assert standing.touched_by(box(0.5, 0.0, 2.5, 1.0)) == {"a", "b"}
    around = box(-9.0, -9.0, 9.0, 9.0)
    assert standing.distance(box(4, 0, 5, 1), around, ()) == 1.0
    assert standing.distance(box(4, 0, 5, 1), around, ("b",)) == 2.0


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.9])
def test_the_side_that_faces_a_way(yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    R = np.array([[c, -s], [s, c]])
    way = Way(np.array([(-20.0, -9.0), (20.0, -9.0)]) @ R.T)
    house = placed(box(-5.0, -2.0, 5.0, 2.0), (0.0, 0.0), yaw)
    side, length = facing_side(house, way)
    assert length == pytest.approx(10.0)
    assert side.middle == pytest.approx(R @ [0.0, -2.0])
    # y points away from the house, towards the way.
    assert side.place(1.0, 2.0) == pytest.approx(R @ [-1.0, -4.0])
    strip = side.rectangle(1.0, 4.0, 0.5, 2.0)
    assert strip.area == pytest.approx(6.0)
    assert way.distance(strip) == pytest.approx(5.0)


def squares(*corners):
    """Returns the corners (N, 4, 2) of unit squares by their lower left."""
    unit = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    return np.array(corners, float).reshape(-1, 1, 2) + unit


def test_rectangles_that_meet():
    first = squares((0, 0), (5, 5))
    second = squares((0.5, 0.5), (5, 7))
    assert overlap(first, second).tolist() == [True, False]
    pairs = [np.stack(close_pairs(first, second, d)).T for d in (0.5, 1.0)]
    assert pairs[0].tolist() == [[0, 0]]
    assert sorted(pairs[1].tolist()) == [[0, 0], [1, 1]]
    assert len(close_pairs(first, squares(), 9.0)[0]) == 0


@pytest.mark.parametrize("pitch", [None, math.pi / 2, -math.pi / 2, 1.57079])
def test_angles_of_a_rotation_give_the_rotation(pitch):
    rng = np.random.default_rng(4)
    for angles in rng.uniform(-4.0, 4.0, (50, 3)):
        if pitch is not None:
            angles[1] = pitch
        R = Rotation.from_euler("xyz", angles).as_matrix()
        found = roll_pitch_yaw(R)
        assert np.abs(found).max() <= math.pi
        assert abs(found[1]) <= math.pi / 2
        again = Rotation.from_euler("xyz", found).as_matrix()
        assert again == pytest.approx(R, abs=1e-9)
