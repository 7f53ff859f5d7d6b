"""Traffic of a drive that replays a SUMO trace: floating-car data.

Format: https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
import math
from pathlib import Path
import re
import zlib

import numpy as np

from cns_drake.traffic.ego_car import STEP, EgoBox, EgoPath, meetings_with_ego
from cns_drake.traffic.traffic_plan import (
    KINDS,
    WALKER_SIZE,
    Tracks,
    TrafficPlan,
    VehicleKind,
    gait_phases,
)
from evaluation.base import (
    Element,
    InputError,
    arctan2,
    cos,
    errors_at,
    read_elements,
    sin,
    step_lengths,
    value_errors,
    wrapped,
)

# A drive may take this much longer than the trace because of rounding [s].
_ROUNDING = 1e-6
# Kinds of cars from which a vehicle of unknown type is drawn.
_CARS = tuple(kind for kind in KINDS if kind.semantic_class == "car")
# Heights that differ by more than this belong to different roads [m].
_LEVEL_HEIGHT = 1.5
# A road user that has moved by less since its last place is on the same level
# [m].
_REACH = 6.0
# Greatest deviation of times from even spacing, because of rounding in the file
# [s].
_TIME_TOLERANCE = 2e-3
# A person this close to a vehicle's front is in the vehicle [m].
_RIDING = 0.1
# End of a word in the name of a type -> kind; the first that matches applies.
_KINDS_BY_WORD = (
    ("motorcycle", "motorcycle"),
    ("motorbike", "motorcycle"),
    ("moped", "motorcycle"),
    ("bicycle", "bicycle"),
    ("bike", "bicycle"),
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
# Greatest ratio between the distance by the places of a trace and the distance
# by its speeds, or its inverse. In metres the ratio is about 1, in degrees
# 1e-5, in feet 3.3.
_MOST_RATIO = 3.0
# Shorter distances by the speeds are not compared [m].
_COMPARED = 10.0
# In degrees, this ratio is less.
_DEGREES_RATIO = 1e-4
# Length of a degree on the Earth, at the most [m].
_DEGREE = 112e3
# A vehicle moves as it points if it moves by at least this much [m], in a bend
# of at least this radius [m].
_COURSE_FROM = 0.3
_STRAIGHT = 500.0

# A function that takes places (N, 2) [m], and whether it is about roads or all
# other ground. It returns all heights one above the other: (M,) the numbers of
# the places, and (M,) a height at each [m].
Levels = Callable[[np.ndarray, bool], tuple[np.ndarray, np.ndarray]]


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
        speed: (M,) speeds in the trace [m/s]; NaN without speeds.
    """

    name: str
    type_name: str
    steps: np.ndarray
    xy: np.ndarray
    yaw: np.ndarray
    slope: np.ndarray
    z: np.ndarray
    speed: np.ndarray


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


def read_fcd(
    path: Path, from_degrees: Callable[[], Callable[[np.ndarray], np.ndarray]]
) -> FcdTrace:
    """Reads a SUMO trace from a file.

    Args:
        path: the file.
        from_degrees: called if the places of the trace are in degrees; returns
            a function that takes longitudes and latitudes (N, 2) [deg], and
            returns places (N, 2) in W [m].

    Raises:
        InputError: the file cannot be read or is not a trace, or the trace is
            empty, has times that are not evenly spaced, or has places that are
            not in metres.
    """
    root = read_elements(path, "fcd-export")
    steps = list(root.all("timestep"))
    with value_errors(path):
        times = np.array([step.number("time") for step in steps])
        begin, dt = _sampling_times(path, times)
        vehicles = _traced_objects(steps, "vehicle")
        persons = _traced_objects(steps, "person")
        in_degrees = _is_in_degrees([*vehicles, *persons], dt)
        riding = _RIDING / _DEGREE if in_degrees else _RIDING
        left_out = {
            "persons, while they ride in vehicles": _remove_riders(
                steps, riding
            )
        }
        for tag, names in _other_elements(steps).items():
            left_out[f"elements {tag}"] = names
        persons = _traced_objects(steps, "person")
    if in_degrees:
        with errors_at(f"{path}: its places are longitudes and latitudes"):
            convert = from_degrees()
        vehicles, persons = _in_metres(convert, vehicles, persons)
    notes = [
        f"{path}: left out: {len(names)} {what}"
        for what, names in left_out.items()
        if names
    ]
    vehicles, jumps = _without_jumps(
        vehicles, [_kind_name(vehicle) for vehicle in vehicles], times
    )
    persons, others = _without_jumps(persons, ["person"] * len(persons), times)
    jumps += others
    if len(jumps) > _MOST_JUMPS:
        raise InputError(
            f"{path}: {len(jumps)} jumps from one timestep to the next, such as"
            f" that of {jumps[0]}; times must be in seconds, places in metres"
        )
    _check_unit(path, [*vehicles, *persons], dt)
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


