"""Reads a SUMO trace: floating-car data at even times.

Format: https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from cns_drake.base import (
    Element,
    InputError,
    read_elements,
    step_lengths,
    value_errors,
)
from cns_drake.traffic.vehicle_kinds import KINDS

# Greatest deviation of times from even spacing, because of rounding in the file
# [s].
_TIME_TOLERANCE = 2e-3
# A person this close to a vehicle's front is in the vehicle [m].
_RIDING = 0.1
# Part of the name of a type -> kind; the first one that matches applies.
_KINDS_BY_WORD = (
    ("bicycle", "bicycle"),
    ("bike", "bicycle"),
    ("motorcycle", "motorcycle"),
    ("moped", "motorcycle"),
    ("bus", "bus"),
    ("coach", "bus"),
    ("truck", "box_truck"),
    ("trailer", "box_truck"),
    ("van", "van"),
    ("delivery", "van"),
)
# No vehicle or person is faster [m/s]. A faster body was moved by SUMO, which
# teleports a vehicle that has waited for too long.
_FASTEST = 80.0
_FASTEST_OF = {"bicycle": 20.0, "person": 12.0}
# A trace with more jumps has other units. Each would need a track of its own.
_MOST_JUMPS = 1000


@dataclass(frozen=True)
class TracedObject:
    """A vehicle or a person in a trace.

    Attributes:
        name: id of the object.
        type_name: type of the object; "" if the trace has no types.
        steps: (M,) numbers of the time steps at which the object exists,
            ascending.
        xy: (M, 2) position of a vehicle's front, or of a person's middle [m].
        yaw: (M,) heading, from x towards y [rad].
        slope: (M,) slope of the road, positive upwards [rad].
        z: (M,) heights in the trace [m]; NaN without heights.
    """

    name: str
    type_name: str
    steps: np.ndarray
    xy: np.ndarray
    yaw: np.ndarray
    slope: np.ndarray
    z: np.ndarray


@dataclass(frozen=True)
class FcdTrace:
    """A trace of SUMO with evenly spaced times.

    Attributes:
        begin: the first time [s].
        dt: time between two entries [s].
        num_steps: number of times.
        vehicles, persons: the vehicles and the persons of the trace, each in
            the order in which they appear.
        notes: notes for the user on what is left out.
    """

    begin: float
    dt: float
    num_steps: int
    vehicles: tuple[TracedObject, ...]
    persons: tuple[TracedObject, ...]
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Time from the first to the last entry [s]."""
        return self.dt * (self.num_steps - 1)


def read_fcd(path: Path) -> FcdTrace:
    """Reads a SUMO trace from a file.

    Raises:
        InputError: the file cannot be read or is not a trace, or the trace is
            empty or has times that are not evenly spaced.
    """
    root = read_elements(path, "fcd-export")
    steps = list(root.all("timestep"))
    with value_errors(path):
        times = np.array([step.number("time") for step in steps])
        begin, dt = _sampling_times(path, times)
        vehicles = _traced_objects(steps, "vehicle")
        left_out = {
            "persons, while they ride in vehicles": _remove_riders(steps)
        }
        for tag, names in _other_elements(steps).items():
            left_out[f"elements {tag}"] = names
        persons = _traced_objects(steps, "person")
    notes = [
        f"{path}: left out: {len(names)} {what}"
        for what, names in left_out.items()
        if names
    ]
    vehicles, jumps = _without_jumps(
        vehicles, [kind_name(vehicle) for vehicle in vehicles], times
    )
    persons, others = _without_jumps(persons, ["person"] * len(persons), times)
    jumps += others
    if len(jumps) > _MOST_JUMPS:
        raise InputError(
            f"{path}: {len(jumps)} jumps from one timestep to the next, such as"
            f" that of {jumps[0]}; times must be in seconds, places in metres"
        )
    if jumps:
        notes.append(
            f"{path}: left out: {len(jumps)} jumps from one timestep to the"
            f" next, such as that of {jumps[0]}"
        )
    if not vehicles and not persons:
        raise InputError(
            f"{path}: the trace has no vehicle and no person in any timestep"
        )
    return FcdTrace(begin, dt, len(times), vehicles, persons, tuple(notes))


def _remove_riders(steps: list[Element]) -> set[str]:
    """Removes persons from the steps at which they ride in vehicles.

    SUMO writes a rider at the front of the vehicle. Newer versions also name
    the vehicle.

    Returns:
        The ids of all removed persons.

    Raises:
        ValueError: an object lacks a value.
    """
    riders = set()
    for step in steps:
        fronts = {
            (vehicle.number("x"), vehicle.number("y"))
            for vehicle in step.all("vehicle")
        }
        places = np.reshape(list(fronts), (-1, 2))
        for person in list(step.all("person")):
            away = places - (person.number("x"), person.number("y"))
            apart = np.hypot(*away.T).min(initial=np.inf)
            if person.value("vehicle", "") or apart < _RIDING:
                riders.add(person.value("id"))
                step.remove(person)
    return riders


