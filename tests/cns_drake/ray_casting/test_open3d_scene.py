"""Without Embree's wheel, Open3D finds the same hits."""

from helpers.surface_geometry import make_geometry
import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.ray_casting import open3d_scene
from cns_drake.ray_casting import ray_casting_scene as ray_casting
from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.ray_casting.ray_groups import Motion
from cns_drake.scene.surfaces import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    TriangleSurface,
)

WORLD, CAR = FrameId.get_new_id(), FrameId.get_new_id()
X_WF = RigidTransform(RollPitchYaw(0.1, 0.2, -2.0), [-7.0, 1.0, 0.5])
CURVED = [
    EllipsoidSurface((1.5, 1.5, 1.5)),
    EllipsoidSurface((2.0, 0.7, 1.1)),
    CylinderSurface(0.8, 2.5),
    CapsuleSurface(0.6, 1.8),
]


def geometry(surface, X_FG, frame_id):
    return make_geometry(surface, frame_id, X_FG)


def soup(rng, count):
    """Triangles of all sizes and directions about the origin."""
    corners = rng.normal(size=(count, 1, 3)) * 8 + rng.normal(
        size=(count, 3, 3)
    )
    return TriangleSurface(
        corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)
    )


def pose_of(frame_id):
    return X_WF if frame_id == CAR else RigidTransform()


def both(geometries, monkeypatch):
    """The scene by Embree and by Open3D."""
    embree = RayCastingScene(geometries, {WORLD}, pose_of)
    monkeypatch.setattr(ray_casting, "_EMBREE_PACKAGE", "not_installed")
    return embree, RayCastingScene(geometries, {WORLD}, pose_of)


def rays(rng, count):
    p = rng.normal(size=(count, 3))
    p *= 30.0 / np.linalg.norm(p, axis=1, keepdims=True)
    d = rng.normal(size=(count, 3)) * 3.0 - p
    return p, d / np.linalg.norm(d, axis=1, keepdims=True)


def test_the_same_on_triangles_that_stand_and_move(monkeypatch, capsys):
    open3d_scene._say_once.cache_clear()
    rng = np.random.default_rng(3)
    geometries = [
        geometry(soup(rng, 40), RigidTransform([k, 0, 0]), frame)
        for k, frame in enumerate([WORLD, WORLD, CAR, CAR])
    ]
    embree, open3d = both(geometries, monkeypatch)
    assert "casting rays with Open3D" in capsys.readouterr().err
    p, d = rays(rng, 5000)
    a, b = (
        scene.cast_rays(p, d, 50.0, with_normals=True)
        for scene in (embree, open3d)
    )
    assert len(np.unique(a.geometry)) == 5
    # At edges the last bit decides which is hit.
    same = a.geometry == b.geometry
    assert same.mean() > 0.999
    hit = same & (a.geometry >= 0)
    np.testing.assert_allclose(a.ranges[hit], b.ranges[hit], atol=1e-4)
    assert np.isinf(b.ranges[b.geometry < 0]).all()
    cosine = np.einsum("ij,ij->i", a.normals_W[hit], b.normals_W[hit])
    assert cosine.min() > 1 - 1e-4
    # The note appears once for any number of scenes.
    RayCastingScene(geometries, {WORLD}, pose_of)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("surface", CURVED)
@pytest.mark.parametrize("frame", [WORLD, CAR])
def test_curved_shapes_within_millimetres(surface, frame, monkeypatch):
    rng = np.random.default_rng(5)
    X_FG = RigidTransform(RollPitchYaw(0.3, -0.5, 1.1), [1.0, -2.0, 0.5])
    embree, open3d = both([geometry(surface, X_FG, frame)], monkeypatch)
    center = (pose_of(frame) @ X_FG).translation()
    p, d = rays(rng, 3000)
    a, b = (s.cast_rays(p + center, d, 60.0) for s in (embree, open3d))
    hit = (a.geometry >= 0) & (b.geometry >= 0)
    assert hit.sum() > 100
    # Rays that graze a polyhedron may miss what they should hit.
    assert (a.geometry == b.geometry).mean() > 0.99
    error = np.abs(a.ranges[hit] - b.ranges[hit])
    assert np.quantile(error, 0.95) < 3e-3


def test_the_farthest_range_is_the_same(monkeypatch):
    wall = TriangleSurface(
        np.array([[10.0, -50, -50], [10, 50, -50], [10, 0, 80]]),
        np.array([[0, 1, 2]]),
    )
    geometries = [geometry(wall, RigidTransform(), WORLD)]
    for scene in both(geometries, monkeypatch):
        for reach, expected in ((9.999, np.inf), (10.001, 10.0)):
            hits = scene.cast_rays(np.zeros(3), np.eye(3)[:1], reach)
            np.testing.assert_allclose(hits.ranges, expected, atol=1e-5)


def test_the_same_on_what_moves_meanwhile(monkeypatch):
    rng = np.random.default_rng(11)
    geometries = [
        geometry(soup(rng, 30), RigidTransform([1.0, 2.0, 0.0]), CAR),
        geometry(EllipsoidSurface((9.0, 4.0, 6.0)), X_WF, CAR),
    ]
    motion = Motion(np.array([1.0, -3.0, 2.0]), np.array([9.0, 0, -4.0]), 0.1)
    p, d = rays(rng, 4000)
    times = rng.uniform(size=len(p))
    found = []
    for scene in both(geometries, monkeypatch):
        scene.set_frame_poses(pose_of, {CAR: motion})
        found.append(scene.cast_rays(p, d, 60.0, times=times))
    same = found[0].geometry == found[1].geometry
    assert same.mean() > 0.99
    hit = same & (found[0].geometry == 0)
    assert hit.sum() > 100
    np.testing.assert_allclose(
        found[0].ranges[hit], found[1].ranges[hit], atol=2e-3
    )
