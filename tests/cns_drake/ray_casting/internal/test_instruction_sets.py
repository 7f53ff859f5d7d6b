"""Hits are the same with the instructions of every processor."""

from helpers.surface_geometry import make_geometry
import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.ray_casting import Motion, RayCastingScene, embree
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    TriangleSurface,
)

WORLD = FrameId.get_new_id()
CAR = FrameId.get_new_id()
X_WF = RigidTransform(RollPitchYaw(0.1, 0.2, -2.0), [-7.0, 1.0, 0.5])
MOTION = Motion(np.array([0.5, -3.0, 2.0]), np.array([9.0, 0.0, -4.0]), 0.1)


def steps(rng, width=12):
    """Squares of half a metre, some of them in one plane."""
    x, y = np.meshgrid(np.arange(width) / 2.0, np.arange(width) / 2.0)
    z = rng.integers(0, 2, x.shape) / 4.0
    corners = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    first = (
        np.arange(width - 1) + width * np.arange(width - 1)[:, None]
    ).ravel()
    triangles = np.concatenate(
        [
            np.stack([first, first + 1, first + width], axis=1),
            np.stack([first + 1, first + width, first + width + 1], axis=1),
        ]
    )
    return TriangleSurface(corners, triangles)


def geometries():
    """Surfaces that share edges, overlap and hide each other."""
    rng = np.random.default_rng(2)
    shapes = [
        EllipsoidSurface((1.0, 1.0, 1.0)),
        EllipsoidSurface((2.0, 0.5, 1.0)),
        CylinderSurface(0.05, 6.0),
        CapsuleSurface(0.3, 2.0),
    ]
    found = []
    for frame in (WORLD, CAR):
        for k in range(12):
            turn = RollPitchYaw(rng.uniform(-3.0, 3.0, 3))
            place = rng.uniform(-8.0, 8.0, 3) + 150.0 * (frame == WORLD)
            surface = shapes[k % 4] if k < 8 else steps(rng)
            found.append(
                make_geometry(surface, frame, RigidTransform(turn, place))
            )
    # A copy in the same place.
    return [*found, found[8]]


def cast(isa, monkeypatch):
    """All that a cast tells of rays towards shapes and beside corners."""
    with monkeypatch.context() as patch:
        patch.setattr(embree, "ALONE", embree.ALONE + b",isa=" + isa)
        scene = RayCastingScene(
            geometries(),
            {WORLD},
            lambda frame: X_WF if frame == CAR else RigidTransform(),
        )
    shift = RigidTransform(np.full(3, 150.0)) @ X_WF
    scene.set_frame_poses(lambda frame: shift, {CAR: MOTION})
    rng = np.random.default_rng(8)
    aims = rng.uniform(-9.0, 9.0, (6000, 3)) + 150.0
    aims[:3000] = np.concatenate(
        [g.X_FG.multiply(g.surface.p_GVset.T).T for g in geometries()[8:12]] * 6
    )[:3000]
    # Beside corners, as far as single precision is wrong.
    aims[:3000] += rng.normal(size=(3000, 3)) * 1e-5
    p = rng.normal(size=(6000, 3)) * 12.0 + 150.0
    d = aims - p
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    hits = scene.cast_rays(
        p,
        d,
        100.0,
        times=np.linspace(0.0, 1.0, 6000, dtype=np.float32),
        with_normals=True,
    )
    assert len(np.unique(hits.geometry)) > 20
    return [
        field.tobytes()
        for field in (
            hits.ranges, hits.geometry, hits.normals_W, hits.is_outside
        )
    ]  # fmt: skip


@pytest.mark.parametrize("isa", [b"sse4.2", b"avx", b"avx2", b"avx512"])
def test_hits_are_those_of_another_processor(isa, monkeypatch):
    with open("/proc/cpuinfo") as stream:
        if isa.replace(b".", b"_").decode() not in stream.read():
            pytest.skip("this processor has no such instructions")
    assert cast(isa, monkeypatch) == cast(b"sse2", monkeypatch)
