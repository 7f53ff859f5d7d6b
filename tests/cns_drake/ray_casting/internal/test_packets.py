"""Packets of rays: all sizes give the same hits, and the best is taken."""

import ctypes

from helpers.closed_forms import ellipsoid
from helpers.surface_geometry import make_geometry
import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform
import pytest

from cns_drake.ray_casting import RayCastingScene, embree
from cns_drake.scene import EllipsoidSurface, TriangleSurface

WORLD = FrameId.get_new_id()
CAR = FrameId.get_new_id()
# From rtcore_device.h: RTC_DEVICE_PROPERTY_NATIVE_RAY<n>_SUPPORTED.
NATIVE = {4: 32, 8: 33, 16: 34}


@pytest.mark.parametrize("num_rays", [1, 5, 8, 23, 300])
@pytest.mark.parametrize("lanes", sorted(NATIVE))
def test_hits_of_packets_of_each_size(monkeypatch, lanes, num_rays):
    function = getattr(embree.load(), f"rtcIntersect{lanes}")
    address = ctypes.cast(function, ctypes.c_void_p).value
    taken = []

    def packet(library, device):
        taken.append(lanes)
        return lanes, address

    monkeypatch.setattr(embree, "native_packet", packet)
    p_WFo = np.array([6.0, 2.0, -1.0])
    semi_axes = (2.0, 0.7, 1.1)
    wall = np.array([[12, -90, -90], [12, 90, -90], [12, 0, 90]], float)
    scene = RayCastingScene(
        [
            make_geometry(TriangleSurface(wall, np.array([[0, 1, 2]])), WORLD),
            make_geometry(EllipsoidSurface(semi_axes), CAR),
        ],
        {WORLD},
        lambda frame: RigidTransform(p_WFo if frame == CAR else np.zeros(3)),
    )
    rng = np.random.default_rng(3)
    d_W = p_WFo + rng.uniform(-1.5, 1.5, (num_rays, 3))
    d_W /= np.linalg.norm(d_W, axis=1, keepdims=True)
    hits = scene.cast_rays(np.zeros(3), d_W, 100.0, with_normals=True)
    assert taken
    expected = ellipsoid(np.tile(-p_WFo, (num_rays, 1)), d_W, semi_axes)
    is_car = np.isfinite(expected)
    expected[~is_car] = 12.0 / d_W[~is_car, 0]
    np.testing.assert_allclose(hits.ranges, expected, atol=2e-3)
    np.testing.assert_array_equal(hits.geometry, is_car.astype(int))
    along = np.abs(hits.normals_W[~is_car, 0])
    np.testing.assert_allclose(along, 1.0, atol=1e-6)
    if num_rays == 300:
        assert 50 < is_car.sum() < 250
