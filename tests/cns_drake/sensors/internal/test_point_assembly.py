"""Points from the ranges of beams, against NumPy's arithmetic."""

import numpy as np
import pytest

from cns_drake.sensors import POINT_DTYPE, make_beam_pattern
from cns_drake.sensors.lidar.measurement import Returns
from cns_drake.sensors.lidar.scan_assembly import BeamTable, assemble_points


@pytest.mark.parametrize("step", [0.0, 2.0**-10, 0.003])
@pytest.mark.parametrize("is_apart", [False, True])
def test_points_are_what_numpy_makes_of_the_beams(step, is_apart):
    rng = np.random.default_rng(8)
    pattern = make_beam_pattern("vlp-16", 0.05)
    num = pattern.num_beams
    table = BeamTable(
        pattern.d_Sset.astype(np.float32),
        rng.normal(0.0, 0.1, (num * is_apart, 3)).astype(np.float32),
        pattern.beams(0).ring,
        pattern.beams(0).t_ns,
        rng.permutation(num),
    )
    beams = np.flatnonzero(rng.random(num) < 0.7)
    ranges = rng.uniform(1.0, 90.0, len(beams)).astype(np.float32)
    intensity = rng.random(len(beams), np.float32)
    met = rng.integers(0, 9, len(beams)).astype(np.int32)
    met[:3] = -2  # What the weather sent back.
    label = rng.integers(0, 255, 9).astype(np.uint8)
    instance = rng.integers(0, 60_000, 9).astype(np.uint16)
    returns = Returns(beams, ranges, intensity)
    scan = np.zeros(len(beams), POINT_DTYPE)
    assemble_points(
        scan, table, returns, met, label, instance, np.float32(step)
    )
    expected = table.d_Sset[beams] * ranges[:, None]
    if is_apart:
        expected += table.p_Sset[beams]
    assert expected.dtype == np.float32
    if step:
        expected = np.rint(expected / np.float32(step)) * np.float32(step)
    for axis, name in enumerate("xyz"):
        np.testing.assert_array_equal(scan[name], expected[:, axis])
    np.testing.assert_array_equal(scan["intensity"], intensity)
    np.testing.assert_array_equal(scan["ring"], pattern.beams(0).ring[beams])
    np.testing.assert_array_equal(scan["t"], pattern.beams(0).t_ns[beams])
    np.testing.assert_array_equal(scan["label"][3:], label[met[3:]])
    np.testing.assert_array_equal(scan["instance"][3:], instance[met[3:]])
    assert (scan["label"][:3] == 1).all()
    assert (scan["instance"][:3] == 0).all()
