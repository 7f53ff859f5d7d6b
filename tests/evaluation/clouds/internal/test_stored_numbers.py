"""Fields of points: numbers that fit, and numbers that do not."""

import numpy as np
import pytest

from evaluation.clouds.record_reading import store


def stored(dtype, value):
    points = np.zeros(2, [("ring", dtype), ("x", "f4")])
    store(points, "ring", np.array([0.0, value]))
    return points["ring"][1]


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4"])
def test_integers_fit_up_to_their_limits(dtype):
    limits = np.iinfo(dtype)
    assert stored(dtype, float(limits.max)) == limits.max
    assert stored(dtype, float(limits.min)) == limits.min
    for value in (limits.max + 1.0, limits.min - 1.0, 2.5, np.nan, np.inf):
        with pytest.raises(ValueError, match=f"ring: .* fit {np.dtype(dtype)}"):
            stored(dtype, value)


@pytest.mark.parametrize("dtype", ["u8", "i8"])
def test_long_integers_stay_exact(dtype):
    points = np.zeros(1, [("ring", dtype)])
    most = np.iinfo(dtype).max
    store(points, "ring", np.array([most], dtype))
    assert points["ring"][0] == most
    with pytest.raises(ValueError, match="does not fit"):
        stored(dtype, 2.0**64)


def test_floats_fit_up_to_their_limits():
    most = float(np.finfo("f4").max)
    assert stored("f4", most) == most
    assert np.isnan(stored("f4", np.nan))
    with pytest.raises(ValueError, match="fit float32"):
        stored("f4", 2.0 * most)
