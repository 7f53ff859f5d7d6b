"""Makes a unit's reported points from the returning light of each beam."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.counter_random import normal, uniform
from cns_drake.sensors.returns.echo_choice import Echoes
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.link_budget import (
    CERTAIN_SNR,
    LinkBudget,
    detection_probability,
    echo_energy,
    range_deviation,
    target_snr,
)
from cns_drake.sensors.returns.weather import Scattering

# The index of the weather, in place of a geometry's.
SCATTERED = -2
# Numbers of a beam's draws; lower ones serve the sub-rays and the leaves.
_FIRST_ECHO_DRAW = 128
_DRAWS_PER_ECHO = 4
_FIRST_DROP_DRAW = 200
# The most echoes and drops of a beam that are processed.
_MOST_ECHOES = 12
_MOST_DROPS = 8
# Energy of a retro-reflector that makes the intensity full: 10,000 times that
# of a white target.
_FULL_RETRO = 1e4
_FULL_INTENSITY = 255.0


_CHOICE = {one: number for number, one in enumerate(Echoes)}
_FIRST, _STRONGEST, _LAST, _DUAL = range(4)


class Receiver(NamedTuple):
    """The receiver of a unit.

    Attributes:
        budget: its `LinkBudget`.
        extinction: of the weather [1/m].
        resolution: echoes nearer to each other are one [m]. min_range,
            max_range: limits of reported ranges [m].
        retro_from: see `UnitSheet`.
        choice: index of one of `Echoes`.
        scattering: by the weather; empty in clear air.
    """

    budget: LinkBudget
    extinction: float
    resolution: float
    min_range: float
    max_range: float
    retro_from: float
    choice: int
    scattering: Scattering


class Reported(NamedTuple):
    """M points that a unit reports, in firing order.

    Attributes:
        beam: (M,) int64.
        distance: (M,) float32 measured [m].
        intensity: (M,) float32, whole numbers from 0 to 255.
        geometry: (M,) int32 index of the geometry with most of the light;
            `SCATTERED` for the weather.
    """

    beam: np.ndarray
    distance: np.ndarray
    intensity: np.ndarray
    geometry: np.ndarray


def choice_of(echoes: Echoes) -> int:
    """Returns the number of a choice in compiled code."""
    return _CHOICE[echoes]


def report_echoes(
    light: Light,
    receiver: Receiver,
    key: np.uint64,
    num_beams: int,
) -> Reported:
    """Returns the reported points of the light.

    Light less than a pulse apart is one echo, whose distance is the mean by
    energy. An echo is detected by the probability of its SNR, and its distance
    has the standard deviation that belongs to that.

    Args:
        light: sorted.
        receiver: of the unit.
        key: of the frame; see `frame_key`.
        num_beams: of the turn.
    """
    most = num_beams * (2 if receiver.choice == _DUAL else 1)
    reported = Reported(
        np.zeros(most, np.int64),
        np.zeros(most, np.float32),
        np.zeros(most, np.float32),
        np.zeros(most, np.int32),
    )
    count = _report(light, receiver, key, num_beams, reported)
    return Reported(*(values[:count] for values in reported))


@compiled
def _report(
    light: Light,
    receiver: Receiver,
    key: np.uint64,
    num_beams: int,
    reported: Reported,
) -> int:
    """Fills in the reported points; returns their number."""
    echo = np.zeros((_MOST_ECHOES + _MOST_DROPS + 1, 3))
    source = np.zeros(len(echo), np.int32)
    budget, extinction = receiver.budget, receiver.extinction
    table = receiver.scattering
    is_clear = len(table.distances) == 0
    is_fog = not is_clear and table.fog_energies[-1] > 0.0
    count, part = 0, 0
    for beam in range(num_beams):
        first = part
        while part < len(light.beam) and light.beam[part] == beam:
            part += 1
        is_alone = is_clear
        if not is_clear and not is_fog:
            # The first drop is beyond the farthest end of a beam.
            arrived = -np.log(1.0 - uniform(key, beam, _FIRST_DROP_DRAW))
            is_alone = arrived >= table.counts[-1]
        if is_alone and part - first <= 1:
            # Most beams have at most a single echo.
            if part == first:
                continue
            distance = light.distance[first]
            if not receiver.min_range <= distance <= receiver.max_range:
                continue
            energy = light.energy[first]
            snr = target_snr(budget, extinction, energy, distance)
            if not _is_detected(key, beam, _FIRST_ECHO_DRAW, snr):
                continue
            if extinction > 0.0:
                energy *= np.exp(-2.0 * extinction * distance)
            reported.beam[count] = beam
            reported.distance[count] = _measured(
                budget,
                receiver.min_range,
                receiver.max_range,
                key,
                beam,
                _FIRST_ECHO_DRAW,
                distance,
                snr,
            )
            reported.intensity[count] = _intensity(receiver.retro_from, energy)
            reported.geometry[count] = light.geometry[first]
            count += 1
            continue
        size = _merge(light, first, part, receiver, echo, source)
        size = _scatter(receiver, key, beam, echo, source, size)
        size = _detect(receiver, key, beam, echo, source, size)
        if size == 0:
            # A unit reports the broad echo of fog only without any other.
            size = _add_fog(light, first, part, receiver, key, beam, echo)
            source[0] = SCATTERED
            size = _detect(receiver, key, beam, echo, source, size)
        if size == 0:
            continue
        best, nearest, farthest = 0, 0, 0
        for i in range(1, size):
            if echo[i, 1] > echo[best, 1]:
                best = i
            if echo[i, 0] < echo[nearest, 0]:
                nearest = i
            if echo[i, 0] > echo[farthest, 0]:
                farthest = i
        if receiver.choice == _FIRST:
            best = nearest
        elif receiver.choice == _LAST:
            best = farthest
        count = _write(
            receiver, beam, echo[best], source[best], reported, count
        )
        if receiver.choice == _DUAL and size > 1:
            # The last one as well, or the second strongest if the last is the
            # strongest.
            other = farthest
            if other == best:
                other = 0 if best != 0 else 1
                for i in range(size):
                    if i != best and echo[i, 1] > echo[other, 1]:
                        other = i
            count = _write(
                receiver, beam, echo[other], source[other], reported, count
            )
    return count


@compiled
def _merge(
    light: Light,
    first: int,
    last: int,
    receiver: Receiver,
    echo: np.ndarray,
    source: np.ndarray,
) -> int:
    """Fills in distance and SNR of each echo; returns their number."""
    size, begin, most = -1, -math.inf, 0.0
    for part in range(first, last):
        distance = light.distance[part]
        snr = target_snr(
            receiver.budget, receiver.extinction, light.energy[part], distance
        )
        if distance - begin > receiver.resolution:
            if size + 1 == _MOST_ECHOES:
                break
            size += 1
            begin, most = distance, 0.0
            echo[size, 0] = echo[size, 1] = echo[size, 2] = 0.0
        # A sum weighted by the SNR, divided by it below.
        echo[size, 0] += snr * distance
        echo[size, 1] += snr
        if snr > most:
            most = snr
            source[size] = light.geometry[part]
    for i in range(size + 1):
        if echo[i, 1] > 0.0:
            echo[i, 0] /= echo[i, 1]
    return size + 1


@compiled
def _scatter(
    receiver: Receiver,
    key: np.uint64,
    beam: int,
    echo: np.ndarray,
    source: np.ndarray,
    size: int,
) -> int:
    """Adds echoes of the weather; returns the number of echoes."""
    table = receiver.scattering
    if len(table.distances) == 0:
        return size
    # No drop is beyond the end of the beam.
    end = receiver.max_range
    for i in range(size):
        end = min(end, echo[i, 0])
    draw = _FIRST_DROP_DRAW
    mean = interpolate(end, table.distances, table.counts)
    # A Poisson number, as arrivals in an interval of this length.
    arrived = 0.0
    for _ in range(_MOST_DROPS):
        arrived -= np.log(1.0 - uniform(key, beam, draw))
        if arrived >= mean:
            break
        distance = interpolate(arrived, table.counts, table.distances)
        row = np.searchsorted(table.distances, distance)
        if row == len(table.distances):
            row -= 1
        column = int(uniform(key, beam, draw + 1) * table.energies.shape[1])
        echo[size, 0] = distance
        # Drops in the table are detected already.
        echo[size, 1] = target_snr(
            receiver.budget,
            receiver.extinction,
            table.energies[row, column],
            distance,
        )
        echo[size, 2] = 1.0
        source[size] = SCATTERED
        size += 1
        draw += 2
    return size


@compiled
def _add_fog(
    light: Light,
    first: int,
    last: int,
    receiver: Receiver,
    key: np.uint64,
    beam: int,
    echo: np.ndarray,
) -> int:
    """Fills in the echo of fog, if any; returns the number of echoes."""
    table = receiver.scattering
    if len(table.distances) == 0 or table.fog_energies[-1] == 0.0:
        return 0
    share = uniform(key, beam, _FIRST_DROP_DRAW + 2 * _MOST_DROPS)
    distance = interpolate(share, table.fog_counts, table.distances)
    if first < last and light.distance[first] < distance:
        return 0
    energy = interpolate(distance, table.distances, table.fog_energies)
    echo[0, 0] = distance
    echo[0, 1] = target_snr(
        receiver.budget, receiver.extinction, energy, distance
    )
    echo[0, 2] = 0.0
    return 1


@compiled
def interpolate(x: float, xs: np.ndarray, ys: np.ndarray) -> float:
    """Returns y at x on the line through points whose x rise."""
    above = np.searchsorted(xs, x)
    if above == 0:
        return ys[0]
    if above == len(xs):
        return ys[-1]
    step = xs[above] - xs[above - 1]
    part = (x - xs[above - 1]) / step if step > 0.0 else 0.0
    return ys[above - 1] + part * (ys[above] - ys[above - 1])


@compiled
def _detect(
    receiver: Receiver,
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
        draw = _FIRST_ECHO_DRAW + _DRAWS_PER_ECHO * min(i, _MOST_ECHOES)
        is_sure = echo[i, 2] > 0.0
        echo[i, 2] = 0.0
        if not is_sure and not _is_detected(key, beam, draw, snr):
            continue
        # The true range decides, not the one with error.
        if not receiver.min_range <= echo[i, 0] <= receiver.max_range:
            continue
        distance = _measured(
            receiver.budget,
            receiver.min_range,
            receiver.max_range,
            key,
            beam,
            draw,
            echo[i, 0],
            snr,
        )
        # Intensity is corrected by the true distance; the error is negligible.
        energy = echo_energy(receiver.budget, snr, echo[i, 0])
        echo[kept, 0], echo[kept, 1] = distance, snr
        echo[kept, 2] = energy
        source[kept] = source[i]
        kept += 1
    for i in range(kept, size):
        echo[i, 2] = 0.0
    return kept


@compiled
def _is_detected(key: np.uint64, beam: int, draw: int, snr: float) -> bool:
    if snr > CERTAIN_SNR:
        return True
    return uniform(key, beam, draw) < detection_probability(snr)


@compiled
def _measured(
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
def _write(
    receiver: Receiver,
    beam: int,
    echo: np.ndarray,
    source: int,
    reported: Reported,
    count: int,
) -> int:
    reported.beam[count] = beam
    reported.distance[count] = echo[0]
    reported.intensity[count] = _intensity(receiver.retro_from, echo[2])
    reported.geometry[count] = source
    return count + 1


@compiled
def _intensity(retro_from: float, energy: float) -> float:
    """Returns the calibrated reflectivity in the scale of the unit.

    It is a whole number: linear up to a reflectivity of 1, logarithmic above.
    """
    if energy <= 1.0:
        return np.rint(retro_from * energy)
    rest = _FULL_INTENSITY - retro_from
    part = np.log(energy) / np.log(_FULL_RETRO)
    return np.rint(min(retro_from + rest * part, _FULL_INTENSITY))
