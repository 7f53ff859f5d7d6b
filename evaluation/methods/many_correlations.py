"""Circular correlations of one set of signals with many others.

Signals are given by their spectra. The correlations of a query's signals with
those of several places are computed side by side, as processors compute: each
number of the transform is a vector with a lane for each place. The transform is
Stockham's (C. Van Loan, Computational Frameworks for the Fast Fourier
Transform, 1992, section 1.7), with a pass for each prime factor of the length.
A transform of complex numbers inverts the spectra of two real signals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cns_drake.base.compiled import compiled
from evaluation.methods.float_lanes import LANES, load, magnitude, same, store

# Numbers of an array for LANES complex numbers: real parts, imaginary parts.
_PAIR = 2 * LANES


class ManyCorrelations:
    """Correlates a query's signals with those of D places.

    A query and each place have R signals of length n, R even, given by their
    spectra (R, n // 2 + 1), complex64.
    """

    def __init__(self, spectra: Sequence[np.ndarray], length: int):
        """Takes the places.

        Args:
            spectra: D of them.
            length: n, of the signals.
        """
        self._num_places = len(spectra)
        self._factors = np.array(_prime_factors(length), np.int64)
        angles = 2.0 * np.pi * np.arange(length) / length
        self._roots = np.stack(
            [np.cos(angles), np.sin(angles)], axis=1, dtype=np.float32
        )
        num_blocks = -(-len(spectra) // LANES)
        shape = (num_blocks, *spectra[0].shape, 2, LANES)
        self._conjugates = np.zeros(shape, np.float32)
        for place, spectrum in enumerate(spectra):
            block, lane = divmod(place, LANES)
            self._conjugates[block, :, :, 0, lane] = spectrum.real
            self._conjugates[block, :, :, 1, lane] = -spectrum.imag

    def greatest_sums(self, spectrum: np.ndarray) -> np.ndarray:
        """Returns (D,) float32, the best agreement with each place.

        It is the greatest value, over all shifts of a place's signals, of the
        sum of the correlations' magnitudes over all R signals.

        Args:
            spectrum: (R, n // 2 + 1) complex64 of the query.
        """
        length = len(self._roots)
        numbers = np.ascontiguousarray(spectrum).view(np.float32)
        sums = np.empty((len(self._conjugates), length, LANES), np.float32)
        for conjugates, found in zip(self._conjugates, sums, strict=True):
            _sum_magnitudes(
                numbers,
                conjugates.ravel(),
                self._factors,
                self._roots,
                found.ravel(),
            )
        return sums.max(axis=1).ravel()[: self._num_places] / length


def _prime_factors(number: int) -> list[int]:
    """Returns the prime factors of a number, greatest first."""
    factors: list[int] = []
    divisor = 2
    while number > 1:
        while number % divisor == 0:
            factors.insert(0, divisor)
            number //= divisor
        divisor += 1
    return factors


@compiled
def _sum_magnitudes(
    spectrum: np.ndarray,
    conjugates: np.ndarray,
    factors: np.ndarray,
    roots: np.ndarray,
    sums: np.ndarray,
) -> None:
    """Sums the magnitudes of correlations with LANES places, times n.

    Args:
        spectrum: (R, 2 F) float32 of the query, real and imaginary parts.
        conjugates: (R F 2 LANES,) float32 conjugates of the places' spectra.
        factors: prime factors of n.
        roots: (n, 2) float32 roots of unity.
        sums: (n LANES,) float32 to fill, for each shift.
    """
    num_frequencies, length = spectrum.shape[1] // 2, len(roots)
    here = np.empty(length * _PAIR, np.float32)
    there = np.empty(length * _PAIR, np.float32)
    mirrored = np.empty(max(factors) * _PAIR, np.float32)
    sums[:] = 0.0
    for row in range(0, len(spectrum), 2):
        # The first signal is the real part, the second the imaginary part.
        for k in range(num_frequencies):
            at = (row * num_frequencies + k) * _PAIR
            a_re, a_im = _product(spectrum[row], k, conjugates, at)
            at += num_frequencies * _PAIR
            b_re, b_im = _product(spectrum[row + 1], k, conjugates, at)
            if k in (0, length - k):
                _put(here, k, a_re, b_re)
            else:
                _put(here, k, a_re - b_im, a_im + b_re)
                _put(here, length - k, a_re + b_im, b_re - a_im)
        done = 1
        for factor in factors:
            left = length // (done * factor)
            if factor == 2:
                _transform_pairs(here, there, left, done, roots)
            else:
                _transform_odd(here, there, factor, left, done, roots, mirrored)
            done *= factor
            here, there = there, here
        for at in range(0, length * LANES, LANES):
            total = load(sums, at) + magnitude(load(here, 2 * at))
            store(sums, at, total + magnitude(load(here, 2 * at + LANES)))


@compiled
def _product(
    spectrum: np.ndarray, k: int, conjugates: np.ndarray, at: int
) -> tuple[Any, Any]:
    """Returns a query's number times those of places, real and imaginary.

    Args:
        spectrum: (2 F,) float32 of the query.
        k: which of its F numbers.
        conjugates: (N,) float32, see `_sum_magnitudes`.
        at: index of those of the places in it.
    """
    q_re, q_im = same(spectrum[2 * k]), same(spectrum[2 * k + 1])
    p_re, p_im = load(conjugates, at), load(conjugates, at + LANES)
    return q_re * p_re - q_im * p_im, q_re * p_im + q_im * p_re


@compiled
def _put(numbers: np.ndarray, index: int, re: Any, im: Any) -> None:
    """Stores complex numbers."""
    store(numbers, index * _PAIR, re)
    store(numbers, index * _PAIR + LANES, im)


@compiled
def _put_turned(
    numbers: np.ndarray, index: int, re: Any, im: Any, root: np.ndarray
) -> None:
    """Stores complex numbers times a root of unity, (2,) float32."""
    c, s = same(root[0]), same(root[1])
    _put(numbers, index, re * c - im * s, im * c + re * s)


@compiled
def _transform_pairs(
    here: np.ndarray,
    there: np.ndarray,
    left: int,
    done: int,
    roots: np.ndarray,
) -> None:
    """One pass of the transform, for the factor 2; see `_transform_odd`."""
    for p in range(left):
        for q in range(done):
            a = (p * done + q) * _PAIR
            b = a + left * done * _PAIR
            a_re, a_im = load(here, a), load(here, a + LANES)
            b_re, b_im = load(here, b), load(here, b + LANES)
            to = 2 * p * done + q
            _put(there, to, a_re + b_re, a_im + b_im)
            _put_turned(
                there, to + done, a_re - b_re, a_im - b_im, roots[p * done]
            )


@compiled
def _transform_odd(
    here: np.ndarray,
    there: np.ndarray,
    factor: int,
    left: int,
    done: int,
    roots: np.ndarray,
    mirrored: np.ndarray,
) -> None:
    """One pass of the transform, for an odd factor.

    Numbers t and factor - t have conjugate roots: their sum meets the roots'
    real parts alone, and their difference the imaginary parts.

    Args:
        here: (n 2 LANES,) float32 numbers.
        there: likewise, to fill.
        factor: of n.
        left: product of the factors of later passes.
        done: product of those of earlier passes.
        roots: (n, 2) float32 roots of unity.
        mirrored: to overwrite: sums and differences.
    """
    far, half = left * done, factor // 2
    for p in range(left):
        for q in range(done):
            at, to = p * done + q, factor * p * done + q
            a_re = load(here, at * _PAIR)
            a_im = load(here, at * _PAIR + LANES)
            sum_re, sum_im = a_re, a_im
            for t in range(1, half + 1):
                b = (at + t * far) * _PAIR
                c = (at + (factor - t) * far) * _PAIR
                b_re, b_im = load(here, b), load(here, b + LANES)
                c_re, c_im = load(here, c), load(here, c + LANES)
                _put(mirrored, 2 * t - 1, b_re + c_re, b_im + c_im)
                _put(mirrored, 2 * t, b_re - c_re, b_im - c_im)
                sum_re, sum_im = sum_re + (b_re + c_re), sum_im + (b_im + c_im)
            _put(there, to, sum_re, sum_im)
            for u in range(1, half + 1):
                sum_re, sum_im = a_re, a_im
                gap_re = gap_im = same(np.float32(0.0))
                for t in range(1, half + 1):
                    root = roots[t * u % factor * far]
                    c, s = same(root[0]), same(root[1])
                    k = (2 * t - 1) * _PAIR
                    sum_re += c * load(mirrored, k)
                    sum_im += c * load(mirrored, k + LANES)
                    gap_re += s * load(mirrored, k + _PAIR)
                    gap_im += s * load(mirrored, k + _PAIR + LANES)
                _put_turned(
                    there, to + u * done, sum_re - gap_im, sum_im + gap_re,
                    roots[p * u * done],
                )  # fmt: skip
                u_back = factor - u
                _put_turned(
                    there, to + u_back * done, sum_re + gap_im,
                    sum_im - gap_re, roots[p * u_back * done],
                )  # fmt: skip
