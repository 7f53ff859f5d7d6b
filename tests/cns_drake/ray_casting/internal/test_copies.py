"""Copies of a mesh share memory; rays have the same hits as before."""

import numpy as np
from pydrake.geometry import FrameId, GeometryId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.ray_casting import Motion, RayCastingScene, ray_groups
from cns_drake.scene import (
    EllipsoidSurface,
    PerceptionGeometry,
    TriangleSurface,
)

WORLD = FrameId.get_new_id()
CAR = FrameId.get_new_id()
CART = FrameId.get_new_id()
POSES = {
    WORLD: RigidTransform(),
    CAR: RigidTransform(RollPitchYaw(0.1, 0.2, -2.0), [-7.0, 1.0, 0.5]),
    CART: RigidTransform(RollPitchYaw(-0.3, 0.1, 0.8), [9.0, -4.0, 1.0]),
}
MOTIONS = {
    CAR: Motion(np.array([0.5, -3.0, 2.0]), np.array([9.0, 0.0, -4.0]), 0.1)
}


def soup(rng, count):
    corners = rng.normal(size=(count, 1, 3)) + rng.normal(size=(count, 3, 3))
    return TriangleSurface(
        corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)
    )


def geometries():
    """Copies in the world and on two frames, among other things."""
    rng = np.random.default_rng(4)
    mesh, rest = soup(rng, 50), soup(rng, 40)
    ball = EllipsoidSurface((1.0, 0.8, 1.5))
    surfaces = [mesh, rest, mesh, ball, mesh, mesh, rest, mesh, ball, mesh]
    frames = [WORLD, WORLD, WORLD, WORLD, CAR, CAR, CAR, CART, CART, WORLD]
    return [
        PerceptionGeometry(
            GeometryId.get_new_id(),
            "model::visual",
            frame,
            RigidTransform(
                RollPitchYaw(rng.uniform(-3, 3, 3)),
                # Far from the world's origin, where float32 is coarse.
                rng.normal(size=3) * 5.0 + (frame == WORLD) * 9000.0,
            ),
            surface,
            None,
        )
        for surface, frame in zip(surfaces, frames, strict=True)
    ]


def pose_of(frame_id):
    shift = RigidTransform(np.full(3, 9000.0 * (frame_id != WORLD)))
    return shift @ POSES[frame_id]


def make_scene(shapes, most, monkeypatch, **arguments):
    monkeypatch.setattr(ray_groups, "MOST_COPIED_TRIANGLES", most)
    return RayCastingScene(shapes, {WORLD}, pose_of, **arguments)


def scenes_of_copies(scene):
    """The Embree scene of each copy."""
    hierarchy = scene._scene
    return [
        hierarchy._by_content[group.content()].scene
        for group in hierarchy._groups
        for _, X_LG, surface in group.members
        if isinstance(surface, TriangleSurface) and X_LG.IsExactlyIdentity()
    ]


def rays():
    rng = np.random.default_rng(8)
    p = rng.normal(size=(6000, 3))
    p *= 30.0 / np.linalg.norm(p, axis=1, keepdims=True)
    d = rng.normal(size=(6000, 3)) * 5.0 - p
    return p + 9000.0, d / np.linalg.norm(d, axis=1, keepdims=True)


def assert_equal_hits(found, expected):
    same = found.geometry == expected.geometry
    # At edges the last bit decides which is hit.
    assert same.mean() > 0.998
    hit = same & (expected.geometry >= 0)
    np.testing.assert_allclose(
        found.ranges[hit], expected.ranges[hit], atol=2e-3
    )
    error = np.abs(found.ranges[hit] - expected.ranges[hit])
    assert np.quantile(error, 0.98) < 2e-5
    cosine = np.einsum("ij,ij->i", found.normals_W, expected.normals_W)[hit]
    assert cosine.min() > 1 - 1e-4
    np.testing.assert_array_equal(
        found.is_outside[hit], expected.is_outside[hit]
    )


@pytest.mark.parametrize("motions", [{}, MOTIONS])
@pytest.mark.parametrize("num_threads", [1, 3])
def test_rays_meet_copies_as_if_they_were_merged(
    motions, num_threads, monkeypatch
):
    shapes = geometries()
    copies = make_scene(shapes, 299, monkeypatch, num_threads=num_threads)
    merged = make_scene(shapes, 300, monkeypatch, num_threads=num_threads)
    assert len(scenes_of_copies(copies)) == 6
    assert len(set(scenes_of_copies(copies))) == 1
    assert scenes_of_copies(merged) == []
    p, d = rays()
    times = np.linspace(0.0, 1.0, len(p), dtype=np.float32)
    found = []
    for scene in (copies, merged):
        scene.set_frame_poses(pose_of, motions)
        found.append(
            scene.cast_rays(p, d, 60.0, times=times, with_normals=True)
        )
    assert set(range(-1, 10)) == set(found[1].geometry)
    assert_equal_hits(*found)


def test_copies_come_and_go(monkeypatch):
    """Remaining geometry is not rebuilt and keeps its index."""
    shapes = geometries()
    scene = make_scene(shapes, 99, monkeypatch)
    built = set(scenes_of_copies(scene))
    for kept in ([2, 0, 1, 3, 9], [9, 8, 5, 4, 3, 2, 1, 0]):
        some = [shapes[k] for k in kept]
        scene = make_scene(some, 99, monkeypatch, previous=scene)
        assert set(scenes_of_copies(scene)) == built
        expected = make_scene(some, 10**9, monkeypatch)
        p, d = rays()
        assert_equal_hits(
            scene.cast_rays(p, d, 60.0, with_normals=True),
            expected.cast_rays(p, d, 60.0, with_normals=True),
        )
