"""Makes a unit's reported points from the returning light of each beam."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.echo_choice import Echoes
from cns_drake.sensors.returns.echo_detection import (
    FIRST_ECHO_DRAW,
    MOST_ECHOES,
    detect,
    is_detected,
    measured_range,
    merge,
    reported_intensity,
)
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.link_budget import (
    LinkBudget,
    echo_energy,
    target_snr,
)
from cns_drake.sensors.returns.weather import Scattering
from cns_drake.sensors.returns.weather_echoes import (
    MOST_DROPS,
    SCATTERED,
    add_drops,
    first_drop,
    fog_echo,
)

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
    echo = np.zeros((MOST_ECHOES + MOST_DROPS + 1, 3))
    source = np.zeros(len(echo), np.int32)
    # All parts of the light of one beam: distance and energy, and from where.
    most = _longest_run(others.beam) + 1
    light, origin = np.zeros((most, 2)), np.zeros(most, np.int32)
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
    distances, counts, energies, fog_energies, fog_counts = receiver.scattering
    is_clear = len(distances) == 0
    is_fog = not is_clear and fog_energies[-1] > 0.0
    all_drops = 0.0 if is_clear else counts[-1]
    count, axis, other = 0, 0, 0
    for beam in range(num_beams):
        first_axis, first_other = axis, other
        if axis < len(axis_beam) and axis_beam[axis] == beam:
            axis += 1
        while other < len(other_beam) and other_beam[other] == beam:
            other += 1
        number = axis - first_axis + other - first_other
        # Most beams have at most a single echo: the first drop is beyond the
        # farthest end of a beam.
        if number <= 1 and (
            all_drops == 0.0 or first_drop(key, beam) >= all_drops
        ):
            near, energy, geometry = math.inf, 0.0, SCATTERED
            if axis > first_axis:
                near = axis_distance[first_axis]
                energy = axis_energy[first_axis]
                geometry = axis_geometry[first_axis]
            elif other > first_other:
                near = other_distance[first_other]
                energy = other_energy[first_other]
                geometry = other_geometry[first_other]
            elif not is_fog:
                continue
            snr = target_snr(budget, extinction, energy, near)
            distance = near
            if is_fog:
                # Rounded like the mean of several parts.
                distance = snr * near / snr if snr > 0.0 else 0.0
            is_seen = min_range <= distance <= max_range and is_detected(
                key, beam, FIRST_ECHO_DRAW, snr
            )
            if is_fog and not is_seen:
                # A unit reports the broad echo of fog only without any other.
                distance, snr = fog_echo(
                    budget,
                    extinction,
                    distances,
                    fog_energies,
                    fog_counts,
                    key,
                    beam,
                )
                geometry = SCATTERED
                is_seen = (
                    distance <= near
                    and min_range <= distance <= max_range
                    and is_detected(key, beam, FIRST_ECHO_DRAW, snr)
                )
            if not is_seen:
                continue
            if is_fog:
                energy = echo_energy(budget, snr, distance)
            elif extinction > 0.0:
                energy *= np.exp(-2.0 * extinction * distance)
            to_beam[count] = beam
            to_distance[count] = measured_range(
                budget,
                min_range,
                max_range,
                key,
                beam,
                FIRST_ECHO_DRAW,
                distance,
                snr,
            )
            to_intensity[count] = reported_intensity(retro_from, energy)
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
        size = merge(
            light, origin, number, budget, extinction, resolution, echo, source
        )
        if not is_clear:
            size = add_drops(
                budget,
                extinction,
                max_range,
                distances,
                counts,
                energies,
                key,
                beam,
                echo,
                source,
                size,
            )
        size = detect(
            budget, min_range, max_range, key, beam, echo, source, size
        )
        if size == 0 and is_fog:
            distance, snr = fog_echo(
                budget,
                extinction,
                distances,
                fog_energies,
                fog_counts,
                key,
                beam,
            )
            if number == 0 or distance <= light[0, 0]:
                echo[0, 0], echo[0, 1], echo[0, 2] = distance, snr, 0.0
                source[0] = SCATTERED
                size = detect(
                    budget, min_range, max_range, key, beam, echo, source, 1
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
        to_intensity[count] = reported_intensity(retro_from, echo[best, 2])
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
            to_intensity[count] = reported_intensity(
                retro_from, echo[second, 2]
            )
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