def _is_in_degrees(objects: Sequence[TracedObject], dt: float) -> bool:
    """Returns whether the places of a trace are longitudes and latitudes.

    They then change by far less than its speeds say. `dt` is the time between
    two steps [s].
    """
    by_places, by_speeds = _ways(objects, dt)
    return (
        by_speeds > _COMPARED
        and by_places < _DEGREES_RATIO * by_speeds
        and all((np.abs(one.xy) <= (180.0, 90.0)).all() for one in objects)
    )


def _in_metres(
    convert: Callable[[np.ndarray], np.ndarray],
    vehicles: Sequence[TracedObject],
    persons: Sequence[TracedObject],
) -> tuple[tuple[TracedObject, ...], tuple[TracedObject, ...]]:
    """Returns vehicles and persons of a trace in degrees, in the frame W.

    SUMO's angles are from the north of its own projection. The angle from there
    to the north of W is found from vehicles that drive straight on.

    Args:
        convert: function that takes longitudes and latitudes (N, 2) [deg], and
            returns places (N, 2) [m].
        vehicles, persons: vehicles and persons, with places in degrees.
    """
    moved = [
        [replace(one, xy=convert(one.xy)) for one in some]
        for some in (vehicles, persons)
    ]
    turns = [np.zeros(0)]
    for one in moved[0]:
        x, y = np.diff(one.xy, axis=0).T
        moved_by, bend = np.hypot(x, y), np.abs(np.diff(one.yaw))
        known = (moved_by > _COURSE_FROM) & (bend < moved_by / _STRAIGHT)
        turns.append(wrapped(arctan2(y, x) - one.yaw[1:])[known])
    every = np.concatenate(turns)
    turn = float(np.median(every)) if len(every) else 0.0
    vehicles, persons = (
        tuple(replace(one, yaw=one.yaw + turn) for one in some)
        for some in moved
    )
    return vehicles, persons


