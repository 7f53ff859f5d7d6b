"""Correlations with many signals, by NumPy in double precision."""

import numpy as np
import pytest

from evaluation.methods.float_lanes import LANES
from evaluation.methods.many_correlations import ManyCorrelations

NUM_SIGNALS = 6


def draw_spectra(seed, number, length):
    rng = np.random.default_rng([seed, length])
    signals = rng.normal(size=(number, NUM_SIGNALS, length))
    return np.fft.rfft(signals, axis=2).astype(np.complex64)


def greatest_sums(places, query, length):
    """Returns the sums by their definition: one correlation a shift."""
    signals = np.fft.irfft(places, n=length, axis=2)
    own = np.fft.irfft(query, n=length, axis=1)
    sums = [
        np.abs((own * np.roll(signals, shift, axis=2)).sum(axis=2)).sum(axis=1)
        for shift in range(length)
    ]
    return np.max(sums, axis=0)


# Primes, powers of them, and products, whose passes differ in order and number.
@pytest.mark.parametrize("length", [2, 3, 4, 7, 8, 9, 30, 49, 77, 113, 120])
def test_sums_have_their_definition(length):
    places = draw_spectra(1, 3, length)
    (query,) = draw_spectra(2, 1, length)
    found = ManyCorrelations(places, length).greatest_sums(query)
    expected = greatest_sums(places, query, length)
    np.testing.assert_allclose(found, expected, rtol=2e-6)


@pytest.mark.parametrize("number", [1, LANES - 1, LANES, LANES + 1, 3 * LANES])
def test_places_do_not_influence_each_other(number):
    places = draw_spectra(3, number, 12)
    (query,) = draw_spectra(4, 1, 12)
    found = ManyCorrelations(places, 12).greatest_sums(query)
    alone = [
        ManyCorrelations(places[k : k + 1], 12).greatest_sums(query)[0]
        for k in range(number)
    ]
    assert found.dtype == np.float32
    assert found.tolist() == alone


def test_the_best_shift_is_found():
    (place,) = draw_spectra(5, 1, 40)
    turned = place * np.exp(-2j * np.pi * 11 * np.arange(21) / 40)
    correlations = ManyCorrelations([place], 40)
    found = correlations.greatest_sums(turned.astype(np.complex64))
    # Without a shift, each signal correlates with itself.
    own = (np.fft.irfft(place, n=40, axis=1) ** 2).sum()
    np.testing.assert_allclose(found, [own], rtol=1e-5)
