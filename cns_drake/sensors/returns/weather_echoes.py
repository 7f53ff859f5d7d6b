"""Echoes of drops and fog along a beam."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.counter_random import uniform
from cns_drake.sensors.returns.link_budget import LinkBudget, target_snr

# The index of the weather, in place of a geometry's.
SCATTERED = -2
# Numbers of a beam's draws.
_FIRST_DROP_DRAW = 200
# The most drops of a beam that are processed.
MOST_DROPS = 8


@compiled
def first_drop(key: np.uint64, beam: int) -> float:
    """Returns the mean number of drops that are nearer than the first one.

    Drops are arrivals of a Poisson process, in units of their mean number.
    """
    return -np.log(1.0 - uniform(key, beam, _FIRST_DROP_DRAW))


@compiled
def add_drops(
    budget: LinkBudget,
    extinction: float,
    end: float,
    distances: np.ndarray,
    counts: np.ndarray,
    energies: np.ndarray,
    key: np.uint64,
    beam: int,
    echo: np.ndarray,
    source: np.ndarray,
    size: int,
) -> int:
    """Adds echoes of drops in front of surfaces; returns the number of echoes.

    Args:
        budget: of the unit.
        extinction: of the weather [1/m].
        end: greatest distance of a drop [m].
        distances, counts, energies: see `Scattering`.
        key: of the frame.
        beam: number of the beam.
        echo: (_, 3) distance and SNR of each echo, and whether it is detected
            already, to add to.
        source: (_,) of each echo.
        size: the number of echoes of surfaces.
    """
    # Fog alone has no drops.
    if counts[-1] == 0.0:
        return size
    for i in range(size):
        end = min(end, echo[i, 0])
    draw = _FIRST_DROP_DRAW
    mean = _interpolate(end, distances, counts)
    # A Poisson number, as arrivals in an interval of this length.
    arrived = 0.0
    for _ in range(MOST_DROPS):
        arrived -= np.log(1.0 - uniform(key, beam, draw))
        if arrived >= mean:
            break
        distance = _interpolate(arrived, counts, distances)
        row = np.searchsorted(distances, distance)
        if row == len(distances):
            row -= 1
        column = int(uniform(key, beam, draw + 1) * energies.shape[1])
        echo[size, 0] = distance
        # Drops in the table are detected already.
        echo[size, 1] = target_snr(
            budget, extinction, energies[row, column], distance
        )
        echo[size, 2] = 1.0
        source[size] = SCATTERED
        size += 1
        draw += 2
    return size


@compiled
def fog_echo(
    budget: LinkBudget,
    extinction: float,
    distances: np.ndarray,
    fog_energies: np.ndarray,
    fog_counts: np.ndarray,
    key: np.uint64,
    beam: int,
) -> tuple[float, float]:
    """Returns the distance [m] and the SNR of a beam's echo of fog.

    Args:
        budget: of the unit.
        extinction: of the weather [1/m].
        distances, fog_energies, fog_counts: see `Scattering`.
        key: of the frame.
        beam: number of the beam.
    """
    share = uniform(key, beam, _FIRST_DROP_DRAW + 2 * MOST_DROPS)
    distance = _interpolate(share, fog_counts, distances)
    energy = _interpolate(distance, distances, fog_energies)
    return distance, target_snr(budget, extinction, energy, distance)


@compiled
def _interpolate(x: float, xs: np.ndarray, ys: np.ndarray) -> float:
    """Returns y at x on the line through points whose x rise."""
    above = np.searchsorted(xs, x)
    if above == 0:
        return ys[0]
    if above == len(xs):
        return ys[-1]
    step = xs[above] - xs[above - 1]
    part = (x - xs[above - 1]) / step if step > 0.0 else 0.0
    return ys[above - 1] + part * (ys[above] - ys[above - 1])
