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
    HOPELESS_SNR,
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
        resolution: echoes nearer to each other are one [m].
        min_range, max_range: limits of reported ranges [m].
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
    axes: Light,
    others: Light,
    receiver: Receiver,
    key: np.uint64,
    num_beams: int,
) -> Reported:
    """Returns the reported points of the light.

    Light less than a pulse apart is one echo, whose distance is the mean by
    energy. An echo is detected by the probability of its SNR, and its distance
    has the standard deviation that belongs to that.

    Args:
        axes: light sorted by beam, at most one part for each.
        others: more light, sorted.
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
    count = _report(axes, others, receiver, key, num_beams, reported)
    return Reported(*(values[:count] for values in reported))


@compiled
def _report(
    axes: Light,
    others: Light,
    receiver: Receiver,
    key: np.uint64,
    num_beams: int,
    reported: Reported,
) -> int:
    """Fills in the reported points; returns their number."""
    echo = np.zeros((_MOST_ECHOES + _MOST_DROPS + 1, 3))
    source = np.zeros(len(echo), np.int32)
    # All parts of the light of one beam: distance and energy, and from where.
    most = _longest_run(others.beam) + 1
    light, origin = np.zeros((most, 2)), np.zeros(most, np.int32)
    table = receiver.scattering
    is_clear = len(table.distances) == 0
    is_fog = not is_clear and table.fog_energies[-1] > 0.0
    all_drops = 0.0 if is_clear else table.counts[-1]
    budget, extinction = receiver.budget, receiver.extinction
    min_range, max_range = receiver.min_range, receiver.max_range
    resolution, choice = receiver.resolution, receiver.choice
    retro_from = receiver.retro_from
    # As names of their own, fields are fast.
    axis_beam, other_beam = axes.beam, others.beam
    axis_distance, other_distance = axes.distance, others.distance
    axis_energy, other_energy = axes.energy, others.energy
    axis_geometry, other_geometry = axes.geometry, others.geometry
    to_beam, to_distance = reported.beam, reported.distance
    to_intensity, to_geometry = reported.intensity, reported.geometry
    count, axis, other = 0, 0, 0
    for beam in range(num_beams):
        first_axis, first_other = axis, other
        if axis < len(axis_beam) and axis_beam[axis] == beam:
            axis += 1
        while other < len(other_beam) and other_beam[other] == beam:
            other += 1
        is_alone = is_clear
        if not is_clear and not is_fog:
            # The first drop is beyond the farthest end of a beam.
            arrived = -np.log(1.0 - uniform(key, beam, _FIRST_DROP_DRAW))
            is_alone = arrived >= all_drops
        if is_alone and axis - first_axis + other - first_other <= 1:
            # Most beams have at most a single echo.
            if axis > first_axis:
                distance = axis_distance[first_axis]
                energy = axis_energy[first_axis]
                geometry = axis_geometry[first_axis]
            elif other > first_other:
                distance = other_distance[first_other]
                energy = other_energy[first_other]
                geometry = other_geometry[first_other]
            else:
                continue
            if not min_range <= distance <= max_range:
                continue
            snr = target_snr(budget, extinction, energy, distance)
            if not _is_detected(key, beam, _FIRST_ECHO_DRAW, snr):
                continue
            if extinction > 0.0:
                energy *= np.exp(-2.0 * extinction * distance)
            to_beam[count] = beam
            to_distance[count] = _measured(
                budget,
                min_range,
                max_range,
                key,
                beam,
                _FIRST_ECHO_DRAW,
                distance,
                snr,
            )
            to_intensity[count] = _intensity(retro_from, energy)
            to_geometry[count] = geometry
            count += 1
            continue
        number = 0
        while first_axis < axis or first_other < other:
            if first_axis < axis and (
                first_other == other
                or axis_distance[first_axis] <= other_distance[first_other]
            ):
                light[number, 0] = axis_distance[first_axis]
                light[number, 1] = axis_energy[first_axis]
                origin[number] = axis_geometry[first_axis]
                first_axis += 1
            else:
                light[number, 0] = other_distance[first_other]
                light[number, 1] = other_energy[first_other]
                origin[number] = other_geometry[first_other]
                first_other += 1
            number += 1
        size = _merge(
            light, origin, number, budget, extinction, resolution, echo, source
        )
        if not is_clear:
            size = _scatter(receiver, key, beam, echo, source, size)
        size = _detect(
            budget, min_range, max_range, key, beam, echo, source, size
        )
        if size == 0 and is_fog:
            # A unit reports the broad echo of fog only without any other.
            nearest = light[0, 0] if number > 0 else math.inf
            size = _add_fog(receiver, key, beam, nearest, echo)
            source[0] = SCATTERED
            size = _detect(
                budget, min_range, max_range, key, beam, echo, source, size
            )
        if size == 0:
            continue
        best, first, farthest = 0, 0, 0
        for i in range(1, size):
            if echo[i, 1] > echo[best, 1]:
                best = i
            if echo[i, 0] < echo[first, 0]:
                first = i
            if echo[i, 0] > echo[farthest, 0]:
                farthest = i
        if choice == _FIRST:
            best = first
        elif choice == _LAST:
            best = farthest
        to_beam[count] = beam
        to_distance[count] = echo[best, 0]
        to_intensity[count] = _intensity(retro_from, echo[best, 2])
        to_geometry[count] = source[best]
        count += 1
        if choice == _DUAL and size > 1:
            # The last one as well, or the second strongest if the last is the
            # strongest.
            second = farthest
            if second == best:
                second = 0 if best != 0 else 1
                for i in range(size):
                    if i != best and echo[i, 1] > echo[second, 1]:
                        second = i
            to_beam[count] = beam
            to_distance[count] = echo[second, 0]
            to_intensity[count] = _intensity(retro_from, echo[second, 2])
            to_geometry[count] = source[second]
            count += 1
    return count


@compiled
def _longest_run(numbers: np.ndarray) -> int:
    """Returns how many equal numbers follow each other at most."""
    longest, length = 0, 0
    for i in range(len(numbers)):
        length = length + 1 if i and numbers[i] == numbers[i - 1] else 1
        longest = max(longest, length)
    return longest


@compiled
def _merge(
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
            source[size] = origin[part]
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
    # Fog alone has no drops.
    if table.counts[-1] == 0.0:
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
    receiver: Receiver,
    key: np.uint64,
    beam: int,
    nearest: float,
    echo: np.ndarray,
) -> int:
    """Fills in the echo of fog, unless something is nearer; returns how many.

    Args:
        receiver, key, beam: see `report_echoes`.
        nearest: distance of the nearest light [m].
        echo: to fill.
    """
    table = receiver.scattering
    share = uniform(key, beam, _FIRST_DROP_DRAW + 2 * _MOST_DROPS)
    distance = interpolate(share, table.fog_counts, table.distances)
    if nearest < distance:
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
        draw = _FIRST_ECHO_DRAW + _DRAWS_PER_ECHO * min(i, _MOST_ECHOES)
        is_sure = echo[i, 2] > 0.0
        echo[i, 2] = 0.0
        if not is_sure and not _is_detected(key, beam, draw, snr):
            continue
        # Where a surface lies decides; an error of its range does not.
        if not min_range <= echo[i, 0] <= max_range:
            continue
        distance = _measured(
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
def _is_detected(key: np.uint64, beam: int, draw: int, snr: float) -> bool:
    if snr > CERTAIN_SNR:
        return True
    if snr < HOPELESS_SNR:
        return False
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
def _intensity(retro_from: float, energy: float) -> float:
    """Returns the calibrated reflectivity in the scale of the unit.

    It is a whole number: linear up to a reflectivity of 1, logarithmic above.
    """
    if energy <= 1.0:
        return np.rint(retro_from * energy)
    rest = _FULL_INTENSITY - retro_from
    part = np.log(energy) / np.log(_FULL_RETRO)
    return np.rint(min(retro_from + rest * part, _FULL_INTENSITY))
