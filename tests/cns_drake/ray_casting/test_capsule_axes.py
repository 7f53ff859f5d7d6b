"""Rays along the axes of capsules, which Embree alone loses."""

import numpy as np
from pydrake.geometry import FrameId, GeometryId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.ray_casting import KnownPoses, Motion, RayCastingScene
from cns_drake.scene import CapsuleSurface, EllipsoidSurface, PerceptionGeometry

WORLD = FrameId.get_new_id()
MOVING = FrameId.get_new_id()
X_WC = RigidTransform(RollPitchYaw(0.3, 0.5, 0.7), [101.0, -52.0, 3.0])
X_WF = RigidTransform(RollPitchYaw(-0.2, 0.9, 2.0), [90.0, -40.0, 1.0])
CREEPING = Motion(np.zeros(3), np.array([1e-3, 0.0, 0.0]), 0.1)
SWINGING = Motion(np.array([1.0, 0.5, -4.0]), np.array([-12.0, 7, 2]), 0.1)


def make_geometry(surface, frame, X_FG=RigidTransform()):  # noqa: B008
    geometry_id = GeometryId.get_new_id()
    return PerceptionGeometry(geometry_id, "a::b", frame, X_FG, surface, None)


def make_scene(surface, frame, motion=None):
    """Returns a scene of one surface that is at X_WC in the beginning."""
    X_WB = RigidTransform() if frame == WORLD else X_WF
    geometry = make_geometry(surface, frame, X_WB.inverse() @ X_WC)
    scene = RayCastingScene([geometry], {WORLD}, lambda f: X_WB)
    if motion:
        scene.set_frame_poses(lambda f: X_WB, {frame: motion})
    return scene


def poses(motion, times):
    """Returns rotations and positions of C at fractions of a turn."""
    t = (motion.start + times * motion.duration)[:, None]
    R = Rotation.from_rotvec(t * motion.w).as_matrix()
    p_FC = X_WC.translation() - X_WF.translation()
    return (
        R @ X_WC.rotation().matrix(),
        X_WF.translation() + t * motion.v + R @ p_FC,
    )


def rays_along(rng, surface, angle, number):
    """Returns rays in C that aim at an end of a capsule, from outside."""
    side = rng.choice([-1.0, 1.0], number)
    d = np.column_stack([*rng.normal(scale=angle, size=(2, number)), side])
    d /= np.linalg.norm(d, axis=1)[:, None]
    turn = rng.uniform(0.0, 2.0 * np.pi, number)
    across = surface.radius * np.sqrt(rng.uniform(0.0, 1.3, number))
    targets = np.column_stack(
        [
            across * np.cos(turn),
            across * np.sin(turn),
            -side * surface.length / 2.0,
        ]
    )
    away = rng.uniform(2.0 * surface.radius, 30.0, number)
    return targets - d * away[:, None], d


def outside_of(surface, p):
    """Returns the distance of places (N, 3) in C to a capsule, or depth."""
    half = surface.length / 2.0
    nearest = np.clip(p[:, 2], -half, half)
    foot = np.column_stack([0.0 * nearest, 0.0 * nearest, nearest])
    return np.linalg.norm(p - foot, axis=1) - surface.radius


def first_hits(surface, p, d):
    """Returns the first hits (N,) and the least distances (N,) along rays.

    The distance to a convex body is convex along a ray: its minimum is found
    by thirds, and the hit between the ray's start and there by halves.
    """

    def outside(t):
        return outside_of(surface, p + t[:, None] * d)

    low, high = np.zeros(len(p)), np.full(len(p), 200.0)
    for _ in range(200):
        a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
        falls = outside(a) > outside(b)
        low, high = np.where(falls, a, low), np.where(falls, high, b)
    least = outside(low)
    start, end = np.zeros(len(p)), low
    for _ in range(100):
        middle = (start + end) / 2.0
        is_in = outside(middle) < 0.0
        start, end = (
            np.where(is_in, start, middle),
            np.where(is_in, middle, end),
        )
    return np.where(least < 0.0, end, np.inf), least


