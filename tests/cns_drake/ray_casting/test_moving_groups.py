"""Geometry out of sight is not placed again; scans stay the same."""

import numpy as np
from pydrake.geometry import FrameId, GeometryId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.ray_casting import Ball, KnownPoses, Motion, RayCastingScene
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    PerceptionGeometry,
    TriangleSurface,
)

WORLD = FrameId.get_new_id()
REACH = 12.0
FRAMES = [FrameId.get_new_id() for _ in range(24)]
ROWS = {frame: row for row, frame in enumerate(FRAMES)}


def make_geometries():
    corners = np.array([(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2)], float)
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    surfaces = [
        TriangleSurface(corners, faces),
        CapsuleSurface(0.4, 1.5),
        EllipsoidSurface((1.5, 0.4, 0.8)),
        CylinderSurface(0.7, 2.0),
    ]
    X_FG = RigidTransform(RollPitchYaw(0.4, -0.2, 1.0), [1.0, 0.5, -0.3])
    return [
        PerceptionGeometry(
            GeometryId.get_new_id(), "a::b", frame, X_FG,
            surfaces[k % len(surfaces)], None,
        )
        for k, frame in enumerate(FRAMES)
    ]  # fmt: skip


def random_poses(rng):
    return [
        RigidTransform(RollPitchYaw(*rng.normal(size=3)), [*p, 0.0])
        for p in rng.uniform(-20.0, 20.0, (len(FRAMES), 2))
    ]


def cast_about(scene, p_WS, times):
    turn = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    d = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    return scene.cast_rays(p_WS, d, REACH, times=times, with_normals=True)


@pytest.mark.parametrize("with_motions", [False, True])
def test_a_scene_sees_what_a_new_one_sees(with_motions):
    """All geometry jumps, and moves by steps that may be tiny or zero."""
    rng = np.random.default_rng(3)
    geometries = make_geometries()
    poses = random_poses(rng)
    kept = RayCastingScene(geometries, {WORLD}, lambda f: poses[ROWS[f]])
    times = np.array([0.0, 0.5]) if with_motions else np.zeros(1)
    p_WS = np.zeros(3)
    seen = []
    for _ in range(40):
        p_WS[:2] += rng.normal(scale=4.0, size=2)
        for k in rng.choice(len(poses), 8):
            shift = RigidTransform([*rng.normal(scale=6.0, size=2), 0.0])
            poses[k] = shift @ poses[k]
        motions = {}
        if with_motions:
            motions = {
                frame: Motion(
                    rng.normal(size=3), np.array([*rng.normal(size=2), 0]), 2.0
                )
                for frame in rng.choice(FRAMES, 6, replace=False)
            }
        X_WFs = np.array([X_WF.GetAsMatrix4() for X_WF in poses])
        kept.set_frame_poses(
            lambda f: pytest.fail("all are known"),
            motions,
            KnownPoses(ROWS, X_WFs),
            Ball(p_WS, REACH),
        )
        new = RayCastingScene(geometries, {WORLD}, lambda f: poses[ROWS[f]])
        if motions:
            new.set_frame_poses(lambda f: poses[ROWS[f]], motions)
        hits, expected = (cast_about(s, p_WS, times) for s in (kept, new))
        np.testing.assert_array_equal(hits.ranges, expected.ranges)
        np.testing.assert_array_equal(hits.geometry, expected.geometry)
        np.testing.assert_array_equal(hits.normals_W, expected.normals_W)
        seen.append(np.isfinite(hits.ranges).mean())
    assert np.mean(seen) > 0.05


@pytest.mark.parametrize("lengths", [(3, 5, 2, 4), (4, 1, 3, 5), (1, 2, 60, 6)])
def test_ray_i_takes_entry_i_of_each_array_modulo_its_length(lengths):
    rng = np.random.default_rng(5)
    poses = random_poses(rng)
    motions = {
        frame: Motion(rng.normal(size=3), rng.normal(size=3), 2.0)
        for frame in FRAMES
    }
    scene = RayCastingScene(
        make_geometries(), {WORLD}, lambda f: poses[ROWS[f]]
    )
    scene.set_frame_poses(lambda f: poses[ROWS[f]], motions)
    num = 6000
    d = rng.normal(size=(num, 3)) * [1.0, 1.0, 0.1]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    k, m, n, t = lengths
    arrays = (
        np.column_stack([*rng.uniform(-15.0, 15.0, (2, k)), np.zeros(k)]),
        rng.uniform(5.0, 60.0, m),
        np.array([RollPitchYaw(0, 0, a).ToRotationMatrix().matrix()
                  for a in rng.uniform(0, 6, n)]),
        np.linspace(0.0, 1.0, t),
    )  # fmt: skip
    whole = [one[np.arange(num) % len(one)] for one in arrays]
    found, expected = (
        scene.cast_rays(p, d, reach, R_WSset=R, times=times, with_normals=True)
        for p, reach, R, times in (arrays, whole)
    )
    assert 0.02 < np.isfinite(found.ranges).mean() < 0.98
    np.testing.assert_array_equal(found.ranges, expected.ranges)
    np.testing.assert_array_equal(found.normals_W, expected.normals_W)
