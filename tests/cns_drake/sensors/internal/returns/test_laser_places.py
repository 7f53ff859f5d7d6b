"""Errors of a unit, and the texture of surfaces, in calibrated returns."""

from dataclasses import replace

from helpers.plates import plate, scan
import numpy as np
from pydrake.math import RigidTransform

from cns_drake.ray_casting import SceneHits, SurfaceFrames
from cns_drake.sensors import CalibratedReturns, make_beam_pattern
from cns_drake.sensors.returns.materials import LAMBERT, Materials
from worlds.shapes import StructureEntry, StructureTable

# The frame of surfaces that do not move.
STILL = SurfaceFrames(np.zeros(1, int), np.eye(3)[None], np.zeros((1, 3)))
ROAD = StructureTable([StructureEntry(1, "asphalt", "road")])


class Wall:
    """A scene with a wall 8 m ahead, for a unit that does not turn."""

    def cast_rays(self, p_WSset, d_Sset, max_range, **_):
        p_WSset = np.resize(p_WSset, d_Sset.shape)
        ranges = (8.0 - p_WSset[:, 0]) / d_Sset[:, 0]
        normals = np.tile(np.float32([-1.0, 0.0, 0.0]), (len(ranges), 1))
        is_met = (ranges > 0.0) & (ranges < 30.0)
        return SceneHits(
            np.where(is_met, ranges, np.inf).astype(np.float32),
            np.where(is_met, 0, -1).astype(np.int32),
            normals * is_met[:, None],
            is_met,
        )

    def surface_frames(self):
        return STILL


def test_lasers_have_their_places_however_poses_are_given():
    pattern = make_beam_pattern("hdl-64e")
    returns = CalibratedReturns.of_preset("hdl-64e", unit_seed=3)
    unit = returns.unit_beams(pattern.beams(0))
    zero = np.zeros(1, np.float32)
    half = np.full(1, 0.5, np.float32)
    materials = Materials(
        np.array([LAMBERT], np.uint8), half, zero, zero, half, *[zero] * 5
    )
    found = [
        returns.measure(
            Wall(),
            materials,
            pattern,
            unit,
            np.zeros((count, 3)),
            np.tile(np.eye(3), (count, 1, 1)),
            np.zeros(count),
            0,
        )
        for count in (1, pattern.num_columns, pattern.num_beams)
    ]
    assert len(found[0].beam) > 20_000
    for other in found[1:]:
        np.testing.assert_array_equal(other.beam, found[0].beam)
        np.testing.assert_array_equal(other.distance, found[0].distance)
        np.testing.assert_array_equal(other.intensity, found[0].intensity)


def road(x, distance, returns, seed=5):
    """Scans a wall of asphalt from a place x away from it along the world."""
    X_WG = RigidTransform([x + distance, 0.0, 0.0])
    pattern = make_beam_pattern("os1-128").within((-20, 20), (-20, 20))
    wall = plate("asphalt", None, X_WG)
    return scan([wall], pattern, replace(returns, seed=seed), structures=ROAD)
