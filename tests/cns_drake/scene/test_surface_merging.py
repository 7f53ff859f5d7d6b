import numpy as np
from pydrake.geometry import FrameId, GeometryId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    PerceptionGeometry,
    TriangleSurface,
    merge_surfaces,
    tessellate,
)

CURVED = {
    "sphere": (EllipsoidSurface((2.0, 2.0, 2.0)), 4 / 3 * np.pi * 8.0),
    "ellipsoid": (EllipsoidSurface((1.0, 2.0, 3.0)), 4 / 3 * np.pi * 6.0),
    "cylinder": (CylinderSurface(0.5, 3.0), np.pi * 0.25 * 3.0),
    "capsule": (
        CapsuleSurface(0.5, 3.0),
        np.pi * 0.25 * 3.0 + 4 / 3 * np.pi * 0.125,
    ),
}


def volume(surface):
    """Returns the volume inside faces that are wound outwards."""
    a, b, c = surface.p_GVset[surface.triangles].transpose(1, 0, 2)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


def outside(surface, p):
    """Returns a function that is zero on the exact surface."""
    if isinstance(surface, EllipsoidSurface):
        return np.linalg.norm(p / surface.semi_axes, axis=1) - 1.0
    radial = np.linalg.norm(p[:, :2], axis=1)
    along = np.abs(p[:, 2]) - surface.length / 2.0
    if isinstance(surface, CylinderSurface):
        return np.maximum(radial - surface.radius, along)
    return np.hypot(radial, np.maximum(along, 0.0)) - surface.radius


@pytest.mark.parametrize("name", CURVED)
def test_curved_shapes_are_closed_and_wound_outwards(name):
    surface, exact_volume = CURVED[name]
    triangles = tessellate(surface)
    edges = np.concatenate(
        [triangles.triangles[:, [0, 1]], triangles.triangles[:, [1, 2]],
         triangles.triangles[:, [2, 0]]]
    )  # fmt: skip
    # Closed and consistently wound: each directed edge once, and its twin.
    directed = {tuple(edge) for edge in edges.tolist()}
    assert len(directed) == len(edges)
    assert {(b, a) for a, b in directed} == directed
    # Inscribed: a little less than the exact volume.
    assert 0.88 * exact_volume < volume(triangles) < exact_volume
    np.testing.assert_allclose(
        outside(surface, triangles.p_GVset), 0.0, atol=1e-12
    )
    used = np.unique(triangles.triangles)
    assert len(used) == len(triangles.p_GVset)


def test_triangles_stay_as_they_are():
    surface = TriangleSurface(np.eye(3), np.array([[0, 1, 2]], np.int32))
    assert tessellate(surface) is surface


def geometry(frame_id, X_FG, surface):
    return PerceptionGeometry(
        GeometryId.get_new_id(), "m::s/p", frame_id, X_FG, surface, None
    )


def test_merging_applies_both_poses_and_keeps_vertices_shared():
    rng = np.random.default_rng(0)
    frames = [FrameId.get_new_id() for _ in range(2)]
    X_TFs = {
        frame: RigidTransform(
            RollPitchYaw(rng.uniform(-1, 1, 3)), rng.uniform(-9, 9, 3)
        )
        for frame in frames
    }
    X_FG = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [1.0, 2.0, 3.0])
    quad = TriangleSurface(
        rng.normal(size=(4, 3)), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    )
    ball = EllipsoidSurface((1.0, 2.0, 3.0))
    merged = merge_surfaces(
        [geometry(frames[0], X_FG, quad), geometry(frames[1], X_FG, ball),
         geometry(frames[1], RigidTransform(), quad)],
        X_TFs.__getitem__,
    )  # fmt: skip
    num_ball = len(tessellate(ball).p_GVset)
    assert len(merged.p_GVset) == 4 + num_ball + 4
    assert merged.triangles.dtype == np.int32
    np.testing.assert_allclose(
        merged.p_GVset[:4].T, X_TFs[frames[0]] @ X_FG @ quad.p_GVset.T
    )
    np.testing.assert_array_equal(merged.triangles[:2], quad.triangles)
    np.testing.assert_allclose(
        merged.p_GVset[-4:].T, X_TFs[frames[1]] @ quad.p_GVset.T
    )
    np.testing.assert_array_equal(
        merged.triangles[-2:], quad.triangles + 4 + num_ball
    )
    # The ball is at its pose, undistorted.
    X_TG = X_TFs[frames[1]] @ X_FG
    p_G = X_TG.inverse() @ merged.p_GVset[4 : 4 + num_ball].T
    np.testing.assert_allclose(outside(ball, p_G.T), 0.0, atol=1e-12)


def test_nothing_merges_to_nothing():
    merged = merge_surfaces([], lambda frame_id: RigidTransform())
    assert merged.p_GVset.shape == (0, 3)
    assert merged.triangles.shape == (0, 3)