@pytest.mark.parametrize(
    ("frame", "motion"),
    [
        (WORLD, None),
        (MOVING, None),
        (MOVING, CREEPING),
        (MOVING, SWINGING),
        (MOVING, SWINGING._replace(start=-0.1)),
    ],
)
@pytest.mark.parametrize("size", [(0.4, 2.0), (0.03, 1.4), (1.0, 0.01)])
@pytest.mark.parametrize("angle", [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
def test_they_meet_its_end(frame, motion, size, angle):
    surface = CapsuleSurface(*size)
    p_C, d_C = rays_along(np.random.default_rng(6), surface, angle, 600)
    expected, least = first_hits(surface, p_C, d_C)
    times = np.linspace(0.0, 1.0, len(p_C))
    R_WC, p_WC = poses(motion or Motion(*np.zeros((2, 3)), 0.0), times)
    p_W, d_W = (np.einsum("nij,nj->ni", R_WC, one) for one in (p_C, d_C))
    hits = make_scene(surface, frame, motion).cast_rays(
        p_W + p_WC, d_W, 200.0, times=times, with_normals=True
    )
    # Single precision cannot tell whether a ray grazes it.
    is_sure = np.abs(least) > 1e-4
    is_hit = np.isfinite(expected)
    assert 300 < np.count_nonzero(is_sure & is_hit) < 590
    np.testing.assert_array_equal(
        np.isfinite(hits.ranges)[is_sure], is_hit[is_sure]
    )
    met = is_sure & is_hit
    ranges = hits.ranges[met].astype(float)
    places = p_C[met] + ranges[:, None] * d_C[met]
    on_end = np.abs(places[:, 2]) > surface.length / 2.0 + 0.05 * size[0]
    assert np.abs(ranges - expected[met])[on_end].max() < 3e-4
    axis_point = np.clip(places[:, 2], -size[1] / 2.0, size[1] / 2.0)
    places[:, 2] -= axis_point
    # Normals are those at the start of the turn.
    outward = np.where(hits.is_outside, 1.0, -1.0)[:, None] * hits.normals_W
    normals = (outward[met] @ X_WC.rotation().matrix())[on_end]
    np.testing.assert_allclose(normals, places[on_end] / size[0], atol=5e-3)
    assert (motion and motion.w.any()) or hits.is_outside[met].all()
    assert set(hits.geometry[met].tolist()) == {0}


@pytest.mark.parametrize("frame", [WORLD, MOVING])
def test_rays_from_inside_meet_the_end_ahead(frame):
    scene = make_scene(CapsuleSurface(0.4, 2.0), frame)
    axis = X_WC.rotation().matrix()[:, 2]
    origin = X_WC.translation() + 0.3 * axis
    hits = scene.cast_rays(origin, np.array([axis, -axis]), 50.0)
    np.testing.assert_allclose(hits.ranges, [1.1, 1.7], atol=1e-5)


def test_what_is_nearer_or_out_of_reach_counts():
    capsule = make_geometry(CapsuleSurface(0.5, 2.0), WORLD)
    ball = make_geometry(
        EllipsoidSurface((0.3, 0.3, 0.3)), WORLD, RigidTransform([0, 0, 6.0])
    )
    scene = RayCastingScene(
        [capsule, ball], {WORLD}, lambda f: RigidTransform()
    )
    down = np.array([[0.0, 0.0, -1.0]])
    for height, reach, expected, owner in (
        (10.0, 50.0, 3.7, 1),
        (5.0, 50.0, 3.5, 0),
        (5.0, 3.501, 3.5, 0),
        (5.0, 3.499, np.inf, -1),
    ):
        hits = scene.cast_rays(np.array([0.0, 0.0, height]), down, reach)
        assert hits.ranges[0] == pytest.approx(expected, abs=1e-5)
        assert hits.geometry[0] == owner


def test_a_capsule_is_met_where_it_is_now():
    """Many origins far apart, each with rays of its own."""
    geometry = make_geometry(CapsuleSurface(0.2, 1.0), MOVING)
    scene = RayCastingScene([geometry], {WORLD}, lambda f: RigidTransform())
    p_WSset = np.array([[-40.0, 3.0, 1.0], [7.0, 50.0, 1.0], [0.0, 0.0, 30.0]])
    for X_WF, seeing in (
        (RigidTransform(RollPitchYaw(0, np.pi / 2, 0), [9.0, 3.0, 1.0]), 0),
        (RigidTransform(RollPitchYaw(np.pi / 2, 0, 0), [7.0, 4.0, 1.0]), 1),
        (RigidTransform([0.0, 0.0, -5.0]), 2),
    ):
        known = KnownPoses({MOVING: 0}, X_WF.GetAsMatrix4()[None])
        ends = np.eye(3)[seeing]
        d = np.tile(
            (X_WF.translation() - p_WSset[seeing]) @ ends * ends, (3, 1)
        )
        d /= np.linalg.norm(d[0])
        scene.set_frame_poses(None, known=known)
        hits = scene.cast_rays(p_WSset, d, 100.0)
        distance = np.linalg.norm(X_WF.translation() - p_WSset[seeing])
        expected = np.full(3, np.inf)
        expected[seeing] = distance - 0.7
        np.testing.assert_allclose(hits.ranges, expected, atol=1e-5)
