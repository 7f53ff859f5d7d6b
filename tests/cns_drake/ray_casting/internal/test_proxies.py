"""Proxies: around their shapes, with a margin, and close to them."""

from helpers.points_on_shapes import points_on
import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.ray_casting.embree_scene import EmbreeScene
from cns_drake.ray_casting.proxies import make_proxies
from cns_drake.ray_casting.ray_groups import RayGroup
from cns_drake.ray_casting.rays import Rays
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    TriangleSurface,
)

SHAPES = [
    EllipsoidSurface((1.5, 1.5, 1.5)),
    EllipsoidSurface((0.5, 1.0, 2.0)),
    CylinderSurface(0.8, 2.5),
    CylinderSurface(0.04, 9.0),
    CapsuleSurface(0.6, 1.8),
]


def at(places):
    """Rays from so many places."""
    return Rays(
        places,
        np.eye(3)[None],
        np.ones(1, np.float32),
        np.eye(3)[np.zeros(len(places), int)],
        np.zeros(1, np.float32),
    )


def starts_near(groups, places):
    scene = EmbreeScene(groups, 1)
    return scene._near.contain(at(places), scene._targets.places)


@pytest.mark.parametrize("surface", SHAPES)
@pytest.mark.parametrize("count", [1, 5000])
def test_polyhedron_contains_the_shape_with_a_gap(surface, count):
    members = [(k, RigidTransform(), surface) for k in range(count)]
    proxies = make_proxies(members)
    mine = proxies.records["shape"] == 0
    a, b, c = proxies.corners[proxies.indices[mine].T].astype(float)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    normal, a = normal[area > 1e-9], a[area > 1e-9]
    normal /= area[area > 1e-9][:, None]
    points = points_on(surface, np.random.default_rng(2))
    outside = points @ normal.T - np.einsum("ij,ij->i", a, normal)
    assert outside.max() < -5e-4
    # A ray that starts in the polyhedron of one of many shapes is known.
    group = RayGroup(None, np.eye(4), members, True)
    group.place(np.zeros(3), lambda frame: None)
    corners = proxies.corners[np.unique(proxies.indices[mine])]
    assert starts_near([group], corners.astype(float)).all()


def test_nearness_of_many_shapes_is_that_of_each():
    """Places among shapes at all orientations, at rest and on frames."""
    rng = np.random.default_rng(5)
    poses = [
        RigidTransform(
            RollPitchYaw(*rng.uniform(-3.0, 3.0, 3)), rng.uniform(-9.0, 9.0, 3)
        )
        for _ in range(60)
    ]
    members = [(k, X, SHAPES[k % len(SHAPES)]) for k, X in enumerate(poses)]
    p_WO = np.array([1.0, 2.0, 3.0])

    def group(members, X_WF=None):
        frame = None if X_WF is None else FrameId.get_new_id()
        one = RayGroup(frame, np.eye(4), members, frame is None)
        one.place(p_WO, lambda frame: X_WF)
        return one

    places = rng.uniform(-10.0, 10.0, (3000, 3))
    for moves in (False, True):
        if moves:
            groups = [
                group([(k, RigidTransform(), surface)], X)
                for k, X, surface in members
            ]
            near = starts_near(groups, places)
            each = [starts_near([one], places) for one in groups]
        else:
            near = starts_near([group(members)], places)
            each = [starts_near([group([one])], places) for one in members]
        expected = np.any(each, axis=0)
        assert 100 < expected.sum() < 2900
        np.testing.assert_array_equal(near, expected)


def test_triangles_are_widened_in_their_planes():
    """Regular, slender and flat ones: by at least the margin on all sides."""
    rng = np.random.default_rng(6)
    corners = rng.normal(size=(300, 3, 3))
    # A needle, whose tips would be metres away; a line; a point.
    corners[:50, 2] = corners[:50, 0] + 1e-3 * corners[:50, 2]
    corners[50, 2], corners[51, 1:] = corners[50, 0], corners[51, 0]
    triangles = np.arange(900).reshape(-1, 3)
    surface = TriangleSurface(corners.reshape(-1, 3), triangles)
    proxies = make_proxies([(0, RigidTransform(), surface)])
    assert len(proxies.records) > 300
    same = proxies.corners[proxies.indices].astype(float)
    for k in (50, 51):
        (own,) = same[(proxies.records["corners"] == corners[k]).all((1, 2))]
        np.testing.assert_allclose(own, corners[k], atol=1e-6)
    for k in [*range(50), *range(52, 300)]:
        a, b, c = corners[k]
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n)
        mine = (proxies.records["corners"] == corners[k]).all(axis=(1, 2))
        # Points beside the edges and the corners.
        around = np.cross(n, np.roll(corners[k], -1, axis=0) - corners[k])
        around *= -4e-4 / np.linalg.norm(around, axis=1)[:, None]
        points = np.concatenate(
            [corners[k] + around, np.roll(corners[k], -1, axis=0) + around]
        )
        contained = np.zeros(len(points), bool)
        for wide in same[mine]:
            inside = np.ones(len(points), bool)
            turn = np.cross(wide[1] - wide[0], wide[2] - wide[0]) @ n
            for one, other in zip(wide, np.roll(wide, -1, axis=0), strict=True):
                side = np.cross(other - one, points - one) @ n
                inside &= side * np.sign(turn) >= -1e-9
            contained |= inside
        assert contained.all()
        assert np.abs(same[mine] - corners[k].mean(axis=0)).max() < 12.0
