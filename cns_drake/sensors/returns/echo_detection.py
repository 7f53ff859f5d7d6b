"""Detection of a beam's echoes by a unit, and their errors."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.counter_random import normal, uniform
from cns_drake.sensors.returns.link_budget import (
    CERTAIN_SNR,
    HOPELESS_SNR,
    LinkBudget,
    detection_probability,
    echo_energy,
    range_deviation,
    target_snr,
)

# Numbers of a beam's draws; lower ones serve the sub-rays and the leaves.
FIRST_ECHO_DRAW = 128
_DRAWS_PER_ECHO = 4
# The most echoes of surfaces that are processed.
MOST_ECHOES = 12
# Energy of a retro-reflector that makes the intensity full: 10,000 times that
# of a white target.
_FULL_RETRO = 1e4
_FULL_INTENSITY = 255.0


@compiled
def merge(
    light: np.ndarray,
    origin: np.ndarray,
    number: int,
    budget: LinkBudget,
    extinction: float,
    resolution: float,
    echo: np.ndarray,
    source: np.ndarray,
) -> int:
    """Fills in distance and SNR of each echo; returns their number."""
    size, begin, most = -1, -math.inf, 0.0
    for part in range(number):
        distance = light[part, 0]
        snr = target_snr(budget, extinction, light[part, 1], distance)
        if distance - begin > resolution:
            if size + 1 == MOST_ECHOES:
                break
            size += 1
            begin, most = distance, 0.0
            echo[size, 0] = echo[size, 1] = echo[size, 2] = 0.0
        # A sum weighted by the SNR, divided by it below.
        echo[size, 0] += snr * distance
        echo[size, 1] += snr
        if snr > most:
            most = snr
            source[size] = origin[part]
    for i in range(size + 1):
        if echo[i, 1] > 0.0:
            echo[i, 0] /= echo[i, 1]
    return size + 1


@compiled
def detect(
    budget: LinkBudget,
    min_range: float,
    max_range: float,
    key: np.uint64,
    beam: int,
    echo: np.ndarray,
    source: np.ndarray,
    size: int,
) -> int:
    """Keeps the echoes that are detected, with noise; returns their number."""
    kept = 0
    for i in range(size):
        snr = echo[i, 1]
        draw = FIRST_ECHO_DRAW + _DRAWS_PER_ECHO * min(i, MOST_ECHOES)
        is_sure = echo[i, 2] > 0.0
        echo[i, 2] = 0.0
        if not is_sure and not is_detected(key, beam, draw, snr):
            continue
        # Where a surface lies decides; an error of its range does not.
        if not min_range <= echo[i, 0] <= max_range:
            continue
        distance = measured_range(
            budget,
            min_range,
            max_range,
            key,
            beam,
            draw,
            echo[i, 0],
            snr,
        )
        # The unit corrects for the true distance; the error is too small.
        energy = echo_energy(budget, snr, echo[i, 0])
        echo[kept, 0], echo[kept, 1] = distance, snr
        echo[kept, 2] = energy
        source[kept] = source[i]
        kept += 1
    for i in range(kept, size):
        echo[i, 2] = 0.0
    return kept


@compiled
def is_detected(key: np.uint64, beam: int, draw: int, snr: float) -> bool:
    if snr > CERTAIN_SNR:
        return True
    if snr < HOPELESS_SNR:
        return False
    return uniform(key, beam, draw) < detection_probability(snr)


@compiled
def measured_range(
    budget: LinkBudget,
    min_range: float,
    max_range: float,
    key: np.uint64,
    beam: int,
    draw: int,
    distance: float,
    snr: float,
) -> float:
    """Returns the distance with its error."""
    distance += range_deviation(budget, snr) * normal(key, beam, draw + 1)
    return min(max(distance, min_range), max_range)


@compiled
def reported_intensity(retro_from: float, energy: float) -> float:
    """Returns the calibrated reflectivity in the scale of the unit.

    It is a whole number: linear up to a reflectivity of 1, logarithmic above.
    """
    if energy <= 1.0:
        return np.rint(retro_from * energy)
    rest = _FULL_INTENSITY - retro_from
    part = np.log(energy) / np.log(_FULL_RETRO)
    return np.rint(min(retro_from + rest * part, _FULL_INTENSITY))
