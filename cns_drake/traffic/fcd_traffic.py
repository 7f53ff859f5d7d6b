"""Traffic of a trace of SUMO: floating-car data at even times.

Format: https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import zlib

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base.elementary import cos, sin
from cns_drake.base.errors import InputError
from cns_drake.base.xml_elements import Element, read_elements
from cns_drake.traffic.lane_graph import LaneGraph, Walkway
from cns_drake.traffic.overlaps import find_overlaps
from cns_drake.traffic.streets import EgoBox
from cns_drake.traffic.traffic_plan import EgoPath, Tracks, TrafficPlan
from cns_drake.traffic.vehicle_kinds import KINDS, VehicleKind
from cns_drake.traffic.walkers import WALKER_LENGTH, WALKER_WIDTH, gait_rate

# Greatest deviation from even times, by rounding in the file [s].
_TIME_TOLERANCE = 2e-3
# Half of the vehicles of a map's own trace are nearer to its lanes [m].
_OFF_ROAD = 5.0
# Part of the name of a type -> kind; the first that fits counts.
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
_CARS = tuple(kind for kind in KINDS if kind.semantic_class == "car")


@dataclass(frozen=True)
class TracedObject:
    """A vehicle or a person of a trace, its type "" if it has none.

    Attributes:
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
    """A trace of `num_steps` times: the first [s], and their distance [s].

    Vehicles and persons are in the order in which they come.
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
    root = read_elements(path, "fcd-export")
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
            name = one.value("id")
            rows = found.setdefault(name, [])
            if rows and rows[-1][0] == number:
                raise ValueError(
                    f"line {one.line}: {tag} {name[:40]!r} is there twice"
                )
            types.setdefault(name, one.value("type", ""))
            place = [one.number(key) for key in ("x", "y", "angle")]
            rows.append((number, *place, one.number("slope", 0.0)))
    objects = []
    for name, rows in found.items():
        number, x, y, angle, slope = np.transpose(rows)
        # Angles are degrees from north, clockwise; y is north.
        yaw = np.unwrap(np.pi / 2 - np.radians(angle))
        at, xy = number.astype(int), np.column_stack([x, y])
        objects.append(
            TracedObject(name, types[name], at, xy, yaw, np.radians(slope))
        )
    return tuple(objects)


def play_trace(
    trace: FcdTrace,
    path: Path,
    graph: LaneGraph,
    walkways: Sequence[Walkway],
    *,
    seed: int,
    duration: float,
    end: float,
    ego: EgoPath,
    ego_box: EgoBox,
) -> TrafficPlan:
    """Returns the traffic of a trace, whose first time is that of the drive.

    Road users that would collide with the ego car, which is not part of SUMO's
    simulation, are left out. Errors name the trace's path, the map's graph and
    walkways give heights, and the seed is that of the kinds of cars. The last
    frame is at `duration` [s], and the ego car arrives at `end` [s].

    Raises:
        InputError: the trace is shorter than the drive, or is of another map.
    """
    if trace.duration < duration - 1e-6:
        raise InputError(
            f"{path}: the trace has {trace.duration:g} s from {trace.begin:g} "
            f"s on, but the drive takes {duration:.2f} s: record more, or "
            "lower frames"
        )
    lanes = np.concatenate([piece.points for piece in graph.pieces])
    _check_place(trace, path, lanes)
    kinds = [_kind(one, seed) for one in trace.vehicles]
    heights = _Heights(lanes)
    pairs = zip(trace.vehicles, kinds, strict=True)
    rows = [_vehicle_rows(*pair, heights) for pair in pairs]
    vehicles = _make_tracks(trace, trace.vehicles, rows)
    strips = [walkway.points for walkway in walkways]
    heights = _Heights(np.concatenate([lanes, *strips]))
    rows = [_person_rows(one, heights, trace.dt) for one in trace.persons]
    walkers = _make_tracks(trace, trace.persons, rows)
    half = [(kind.size[0] / 2, kind.size[1] / 2) for kind in kinds]
    # Steps are short enough to notice all that cross the car's way.
    step = min(trace.dt, 0.1)
    times = np.arange(0.0, min(trace.duration, end) + step, step)
    kept = ~_meet_ego(vehicles, half, times, ego, ego_box)
    half = [(WALKER_LENGTH / 2, WALKER_WIDTH / 2)] * len(trace.persons)
    kept_walkers = ~_meet_ego(walkers, half, times, ego, ego_box)
    return TrafficPlan(
        tuple(kind for kind, one in zip(kinds, kept, strict=True) if one),
        vehicles.select(kept),
        walkers.select(kept_walkers),
        int((~kept).sum() + (~kept_walkers).sum()),
    )


def _check_place(trace: FcdTrace, path: Path, lanes: np.ndarray) -> None:
    """Checks that vehicles are on lanes, or persons near them.

    Raises:
        InputError: they are not.
    """
    traced = trace.vehicles or trace.persons
    places = np.concatenate([one.xy for one in traced])
    distances, _ = cKDTree(lanes[:, :2]).query(places)
    off_road = _OFF_ROAD if trace.vehicles else 10.0 * _OFF_ROAD
    if np.median(distances) > off_road:
        raise InputError(
            f"{path}: half of the trace is more than {off_road:g} m from the "
            f"map's lanes: the trace is at {_extent(places)}, the lanes are "
            f"at {_extent(lanes)}; give a trace of this map, without an offset"
        )


def _extent(places: np.ndarray) -> str:
    low, high = places.min(axis=0), places.max(axis=0)
    return f"x {low[0]:.0f} to {high[0]:.0f}, y {low[1]:.0f} to {high[1]:.0f} m"


class _Heights:
    """Heights of the ground at places."""

    def __init__(self, points: np.ndarray):
        """Takes (N, 3) points on the ground [m]."""
        self._tree = cKDTree(points[:, :2])
        self._z = points[:, 2]

    def at(self, xy: np.ndarray) -> np.ndarray:
        """Returns the heights of the nearest points, weighted by distance."""
        distance, near = self._tree.query(xy, k=min(4, len(self._z)))
        distance, near = (
            np.reshape(values, (len(xy), -1)) for values in (distance, near)
        )
        weight = 1.0 / np.maximum(distance, 0.05) ** 2
        return np.sum(weight * self._z[near], axis=1) / weight.sum(axis=1)


def _kind(one: TracedObject, seed: int) -> VehicleKind:
    """Returns the kind of a vehicle: by its type, or else a random car."""
    text = one.type_name.lower().replace("default_biketype", "bicycle")
    for word, name in _KINDS_BY_WORD:
        if word in text:
            return next(kind for kind in KINDS if kind.name == name)
    for kind in KINDS:
        if kind.name == text:
            return kind
    rng = np.random.default_rng([seed, zlib.crc32(one.name.encode())])
    return _CARS[int(rng.integers(len(_CARS)))]


def _vehicle_rows(
    one: TracedObject, kind: VehicleKind, heights: _Heights
) -> np.ndarray:
    """Returns the (M, 5) coordinates of a vehicle; see `TrafficPlan`."""
    ahead = np.column_stack([cos(one.yaw), sin(one.yaw)])
    xy = one.xy - kind.size[0] / 2 * ahead
    # An upward slope turns about -y.
    return np.column_stack([xy, heights.at(xy), one.yaw, -one.slope])


def _person_rows(one: TracedObject, heights: _Heights, dt: float) -> np.ndarray:
    """Returns the (M, 5) coordinates of a walker; see `TrafficPlan`."""
    steps = np.linalg.norm(np.diff(one.xy, axis=0), axis=1)
    turned = dt * gait_rate(steps / dt)
    start = zlib.crc32(one.name.encode()) % 1000 * 2e-3 * np.pi
    phase = start + np.concatenate([[0.0], np.cumsum(turned)])
    return np.column_stack([one.xy, heights.at(one.xy), one.yaw, phase])


def _make_tracks(
    trace: FcdTrace, traced: Sequence[TracedObject], rows: Sequence[np.ndarray]
) -> Tracks:
    """Returns tracks of objects that are there at some of the times."""
    values = np.zeros((trace.num_steps, len(traced), 5))
    present = np.zeros((trace.num_steps, len(traced)), bool)
    times = np.arange(trace.num_steps)
    for k, (one, own) in enumerate(zip(traced, rows, strict=True)):
        # It comes and goes in motion, for a LiDAR that is turning then.
        steps = np.concatenate(
            [one.steps[:1] - 1, one.steps, one.steps[-1:] + 1]
        )
        own = np.concatenate([own[:1], own, own[-1:]])
        if len(one.steps) > 1:
            own[[0, -1]] += own[[1, -2]] - own[[2, -3]]
        values[:, k] = np.transpose(
            [np.interp(times, steps, column) for column in own.T]
        )
        present[one.steps, k] = True
    return Tracks(trace.dt, values, present)


def _meet_ego(
    tracks: Tracks,
    half: Sequence[tuple[float, float]],
    times: np.ndarray,
    ego: EgoPath,
    box: EgoBox,
) -> np.ndarray:
    """Returns (N,) whether each overlaps the ego car at any of the times."""
    num = len(half)
    poses = np.full((len(times), 1 + num, 3), np.nan)
    poses[:, 0] = box.middles(*ego(times))
    for k, time in enumerate(times):
        there = np.flatnonzero(tracks.is_present(time))
        values, _ = tracks.at(time)
        poses[k, 1 + there] = values[there][:, [0, 1, 3]]
    halves = np.array([box.half_size, *half])
    found = np.zeros((1 + num, 1 + num), bool)
    find_overlaps(poses, halves, found)
    return found[0, 1:]
