"""Triangulation against areas, and Delaunay's condition against GEOS."""

import itertools

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate, translate
from shapely.geometry import MultiPoint, Point, Polygon, box
from shapely.ops import unary_union

from worlds.shapes import triangulate


def star(seed: int, corners: int) -> Polygon:
    """Returns a ragged polygon around a point off the origin."""
    rng = np.random.default_rng([11, seed])
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    radius = rng.uniform(5, 40, corners)
    xy = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return shapely.set_precision(translate(Polygon(xy), 130, -70), 0.001)


def with_holes() -> Polygon:
    """Returns a plate with a row, a pair and a ring-like block of holes."""
    holes = [Point(x, y).buffer(2.2) for x in (8, 16, 24) for y in (7, 13)]
    holes += [box(30, 4, 33, 17), rotate(box(36, 8, 44, 11), 30)]
    plate = box(0, 0, 50, 20).difference(unary_union(holes))
    return shapely.set_precision(rotate(plate, 13, origin=(0, 0)), 0.001)


SHAPES = {
    "square": box(0, 0, 1, 1),
    "turned": shapely.set_precision(rotate(box(0, 0, 30, 4), 27), 0.001),
    "points on an edge": Polygon(
        [(0, 0), (1, 0), (2, 0), (5, 0), (9, 0), (9, 3), (4, 3), (0, 3)]
    ),
    "fan over an edge": Polygon([(0, 0), (2, 0), (3, 0), (7, 0), (3, 9)]),
    "comb": Polygon(
        [(0, 0), (20, 0), (20, 9), (18, 1), (13, 9), (9, 1), (5, 9), (2, 1)]
    ),
    "holes": with_holes(),
    "hole that touches an edge": Polygon(
        [(0, 0), (10, 0), (10, 10), (0, 10)], [[(0, 5), (4, 3), (4, 7)]]
    ),
    "hole that touches an edge on its right": Polygon(
        [(0, 0), (10, 0), (10, 10), (0, 10)], [[(10, 5), (4, 3), (4, 7)]]
    ),
    "hole that touches a corner": Polygon(
        [(0, 0), (10, 0), (10, 10), (0, 10)], [[(10, 10), (4, 3), (3, 7)]]
    ),
    "holes that touch": Polygon(
        [(0, 0), (20, 0), (20, 9), (0, 9)],
        [[(2, 4), (8, 2), (8, 6)], [(8, 4), (14, 3), (13, 6)]],
    ),
    **{f"star {n}": star(k, n) for k, n in enumerate((5, 17, 60, 200, 2500))},
}


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_triangles_fill_the_polygon_without_overlap(shape):
    assert shape.is_valid
    corners = triangulate(shape)
    areas = signed_areas(corners)
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(shape.area, rel=1e-12)
    united = unary_union([Polygon(triangle) for triangle in corners])
    assert united.symmetric_difference(shape).area < 1e-9 * shape.area


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_it_uses_all_vertices_and_no_others(shape):
    expected = {tuple(p) for p in np.round(shapely.get_coordinates(shape), 3)}
    found = {tuple(p) for p in triangulate(shape).reshape(-1, 2)}
    assert found == expected


@pytest.mark.parametrize("seed", range(6))
def test_points_of_a_hull_give_delaunays_triangles(seed):
    """Without ties the triangulation is unique and must equal that of GEOS."""
    rng = np.random.default_rng([12, seed])
    hull = MultiPoint(rng.uniform(-50, 50, (40, 2)).round(3)).convex_hull
    expected = shapely.get_parts(shapely.delaunay_triangles(hull))
    found = [Polygon(triangle) for triangle in triangulate(hull)]
    assert as_sets(found) == as_sets(expected)


def test_edges_of_holes_stay_edges():
    shape = with_holes()
    edges = {
        frozenset((tuple(t[k]), tuple(t[k - 1])))
        for t in triangulate(shape).round(3)
        for k in range(3)
    }
    for ring in (shape.exterior, *shape.interiors):
        corners = [tuple(p) for p in np.round(ring.coords, 3)]
        for a, b in itertools.pairwise(corners):
            assert frozenset((a, b)) in edges


def test_the_start_of_a_ring_does_not_matter():
    corners = list(with_holes().exterior.coords)[:-1]
    turned = Polygon(
        corners[7:] + corners[:7],
        [ring.coords[::-1] for ring in with_holes().interiors[::-1]],
    )
    np.testing.assert_array_equal(
        triangulate(turned), triangulate(with_holes())
    )


def test_coordinates_are_rounded_to_millimetres():
    shape = translate(box(0, 0, 1, 1), 0.00049, -0.00049)
    assert set(triangulate(shape).ravel()) == {0.0, 1.0}
    assert len(triangulate(box(0, 0, 0.0004, 1))) == 0


def test_a_hole_outside_is_refused():
    hole = [(20, 20), (22, 20), (21, 22)]
    with pytest.raises(ValueError, match="outside"):
        triangulate(Polygon([(0, 0), (9, 0), (9, 9), (0, 9)], [hole]))


def signed_areas(corners: np.ndarray) -> np.ndarray:
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2


def as_sets(triangles) -> set:
    return {
        frozenset(tuple(p) for p in np.round(t.exterior.coords, 3))
        for t in triangles
    }
