"""Polyhedra about curved shapes: around them, and close to them."""

from helpers.closed_forms import capsule, cylinder, ellipsoid
from helpers.points_on_shapes import points_on
from helpers.surface_geometry import make_geometry
import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    TriangleSurface,
)

WORLD = FrameId.get_new_id()
X_WG = RigidTransform(RollPitchYaw(0.3, -0.5, 1.1), [4.0, -3.0, 2.0])


def geometry(surface, X_FG):
    return make_geometry(surface, WORLD, X_FG)


def plate(p, size=0.02):
    corners = np.array([[0, -1, -1], [0, 1, -1], [0, 0, 1]]) * size
    return geometry(
        TriangleSurface(corners, np.array([[0, 1, 2]])), RigidTransform(p)
    )


@pytest.mark.parametrize("start", [1.001, 1.01, 1.03, 1.2, 3.0])
def test_geometry_between_polyhedron_and_shape_is_found(start):
    """A ray along -x meets a ball at 1 m unless a plate is in the way."""
    ball = geometry(EllipsoidSurface((1.0,) * 3), RigidTransform())
    ray = (np.array([start, 0.0, 0.0]), np.array([[-1.0, 0.0, 0.0]]), 50.0)
    for x, owner in ((1.0005, 1), (0.9, 0), (-1.5, 0)):
        scene = RayCastingScene(
            [ball, plate([x, 0.0, 0.0])], {WORLD}, lambda f: RigidTransform()
        )
        hits = scene.cast_rays(*ray)
        assert hits.geometry[0] == owner
        expected = start - (x if owner else 1.0)
        assert hits.ranges[0] == pytest.approx(expected, abs=2e-6)
    # Past the ball, through its polyhedron only.
    p = np.array([start, 1.0005, 0.0])
    scene = RayCastingScene(
        [ball, plate([-4.0, 1.0005, 0.0])], {WORLD}, lambda f: RigidTransform()
    )
    hits = scene.cast_rays(p, ray[1], 50.0)
    assert hits.geometry[0] == 1
    assert hits.ranges[0] == pytest.approx(start + 4.0, abs=2e-6)


@pytest.mark.parametrize("distance", [0.5, 110.0])
@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize(
    ("surface", "closed_form"),
    [
        (
            EllipsoidSurface((20.0, 0.01, 0.01)),
            lambda p, d: ellipsoid(p, d, (20.0, 0.01, 0.01)),
        ),
        (
            EllipsoidSurface((5.0, 5.0, 0.002)),
            lambda p, d: ellipsoid(p, d, (5.0, 5.0, 0.002)),
        ),
        (
            CapsuleSurface(0.001, 30.0),
            lambda p, d: capsule(p, d, 0.001, 30.0),
        ),
        (
            CylinderSurface(0.001, 30.0),
            lambda p, d: cylinder(p, d, 0.001, 30.0),
        ),
        (
            CylinderSurface(3.0, 0.02),
            lambda p, d: cylinder(p, d, 3.0, 0.02),
        ),
    ],
)
def test_the_thinnest_shapes_are_never_missed(
    surface, closed_form, moving, distance
):
    """By rays of a LiDAR far from O, which aim well inside of them.

    Some are longer than Embree can hit in one piece.
    """
    far = geometry(EllipsoidSurface((1.0,) * 3), RigidTransform([180.0, 0, 0]))
    X_WF = X_WG if moving else RigidTransform()
    frame = FrameId.get_new_id() if moving else WORLD
    thin = make_geometry(surface, frame, X_WF.inverse() @ X_WG)
    scene = RayCastingScene(
        [far, thin], {WORLD}, lambda f: X_WF if f == frame else RigidTransform()
    )
    p_G = distance * np.array([0.36, 0.48, 0.8])
    targets = 0.8 * points_on(surface, np.random.default_rng(9))
    d_G = targets - p_G
    d_G /= np.linalg.norm(d_G, axis=1, keepdims=True)
    expected = closed_form(np.broadcast_to(p_G, d_G.shape), d_G)
    d_W = d_G @ X_WG.rotation().matrix().T
    hits = scene.cast_rays(X_WG @ p_G, d_W, 200.0)
    assert np.isfinite(expected).all()
    assert (hits.geometry == 1).all()
    # Rays that graze amplify float32's rounding of the surface.
    error = np.abs(hits.ranges - expected)
    assert np.quantile(error, 0.9) < 5e-3


def test_the_farthest_range_holds_for_curved_shapes():
    ball = geometry(EllipsoidSurface((1.0,) * 3), RigidTransform([9, 0, 0]))
    scene = RayCastingScene([ball], {WORLD}, lambda f: RigidTransform())
    for reach, expected in ((7.999, np.inf), (8.001, 8.0)):
        hits = scene.cast_rays(np.zeros(3), np.eye(3)[:1], reach)
        np.testing.assert_allclose(hits.ranges, expected, atol=1e-5)
