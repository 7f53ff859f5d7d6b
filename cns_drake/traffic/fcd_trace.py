"""Floating-car data of SUMO: places of road users at even times.

Format: https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.xml_elements import Element, read_elements

_TAGS = ("fcd-export", "timestep", "vehicle", "person")
# Greatest deviation from even times, by rounding in the file [s].
_TIME_TOLERANCE = 2e-3


@dataclass(frozen=True)
class TracedObject:
    """A vehicle or a person of a trace.

    Attributes:
        name: its id.
        type_name: of its type, "" if it has none.
        steps: (M,) numbers of the times at which it is there, ascending.
        xy: (M, 2) of a vehicle's front, or of a person's middle [m].
        yaw: (M,) heading, from x towards y [rad].
        slope: (M,) of the road, upwards positive [rad].
    """

    name: str
    type_name: str
    steps: np.ndarray
    xy: np.ndarray
    yaw: np.ndarray
    slope: np.ndarray


@dataclass(frozen=True)
class FcdTrace:
    """A trace of K times.

    Attributes:
        begin: the first time [s].
        dt: between two times [s].
        num_steps: K.
        vehicles, persons: in the order in which they come.
    """

    begin: float
    dt: float
    num_steps: int
    vehicles: tuple[TracedObject, ...]
    persons: tuple[TracedObject, ...]

    @property
    def duration(self) -> float:
        """From the first to the last time [s]."""
        return self.dt * (self.num_steps - 1)


def read_fcd(path: Path) -> FcdTrace:
    """Reads a trace.

    Raises:
        InputError: the file cannot be read or is not a trace, its times are not
            even, or it is empty.
    """
    root = read_elements(path, "fcd-export", _TAGS)
    steps = list(root.all("timestep"))
    try:
        times = np.array([step.number("time") for step in steps])
        begin, dt = _even(path, times)
        vehicles = _objects(steps, "vehicle")
        persons = _objects(steps, "person")
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    if not vehicles and not persons:
        raise InputError(
            f"{path}: the trace has no vehicle and no person in any timestep"
        )
    return FcdTrace(begin, dt, len(times), vehicles, persons)


def _even(path: Path, times: np.ndarray) -> tuple[float, float]:
    """Returns the first time and the distance of the times.

    Raises:
        InputError: they are not even.
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


def _objects(steps: list[Element], tag: str) -> tuple[TracedObject, ...]:
    """Returns the vehicles or persons.

    Raises:
        ValueError: one lacks a value, or is there twice at a time.
    """
    found: dict[str, list[tuple[float, ...]]] = {}
    types: dict[str, str] = {}
    for number, step in enumerate(steps):
        for one in step.all(tag):
            name = one.text("id")
            rows = found.setdefault(name, [])
            if rows and rows[-1][0] == number:
                raise ValueError(
                    f"line {one.line}: {tag} {name[:40]!r} is there twice"
                )
            types.setdefault(name, one.text("type", ""))
            rows.append(
                (
                    number,
                    one.number("x"),
                    one.number("y"),
                    one.number("angle"),
                    one.number("slope", 0.0),
                )
            )
    return tuple(
        _object(name, types[name], np.array(rows))
        for name, rows in found.items()
    )


def _object(name: str, type_name: str, rows: np.ndarray) -> TracedObject:
    # Angles are degrees from north, clockwise; y is north.
    yaw = np.pi / 2 - np.radians(rows[:, 3])
    return TracedObject(
        name,
        type_name,
        rows[:, 0].astype(int),
        rows[:, 1:3],
        np.unwrap(yaw),
        np.radians(rows[:, 4]),
    )
