"""Road profiles: the spectrum of ISO 8608, and one road for every drive."""

import numpy as np
import pytest
from scipy.signal import welch

from cns_drake.motion import RoadProfile


def line(start, angle, length, step):
    """Returns (N, 2) places along a straight line."""
    s = np.arange(0.0, length, step)
    return np.array(start) + np.outer(s, [np.cos(angle), np.sin(angle)])


@pytest.mark.slow
def test_the_spectrum_along_lines_is_that_of_the_class():
    step = 0.1
    window = 600.0
    spectra = []
    for seed in range(5):
        profile = RoadProfile("C", seed)
        for angle in (0.0, 0.5, np.pi / 4, 1.9):
            places = line([300.0 * angle, -77.0], angle, 3000.0, step)
            frequency, spectrum = welch(
                profile.heights(places), 1 / step, nperseg=int(window / step)
            )
            spectra.append(spectrum)
    spectrum = np.mean(spectra, axis=0)
    for octave in range(8):
        low, high = 2.0**octave / 90.0, 2.0 ** (octave + 1) / 90.0
        inside = (frequency >= low) & (frequency < high)
        expected = np.mean(256e-6 * (frequency[inside] / 0.1) ** -2)
        found = np.mean(spectrum[inside])
        assert found == pytest.approx(expected, rel=0.1), (low, high)


def test_a_place_has_one_height():
    first = line([-40.0, 3.0], 0.2, 100.0, 0.37)
    other = line([5.0, -60.0], 1.4, 100.0, 0.29)
    profile = RoadProfile("B", 7)
    alone = profile.heights(first)
    together = profile.heights(np.concatenate([other, first[::-1]]))
    np.testing.assert_allclose(together[len(other) :][::-1], alone, atol=1e-12)
    again = RoadProfile("B", 7).heights(first)
    np.testing.assert_array_equal(again, alone)
    differs = RoadProfile("B", 8).heights(first) - alone
    assert np.std(differs) > np.std(alone)
    # Each class has twice the heights of the class before.
    rougher = RoadProfile("C", 7).heights(first)
    np.testing.assert_allclose(rougher, 2.0 * alone, rtol=1e-12)


def test_the_surface_is_smooth_at_every_scale():
    profile = RoadProfile("A", 3)
    near = profile.heights(line([12.0, 9.0], 0.7, 0.4, 1e-4))
    slope = np.diff(near) / 1e-4
    bending = np.diff(slope) / 1e-4
    # C2: the second derivative changes little from one place to the next.
    steps = np.abs(np.diff(bending))
    assert steps.max() < 0.05 * np.ptp(bending)
    # Left and right wheels share long waves, but not short ones.
    left = line([0.0, 0.0], 0.3, 2000.0, 0.2)
    right = left + 1.58 * np.array([-np.sin(0.3), np.cos(0.3)])
    a, b = profile.heights(left), profile.heights(right)
    short = [np.diff(z) for z in (a, b)]
    assert np.corrcoef(a, b)[0, 1] > 0.9
    assert np.corrcoef(*short)[0, 1] < 0.3