def _remove_riders(steps: list[Element], within: float) -> set[str]:
    """Removes persons from the steps at which they ride in vehicles.

    SUMO writes a rider at the front of the vehicle. Newer versions also name
    the vehicle.

    Args:
        steps: the time steps of the trace, which are changed.
        within: greatest distance from the front, in the unit of places.

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
            if person.value("vehicle", "") or apart < within:
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
    """Returns the first of evenly spaced times, and their distance [s]."""
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
            slope = element.number("slope", 0.0)
            z, speed = (
                element.number(key) if key in element.attrib else np.nan
                for key in ("z", "speed")
            )
            rows.append((number, *place, slope, z, speed))
    objects = []
    for name, rows in found.items():
        number, x, y, angle, slope, z, speed = np.transpose(rows)
        # In the file, angles are in degrees, clockwise from north, where y is
        # north.
        yaw = np.unwrap(np.pi / 2 - np.radians(angle))
        at, xy = number.astype(int), np.column_stack([x, y])
        objects.append(
            TracedObject(
                name, types[name], at, xy, yaw, np.radians(slope), z, speed
            )
        )
    return tuple(objects)


def _check_unit(path: Path, objects: Sequence[TracedObject], dt: float) -> None:
    """Compares the places of a trace with its speeds, `dt` [s] apart."""
    by_places, by_speeds = _ways(objects, dt)
    if by_speeds < _COMPARED:
        return
    ratio = by_places / by_speeds
    if not 1.0 / _MOST_RATIO < ratio < _MOST_RATIO:
        raise InputError(
            f"{path}: the places are not in metres: the way of all road users"
            f" is {by_places:.3g} by their places, and {by_speeds:.3g} m by"
            " their speeds"
        )


def _ways(objects: Sequence[TracedObject], dt: float) -> tuple[float, float]:
    """Returns the way of all objects by their places, and by their speeds.

    The second is in metres, and the first in the unit of the places. `dt` is
    the time between two steps [s].
    """
    by_places = by_speeds = 0.0
    for one in objects:
        # The speed at a time is that of the step before.
        known = (np.diff(one.steps) == 1) & np.isfinite(one.speed[1:])
        by_places += float(step_lengths(one.xy)[known].sum())
        by_speeds += float(dt * np.abs(one.speed[1:][known]).sum())
    return by_places, by_speeds


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
                        for name in (
                            "steps",
                            "xy",
                            "yaw",
                            "slope",
                            "z",
                            "speed",
                        )
                    },
                )
            )
    return tuple(found), jumps


def _kind_name(vehicle: TracedObject) -> str:
    """Returns the name of a vehicle's kind; "" if its type does not state it.

    The result is one of `KINDS`.
    """
    for word, name in _KINDS_BY_WORD:
        # "vanLarge" and "minivans" are vans; "advanced" is none.
        if re.search(f"(?i:{word}(type|s)?)(?![a-z])", vehicle.type_name):
            return name
    text = vehicle.type_name.lower()
    return text if text in {kind.name for kind in KINDS} else ""


def play_trace(
    trace: FcdTrace,
    path: Path,
    levels: Levels,
    *,
    seed: int,
    duration: float,
    end: float,
    ego: EgoPath,
    ego_box: EgoBox,
) -> TrafficPlan:
    """Returns the traffic of a SUMO trace for a drive.

    The first time of the trace is the start of the drive. Road users are absent
    while they would overlap the ego car, because SUMO's simulation did not
    contain the ego car.

    Args:
        trace: the trace that SUMO wrote.
        path: file of the trace, for error messages.
        levels: heights of the map's ground, on which road users are.
        seed: seed by which the kinds of cars are sampled.
        duration: time of the last frame [s].
        end: time at which the ego car arrives [s].
        ego: motion of the ego car.
        ego_box: size of the ego car.

    Raises:
        InputError: the trace is shorter than the drive, or belongs to another
            map.
    """
    if trace.duration < duration - _ROUNDING:
        raise InputError(
            f"{path}: the trace has {trace.duration:g} s from {trace.begin:g} "
            f"s on, but the drive takes {duration:.2f} s: record more, or "
            "lower frames"
        )
    _check_place(trace, path, levels)
    kinds = [_vehicle_kind(vehicle, seed) for vehicle in trace.vehicles]
    trace = _at_map_heights(trace, levels)
    pairs = zip(trace.vehicles, kinds, strict=True)
    rows = [_vehicle_rows(*pair, levels) for pair in pairs]
    vehicles = _make_tracks(trace, trace.vehicles, rows)
    rows = [_person_rows(person, levels, trace.dt) for person in trace.persons]
    walkers = _make_tracks(trace, trace.persons, rows)
    step = min(trace.dt, STEP)
    times = np.arange(0.0, min(trace.duration, end) + step, step)
    notes = trace.notes
    apart, number = [], 0
    for tracks, sizes in (
        (vehicles, [kind.size for kind in kinds]),
        (walkers, [WALKER_SIZE] * len(trace.persons)),
    ):
        met = meetings_with_ego(tracks, sizes, times, ego, ego_box)
        apart.append(_absent_at(tracks, times, met))
        number += int(met.any(axis=0).sum())
    if number:
        notes += (f"traffic: {number} left out while they would meet the car",)
    return TrafficPlan(tuple(kinds), apart[0], apart[1], notes=notes)


def _absent_at(tracks: Tracks, times: np.ndarray, met: np.ndarray) -> Tracks:
    """Returns tracks without their bodies at some times.

    A body does not disappear during a revolution of a LiDAR, so it is absent
    from at least 0.1 s before to 0.1 s after.

    Args:
        tracks: the tracks of N bodies, which say when each is present.
        times: (K,) times [s].
        met: (K, N) which bodies are absent at each time.
    """
    assert tracks.present is not None
    present = tracks.present.copy()
    time, body = np.nonzero(met)
    margin = math.ceil(STEP / tracks.dt)
    for shift in range(1 - margin, margin + 1):
        step = (times[time] / tracks.dt).astype(int) + shift
        present[np.clip(step, 0, len(present) - 1), body] = False
    return Tracks(tracks.dt, tracks.values, present)


def _check_place(trace: FcdTrace, path: Path, levels: Levels) -> None:
    """Checks that a trace belongs to the map.

    If any vehicle is on a road, half of their places must be. Otherwise half of
    all places must be on the ground.
    """
    traced = trace.vehicles or trace.persons
    places = np.concatenate([road_user.xy for road_user in traced])
    there = np.isfinite(_heights(levels, places, of_road=True))
    ground = "roads"
    if not (trace.vehicles and there.any()):
        ground = "ground"
        there |= np.isfinite(_heights(levels, places, of_road=False))
    if there.mean() < 0.5:
        low, high = places.min(axis=0), places.max(axis=0)
        raise InputError(
            f"{path}: half of the trace is beside the map's {ground}: it is at"
            f" x {low[0]:.0f} to {high[0]:.0f}, y {low[1]:.0f} to"
            f" {high[1]:.0f} m; give a trace of this map, without an offset"
        )


def _heights(levels: Levels, xy: np.ndarray, *, of_road: bool) -> np.ndarray:
    """Returns the greatest heights (N,) at places (N, 2) [m]; NaN without one.

    Args:
        levels: heights of the ground.
        xy: the places [m].
        of_road: whether the heights are those of roads, or of other ground.
    """
    highest = np.full(len(xy), -np.inf)
    np.maximum.at(highest, *levels(xy, of_road))
    return np.where(np.isfinite(highest), highest, np.nan)


def _heights_along(
    levels: Levels, xy: np.ndarray, z: np.ndarray, *, on_road: bool
) -> np.ndarray:
    """Returns the heights (M,) of one road user at successive places [m].

    Where two roads cross at different heights, the road user is on the road
    that is nearest to its given height. Without given heights, the road user
    stays at the height at which it arrived, or else is on the upper road.
    Beside the map's ground, it stays at the nearest known height.

    Args:
        levels: heights of the ground.
        xy: (M, 2) places [m].
        z: (M,) approximate heights [m]; NaN if they are unknown.
        on_road: whether other ground than roads counts only where no road is.
    """
    of_road, other = (levels(xy, kind) for kind in (True, False))
    if on_road:
        beside = ~np.isin(other[0], of_road[0])
        other = other[0][beside], other[1][beside]
    place = np.concatenate([of_road[0], other[0]])
    height = np.concatenate([of_road[1], other[1]])
    order = np.argsort(place, kind="stable")
    ends = np.searchsorted(place[order], np.arange(len(xy) + 1))
    found = np.full(len(xy), np.nan)
    for k in range(len(xy)):
        here = height[order[ends[k] : ends[k + 1]]]
        if not len(here):
            continue
        goal = here.max()
        if np.isfinite(z[k]):
            goal = z[k]
        elif k and np.hypot(*(xy[k] - xy[k - 1])) < _REACH:
            goal = found[k - 1] if np.isfinite(found[k - 1]) else goal
        level = here[np.abs(here - goal).argmin()]
        found[k] = here[here < level + _LEVEL_HEIGHT].max()
    known = np.flatnonzero(np.isfinite(found))
    if not len(known):
        return np.nan_to_num(z)
    return np.interp(np.arange(len(xy)), known, found[known])


def _at_map_heights(trace: FcdTrace, levels: Levels) -> FcdTrace:
    """Returns a trace whose heights have the same zero as the map's heights.

    A trace without heights stays as it is.
    """
    with_heights = [
        vehicle for vehicle in trace.vehicles if np.isfinite(vehicle.z).all()
    ]
    if not with_heights:
        return trace
    z = np.concatenate([vehicle.z for vehicle in with_heights])
    xy = np.concatenate([vehicle.xy for vehicle in with_heights])
    off = _heights(levels, xy, of_road=True) - z
    zero = float(np.nanmedian(off)) if np.isfinite(off).any() else 0.0
    vehicles, persons = (
        tuple(replace(road_user, z=road_user.z + zero) for road_user in traced)
        for traced in (trace.vehicles, trace.persons)
    )
    return replace(trace, vehicles=vehicles, persons=persons)


def _vehicle_kind(vehicle: TracedObject, seed: int) -> VehicleKind:
    """Returns the kind of a vehicle: from its type, or else a random car."""
    name = _kind_name(vehicle)
    for kind in KINDS:
        if kind.name == name:
            return kind
    rng = np.random.default_rng([seed, zlib.crc32(vehicle.name.encode())])
    return _CARS[int(rng.integers(len(_CARS)))]


def _vehicle_rows(
    vehicle: TracedObject, kind: VehicleKind, levels: Levels
) -> np.ndarray:
    """Returns the coordinates (M, 5) of a vehicle; see `TrafficPlan`.

    Args:
        vehicle: the vehicle, with its place at M steps.
        levels: heights of the ground.
    """
    ahead = np.column_stack([cos(vehicle.yaw), sin(vehicle.yaw)])
    xy = vehicle.xy - kind.size[0] / 2 * ahead
    # An upward slope is a rotation about -y.
    z = _heights_along(levels, xy, vehicle.z, on_road=True)
    return np.column_stack([xy, z, vehicle.yaw, -vehicle.slope])


def _person_rows(person: TracedObject, levels: Levels, dt: float) -> np.ndarray:
    """Returns the coordinates (M, 5) of a pedestrian; see `TrafficPlan`.

    Args:
        person: the pedestrian, with its place at M steps.
        levels: heights of the ground.
        dt: time between two steps [s].
    """
    # A random phase that depends only on the name.
    start = zlib.crc32(person.name.encode()) % 1000 * 2e-3 * np.pi
    phase = start + gait_phases(person.xy, dt)
    z = _heights_along(levels, person.xy, person.z, on_road=False)
    return np.column_stack([person.xy, z, person.yaw, phase])


def _make_tracks(
    trace: FcdTrace,
    traced: Sequence[TracedObject],
    rows: Sequence[np.ndarray],
) -> Tracks:
    """Returns tracks of objects, each of which exists at some times only.

    Args:
        traced: the objects, with the numbers of their M steps.
        rows: coordinates (M, 5) of each object.
    """
    values = np.zeros((trace.num_steps, len(traced), 5))
    present = np.zeros((trace.num_steps, len(traced)), bool)
    times = np.arange(trace.num_steps)
    for k, (road_user, own) in enumerate(zip(traced, rows, strict=True)):
        # It already moves when it appears and disappears, for a LiDAR that is
        # turning then.
        steps = np.concatenate(
            [road_user.steps[:1] - 1, road_user.steps, road_user.steps[-1:] + 1]
        )
        own = np.concatenate([own[:1], own, own[-1:]])
        if len(road_user.steps) > 1:
            own[[0, -1]] += own[[1, -2]] - own[[2, -3]]
        values[:, k] = np.transpose(
            [np.interp(times, steps, column) for column in own.T]
        )
        present[road_user.steps, k] = True
    return Tracks(trace.dt, values, present)
