"""Polyhedra about curved shapes: around them, and close to them."""

from helpers.points_on_shapes import points_on
import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.ray_casting.curved_proxies import (
    NearCurvedShapes,
    circumscribe,
    num_sides,
)
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
)

SHAPES = [
    EllipsoidSurface((1.5, 1.5, 1.5)),
    CylinderSurface(0.8, 2.5),
    CylinderSurface(0.04, 9.0),
    CapsuleSurface(0.6, 1.8),
]


@pytest.mark.parametrize("surface", SHAPES)
@pytest.mark.parametrize("count", [1, 5000])
def test_polyhedron_contains_the_shape_with_a_gap(surface, count):
    hull = circumscribe(surface, num_sides(count))
    a, b, c = (hull.p_GVset[hull.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    normal, a = normal[area > 1e-9], a[area > 1e-9]
    normal /= area[area > 1e-9][:, None]
    points = points_on(surface, np.random.default_rng(2))
    outside = points @ normal.T - np.einsum("ij,ij->i", a, normal)
    assert outside.max() < -5e-4
    # A ray that starts in the polyhedron of one of many shapes is known.
    members = [(k, RigidTransform(), surface) for k in range(count)]
    group = RayGroup(None, np.eye(4), members)
    group.place(np.zeros(3), lambda frame: None)
    assert NearCurvedShapes([group]).contain(hull.p_GVset).all()


def test_nearness_of_many_shapes_is_that_of_each():
    """Places among shapes of groups at all orientations, some stretched."""
    rng = np.random.default_rng(5)
    groups = []
    for k in range(60):
        X_WF = RigidTransform(
            RollPitchYaw(*rng.uniform(-3.0, 3.0, 3)), rng.uniform(-9.0, 9.0, 3)
        )
        X_FL = np.eye(4)
        surface = SHAPES[k % len(SHAPES)]
        if k % len(SHAPES) == 0:
            X_FL = np.diag([0.5, 1.0, 2.0, 1.0])
        member = (k, RigidTransform([0.1, 0.0, 0.2]), surface)
        group = RayGroup(FrameId.get_new_id(), X_FL, [member])
        group.place(np.array([1.0, 2.0, 3.0]), lambda frame, X=X_WF: X)
        groups.append(group)
    places = rng.uniform(-10.0, 10.0, (3000, 3))
    near = NearCurvedShapes(groups)
    each = [NearCurvedShapes([group]).contain(places) for group in groups]
    expected = np.any(each, axis=0)
    assert 100 < expected.sum() < 2000
    np.testing.assert_array_equal(near.contain(places), expected)
