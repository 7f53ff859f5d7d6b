"""Allan deviations."""

import numpy as np


def allan_deviation(values, rate, tau):
    """Returns the overlapping Allan deviation, (...) of (N, ...) samples.

    Args:
        values: (N, ...) samples at an even rate.
        rate: samples per second.
        tau: averaging time [s].
    """
    size = round(tau * rate)
    sums = np.concatenate([np.zeros((1, *values.shape[1:])), values])
    sums = np.cumsum(sums, axis=0) / rate
    jumps = sums[2 * size :] - 2 * sums[size:-size] + sums[: -2 * size]
    return np.sqrt((jumps**2).mean(axis=0) / 2) / tau


def tolerance(duration, tau):
    """Returns three standard errors of such an estimate, relative."""
    return 3.0 / np.sqrt(2.0 * (duration / tau - 1.0))
