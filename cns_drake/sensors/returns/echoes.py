"""Echoes: the points that a unit reports for the light of each beam."""

from functools import lru_cache
import math
from typing import NamedTuple

import numpy as np

from cns_drake.sensors.lidar.measurement import Echoes
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.link_budget import (
    CERTAIN_SNR,
    HOPELESS_SNR,
    LinkBudget,
    detection_probability,
    echo_energy,
    range_deviation,
    target_snr,
)
from cns_drake.sensors.returns.random_numbers import normal, uniform
from cns_drake.sensors.returns.tables import join, select
from cns_drake.sensors.returns.weather import Scattering
from evaluation.base import compiled, log
from evaluation.lidar_sheets import Response, ReturnsSheet

# The index of the weather, in place of a geometry's.
SCATTERED = -2
# Number of the first of a beam's random draws for echoes; lower numbers belong
# to the sub-rays.
_FIRST_ECHO_DRAW = 128
# Number of draws for each echo.
_DRAWS_PER_ECHO = 4
# Number of the first draw for drops.
_FIRST_DROP_DRAW = 200
# Greatest number of echoes of surfaces per beam.
_MOST_ECHOES = 12
# Greatest number of drops per beam.
_MOST_DROPS = 8
# Energy of a retro-reflector at which intensity saturates: 10,000 times that of
# a white target.
_FULL_RETRO = 1e4
# Intensity at which it saturates.
_FULL_INTENSITY = 255.0


class Receiver(NamedTuple):
    """The receiver of a unit, in a given weather.

    Attributes:
        sheet: data sheet of the unit.
        budget: link budget: the strength of an echo by distance.
        extinction: extinction coefficient of the air [1/m].
        min_range: least reported range [m].
        max_range: greatest reported range [m].
        choice: which echoes of a beam are reported.
        scattering: echoes of rain, snow and fog; None in clear air.
    """

    sheet: ReturnsSheet
    budget: LinkBudget
    extinction: float
    min_range: float
    max_range: float
    choice: Echoes
    scattering: Scattering | None


class Reported(NamedTuple):
    """M points that a unit reports, in firing order.

    Attributes:
        beam: (M,) int64 number of each point's beam.
        distance: (M,) float32 measured distances [m].
        intensity: (M,) float32, whole numbers from 0 to 255.
        geometry: (M,) int32 index of the geometry that reflected most of the
            echo's light; `SCATTERED` for echoes of rain, snow or fog.
    """

    beam: np.ndarray
    distance: np.ndarray
    intensity: np.ndarray
    geometry: np.ndarray


class _EchoTable(NamedTuple):
    """N echoes, before or after their detection.

    Attributes:
        beam: (N,) number of each echo's beam.
        number: (N,) number of each echo among the echoes of its beam.
        distance: (N,) distances [m].
        snr: (N,) signal-to-noise ratios.
        energy: (N,) energy that the unit infers if it assumes clear air.
        geometry: (N,) index of the reflecting geometry, as in `Reported`.
        is_sure: (N,) bool, whether each echo is detected in any case.
    """

    beam: np.ndarray
    number: np.ndarray
    distance: np.ndarray
    snr: np.ndarray
    energy: np.ndarray
    geometry: np.ndarray
    is_sure: np.ndarray