def _other_elements(steps: list[Element]) -> dict[str, set[str]]:
    """Returns the ids of all elements but vehicles and persons, by tag.

    The id of an element without an id is "".
    """
    found: dict[str, set[str]] = {}
    for step in steps:
        for element in step.all("*"):
            if element.tag not in ("vehicle", "person"):
                found.setdefault(element.tag, set()).add(
                    element.value("id", "")
                )
    return dict(sorted(found.items()))


def _sampling_times(path: Path, times: np.ndarray) -> tuple[float, float]:
    """Returns the first of evenly spaced times, and their distance [s].

    Raises:
        InputError: they are not evenly spaced.
    """
    if len(times) < 2:
        raise InputError(
            f"{path}: {len(times)} timesteps are too few; at least two are "
            "needed"
        )
    dt = (times[-1] - times[0]) / (len(times) - 1)
    expected = times[0] + dt * np.arange(len(times))
    wrong = np.abs(times - expected) > _TIME_TOLERANCE
    if dt <= _TIME_TOLERANCE or wrong.any():
        where = times[int(wrong.argmax())]
        raise InputError(
            f"{path}: timestep {where:g}: times are not even; record every "
            "step of SUMO, without --fcd-output.skip or device.fcd.period"
        )
    return float(times[0]), float(dt)


def _traced_objects(steps: list[Element], tag: str) -> tuple[TracedObject, ...]:
    """Returns the vehicles or persons, by the tag of their elements.

    Raises:
        ValueError: an object lacks a value, or occurs twice at the same time.
    """
    found: dict[str, list[tuple[float, ...]]] = {}
    types: dict[str, str] = {}
    for number, step in enumerate(steps):
        for element in step.all(tag):
            name = element.value("id")
            rows = found.setdefault(name, [])
            if rows and rows[-1][0] == number:
                raise ValueError(
                    f"line {element.line}: {tag} {name[:40]!r} is there twice"
                )
            types.setdefault(name, element.value("type", ""))
            place = [element.number(key) for key in ("x", "y", "angle")]
            z = element.number("z") if "z" in element.attrib else np.nan
            rows.append((number, *place, element.number("slope", 0.0), z))
    objects = []
    for name, rows in found.items():
        number, x, y, angle, slope, z = np.transpose(rows)
        # In the file, angles are in degrees, clockwise from north, where y is
        # north.
        yaw = np.unwrap(np.pi / 2 - np.radians(angle))
        at, xy = number.astype(int), np.column_stack([x, y])
        objects.append(
            TracedObject(name, types[name], at, xy, yaw, np.radians(slope), z)
        )
    return tuple(objects)


def _without_jumps(
    objects: Sequence[TracedObject],
    kinds: Sequence[str],
    times: np.ndarray,
) -> tuple[tuple[TracedObject, ...], list[str]]:
    """Returns objects without the steps that are too fast for their kind.

    An object that jumps ends before the jump, and another object of the same
    name begins after the jump.

    Args:
        objects: vehicles or persons.
        kinds: kind of each object.
        times: times of the trace [s].

    Returns:
        The objects, and a text on each jump.
    """
    found = []
    jumps: list[str] = []
    for traced, kind in zip(objects, kinds, strict=True):
        steps = np.diff(traced.steps)
        speeds = step_lengths(traced.xy) / np.diff(times[traced.steps])
        is_jump = (steps == 1) & (speeds > _FASTEST_OF.get(kind, _FASTEST))
        ends = np.flatnonzero(is_jump) + 1
        jumps += [
            f"{traced.name[:40]!r} at {times[traced.steps[k]]:g} s, by"
            f" {speeds[k - 1]:.0f} m/s"
            for k in ends
        ]
        for begin, end in pairwise([0, *ends, len(traced.steps)]):
            part = slice(begin, end)
            found.append(
                replace(
                    traced,
                    **{
                        name: getattr(traced, name)[part]
                        for name in ("steps", "xy", "yaw", "slope", "z")
                    },
                )
            )
    return tuple(found), jumps


def kind_name(vehicle: TracedObject) -> str:
    """Returns the name of a vehicle's kind; "" if its type does not state it.

    The result is one of `KINDS`.
    """
    text = vehicle.type_name.lower().replace("default_biketype", "bicycle")
    for word, name in _KINDS_BY_WORD:
        if word in text:
            return name
    return text if text in {kind.name for kind in KINDS} else ""