def report_echoes(
    light: Light,
    receiver: Receiver,
    key: np.uint64,
    range_error: np.ndarray,
    gain: np.ndarray,
) -> Reported:
    """Returns the points that the unit reports for the received light.

    Light from distances that differ by less than half a pulse length forms one
    echo. The distance of the echo is the mean of these distances, weighted by
    energy. The SNR of an echo determines the probability that it is detected,
    and the standard deviation of its distance.

    Args:
        light: the light that came back from surfaces.
        receiver: receiver of the unit.
        key: key of the random numbers; see
            `cns_drake.sensors.returns.random_numbers.frame_key`.
        range_error: (N,) range error of each beam's laser [m].
        gain: (N,) gain of each beam's laser.
    """
    num_beams = len(gain)
    unit = receiver.budget, receiver.extinction, receiver.sheet.resolution
    pulses = _merge_light(light, *unit, num_beams)
    scattering = receiver.scattering
    if scattering is not None and scattering.counts[-1] > 0.0:
        drops = _drop_echoes(pulses, receiver, scattering, key, num_beams)
        pulses = join([pulses, drops])
    pulses = _detected_echoes(pulses, receiver, key, range_error)
    if scattering is not None and scattering.fog_energies[-1] > 0.0:
        # A unit reports the broad echo of fog only if the beam has no other
        # echo.
        nearest = np.full(num_beams, np.inf)
        np.minimum.at(nearest, light.beam, light.distance)
        nearest[pulses.beam] = -np.inf
        fog = _fog_echoes(nearest, receiver, scattering, key)
        pulses = join(
            [pulses, _detected_echoes(fog, receiver, key, range_error)]
        )
    chosen = select(pulses, _choose_echoes(pulses, receiver.choice, num_beams))
    return Reported(
        chosen.beam,
        chosen.distance.astype(np.float32),
        _reported_intensity(chosen, receiver, key, gain).astype(np.float32),
        chosen.geometry,
    )


@compiled
def _merge_light(
    light: Light,
    budget: LinkBudget,
    extinction: float,
    resolution: float,
    num_beams: int,
) -> _EchoTable:
    """Returns the echoes of surfaces, beam by beam, the nearest first.

    A new echo begins where the light comes from more than `resolution` [m]
    behind the beginning of the last echo. `resolution` is half the length of a
    pulse.
    """
    row, first = _sort_by_beam(light, num_beams)
    count = len(row)
    beam, number = np.empty(count, np.int64), np.empty(count, np.int64)
    mean, total = np.empty(count), np.empty(count)
    energy, geometry = np.empty(count), np.empty(count, np.int32)
    echo = -1
    for this_beam in range(num_beams):
        begin = 0.0
        index = -1
        most = 0.0
        for k in row[first[this_beam] : first[this_beam + 1]]:
            distance = light.distance[k]
            snr = target_snr(budget, extinction, light.energy[k], distance)
            if index < 0 or distance - begin > resolution:
                begin = distance
                index += 1
                most = snr
                if index == _MOST_ECHOES:
                    break
                echo += 1
                beam[echo], number[echo] = this_beam, index
                # A single part of the light needs no mean.
                mean[echo], total[echo] = distance, snr
                energy[echo] = light.energy[k]
                geometry[echo] = light.geometry[k]
                if extinction > 0.0:
                    energy[echo] *= np.exp(-2.0 * extinction * distance)
            elif total[echo] + snr > 0.0:
                way = total[echo] * mean[echo] + snr * distance
                total[echo] += snr
                mean[echo] = way / total[echo]
                energy[echo] = echo_energy(budget, total[echo], mean[echo])
            if snr > most:
                most = snr
                geometry[echo] = light.geometry[k]
    echo += 1
    return _EchoTable(
        beam[:echo],
        number[:echo],
        mean[:echo],
        total[:echo],
        energy[:echo],
        geometry[:echo],
        np.zeros(echo, np.bool_),
    )


@compiled
def _sort_by_beam(
    light: Light, num_beams: int
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the rows of `light`, sorted by beam and then by distance.

    Also returns where the rows of each beam begin, and where the rows of the
    last beam end, (num_beams + 1,).
    """
    first = np.zeros(num_beams + 1, np.int64)
    for beam in light.beam:
        first[beam + 1] += 1
    first = np.cumsum(first)
    row = np.empty(len(light.beam), np.int64)
    end = first[:-1].copy()
    away = light.distance
    for k, beam in enumerate(light.beam):
        place = end[beam]
        while place > first[beam] and away[row[place - 1]] > away[k]:
            row[place] = row[place - 1]
            place -= 1
        row[place] = k
        end[beam] += 1
    return row, first


def _drop_echoes(
    surfaces: _EchoTable,
    receiver: Receiver,
    scattering: Scattering,
    key: np.uint64,
    num_beams: int,
) -> _EchoTable:
    """Returns the detected echoes of drops in front of surfaces."""
    distances, counts = scattering.distances, scattering.counts
    # Drops along a beam are arrivals of a Poisson process; distance is measured
    # by the mean number of drops up to it. In most beams, even the first drop
    # is beyond the maximum range.
    beam = np.arange(num_beams)
    none = uniform(key, beam, _FIRST_DROP_DRAW) > 1.0 - math.exp(-counts[-1])
    end = np.full(num_beams, receiver.max_range)
    # A surface that sends no light back counts as the nearest.
    near = np.where(surfaces.snr > 0.0, surfaces.distance, 0.0)
    np.minimum.at(end, surfaces.beam, near)
    number = np.bincount(surfaces.beam, minlength=num_beams)
    beam = beam[~none]
    mean = np.interp(end[beam], distances, counts)
    arrived = np.zeros(len(beam))
    found = [select(surfaces, np.zeros(0, np.int64))]
    for k in range(_MOST_DROPS):
        draw = _FIRST_DROP_DRAW + 2 * k
        arrived = arrived + _drops_until_next(key, beam, draw)
        is_near = arrived < mean
        beam, arrived, mean = beam[is_near], arrived[is_near], mean[is_near]
        if not len(beam):
            break
        distance = np.interp(arrived, counts, distances)
        row = np.searchsorted(distances, distance)
        row = np.minimum(row, len(distances) - 1)
        column = uniform(key, beam, draw + 1) * scattering.energies.shape[1]
        energy = scattering.energies[row, column.astype(int)]
        snr = target_snr(receiver.budget, receiver.extinction, energy, distance)
        found.append(
            _EchoTable(
                beam,
                number[beam] + k,
                distance,
                snr,
                echo_energy(receiver.budget, snr, distance),
                np.full(len(beam), SCATTERED, np.int32),
                # The table contains only drops that are detected.
                np.ones(len(beam), bool),
            )
        )
    return join(found)


@compiled
def _drops_until_next(
    key: np.uint64, beam: np.ndarray, draw: int
) -> np.ndarray:
    """Samples the distance to each beam's next drop, as a mean drop count."""
    return -np.log(1.0 - uniform(key, beam, draw))


def _fog_echoes(
    nearest: np.ndarray,
    receiver: Receiver,
    scattering: Scattering,
    key: np.uint64,
) -> _EchoTable:
    """Returns the echoes of fog in front of the nearest light of each beam.

    Args:
        nearest: (num_beams,) distance of the nearest light [m]; -inf for beams
            that get no echo of fog.
    """
    beam = np.flatnonzero(nearest > 0.0)
    share = uniform(key, beam, _FIRST_DROP_DRAW + 2 * _MOST_DROPS)
    distance = np.interp(share, scattering.fog_counts, scattering.distances)
    is_near = distance <= nearest[beam]
    beam, distance = beam[is_near], distance[is_near]
    energy = np.interp(distance, scattering.distances, scattering.fog_energies)
    snr = target_snr(receiver.budget, receiver.extinction, energy, distance)
    return _EchoTable(
        beam,
        np.zeros_like(beam),
        distance,
        snr,
        echo_energy(receiver.budget, snr, distance),
        np.full(len(beam), SCATTERED, np.int32),
        np.zeros(len(beam), bool),
    )


def _detected_echoes(
    pulses: _EchoTable,
    receiver: Receiver,
    key: np.uint64,
    range_error: np.ndarray,
) -> _EchoTable:
    """Returns the echoes that the unit detects, with range errors added."""
    # The true distance of a surface decides, not the measured one.
    is_seen = pulses.snr >= HOPELESS_SNR
    is_seen &= pulses.energy >= receiver.sheet.response.least
    is_seen |= pulses.is_sure
    is_seen &= receiver.min_range <= pulses.distance
    is_seen &= pulses.distance <= receiver.max_range
    is_unsure = is_seen & ~pulses.is_sure & (pulses.snr <= CERTAIN_SNR)
    unsure = np.flatnonzero(is_unsure)
    draw = _first_draw(pulses)
    is_seen[unsure] = uniform(
        key, pulses.beam[unsure], draw[unsure]
    ) < detection_probability(pulses.snr[unsure])
    seen = select(pulses, is_seen)
    draw = draw[is_seen]
    error = range_deviation(receiver.budget, seen.snr)
    error *= normal(key, seen.beam, draw + 1)
    error += range_error[seen.beam]
    return seen._replace(
        distance=np.clip(
            seen.distance + error, receiver.min_range, receiver.max_range
        )
    )


def _choose_echoes(
    pulses: _EchoTable, choice: Echoes, num_beams: int
) -> np.ndarray:
    """Returns the rows of the echoes to report, in the order of the beams."""

    def find_greatest(values: np.ndarray) -> np.ndarray:
        return _find_greatest(pulses.beam, pulses.number, values, num_beams)

    if choice == Echoes.FIRST:
        rows = find_greatest(-pulses.distance)
    elif choice == Echoes.LAST:
        rows = find_greatest(pulses.distance)
    else:
        rows = find_greatest(pulses.snr)
    if choice == Echoes.DUAL:
        # The second echo is the last one, or the second strongest if the last
        # is the strongest.
        rest = pulses.snr.copy()
        rest[rows[rows >= 0]] = -1.0
        second, last = find_greatest(rest), find_greatest(pulses.distance)
        second = np.where(last == rows, second, last)
        rows = np.stack([rows, np.where(second == rows, -1, second)], axis=1)
    return rows[rows >= 0]


@compiled
def _find_greatest(
    group: np.ndarray, number: np.ndarray, values: np.ndarray, num_groups: int
) -> np.ndarray:
    """Returns the row of each group's greatest value; -1 for an empty group.

    Among equal values, the value with the lowest `number` counts.
    """
    best = np.full(num_groups, -1)
    for row in range(len(group)):
        other = best[group[row]]
        if (
            other < 0
            or values[row] > values[other]
            or (values[row] == values[other] and number[row] < number[other])
        ):
            best[group[row]] = row
    return best


def _first_draw(pulses: _EchoTable) -> np.ndarray:
    """Returns the number of the first random draw of each echo."""
    number = np.minimum(pulses.number, _MOST_ECHOES)
    return _FIRST_ECHO_DRAW + _DRAWS_PER_ECHO * number


@lru_cache(maxsize=8)
def _response_table(response: Response) -> np.ndarray:
    """Returns the intensities of diffuse targets, at 4097 energies of the echo.

    The square roots of the energies are evenly spaced from 0 to 1. Intensities
    in between are interpolated.
    """
    root = np.linspace(0.0, 1.0, 4097)
    energy = np.maximum(root, 1e-6) ** 2
    return np.maximum(response.full + response.slope * log(energy), 0.0)


def _reported_intensity(
    pulses: _EchoTable, receiver: Receiver, key: np.uint64, gain: np.ndarray
) -> np.ndarray:
    """Returns the intensity that the unit reports, a whole number.

    Up to a reflectivity of 1 it follows the unit's response; above that, its
    scale is logarithmic.
    """
    unit, retro_from = receiver.sheet.response, receiver.sheet.retro_from
    rest = _FULL_INTENSITY - retro_from
    draw = _first_draw(pulses)
    energy = pulses.energy
    intensity = retro_from * energy
    is_above = energy > 1.0
    if unit.slope:
        root = np.sqrt(np.minimum(energy, 1.0))
        root *= np.minimum(unit.far / pulses.distance, 1.0)
        table = _response_table(unit)
        step = (root * (len(table) - 1) + 0.5).astype(np.int64)
        intensity = table[step]
    part = log(energy[is_above]) / math.log(_FULL_RETRO)
    intensity[is_above] = retro_from + rest * part
    if unit.speckle:
        speckle = normal(key, pulses.beam, draw + 2)
        # Most shots differ little from the mean; a few differ much.
        speckle *= speckle * speckle * (unit.speckle / math.sqrt(15.0))
        speckle += 1.0
        intensity *= speckle
    intensity[intensity < unit.floor] = 0.0
    intensity *= gain[pulses.beam]
    return np.rint(np.clip(intensity, 0.0, _FULL_INTENSITY))
