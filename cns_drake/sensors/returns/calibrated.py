"""The returns of a LiDAR, modelled by its data sheet, in any weather."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cns_drake.ray_casting import RayCastingScene, SceneHits, rotate
from cns_drake.scene import PerceptionGeometry
from cns_drake.sensors.lidar.beams import BeamPattern, Beams
from cns_drake.sensors.lidar.measurement import Echoes
from cns_drake.sensors.noise_draws import check_seed
from cns_drake.sensors.returns.echoes import Receiver, Reported, report_echoes
from cns_drake.sensors.returns.footprint import correct_side_hits, find_sides
from cns_drake.sensors.returns.light import BeamHits, Shots
from cns_drake.sensors.returns.link_budget import fit_link_budget
from cns_drake.sensors.returns.materials import Materials, find_materials
from cns_drake.sensors.returns.propagation import follow, start_ways
from cns_drake.sensors.returns.random_numbers import frame_key, normal, uniform
from cns_drake.sensors.returns.surface_texture import with_texture
from cns_drake.sensors.returns.tables import join
from cns_drake.sensors.returns.weather import Weather, tabulate_scattering
from evaluation.base import arcsin, arctan2, check_fields, cos, sin
from evaluation.lidar_sheets import ReturnsSheet, find_sheet
from worlds.shapes import StructureTable

CLEAR = Weather()


class _UnitBeams:
    """The N beams of a revolution, with the errors of their lasers.

    The arrays `reported`, `p_SLset`, `range_error` and `gain` are in the order
    in which the beams fire. All other attributes refer to the order in which
    rays are cast (`packet_order` of the `Beams`).

    Attributes:
        d_Sset: (N, 3) true unit directions of the beams in S.
        height: (N,) height of each beam's laser above the origin of S [m].
        blocks: for each run of consecutive beams with the same laser height,
            this height and a slice that selects the beams.
        reported: (N, 3) unit directions in S that the unit reports.
        p_SLset: (N, 3) position of each beam's laser in S [m].
        beam: (N,) number of each beam in firing order.
        orders: (2, N) indices of the beams: 0, 1, ..., N - 1; and the indices
            sorted by firing. Beams that are consecutive in one of these two
            sequences are neighbours (see
            `cns_drake.sensors.returns.footprint.find_sides`).
        range_error: (N,) range error of each beam's laser [m].
        gain: (N,) gain of each beam's laser.
    """

    def __init__(
        self,
        beams: Beams,
        d_Sset: np.ndarray,
        reported: np.ndarray,
        height: np.ndarray,
        range_error: np.ndarray,
        gain: np.ndarray,
    ):
        """Sorts the beams; all arguments are in firing order.

        Args:
            beams: beams of the pattern.
            d_Sset: (N, 3) true unit directions of the beams.
            reported: (N, 3) unit directions that the unit reports.
            height: (N,) height of each beam's laser above the origin of S [m].
            range_error: (N,) range error of each beam's laser [m].
            gain: (N,) gain of each beam's laser.
        """
        self.range_error = range_error
        self.gain = gain
        self.reported = reported
        self.p_SLset = np.outer(height, (0.0, 0.0, 1.0))
        self.beam = np.asarray(beams.packet_order, np.int64)
        self.d_Sset = np.ascontiguousarray(d_Sset[self.beam])
        self.height = height[self.beam]
        self.orders = np.stack(
            [np.arange(len(self.beam)), np.argsort(self.beam, kind="stable")]
        )
        ends = np.flatnonzero(np.diff(self.height)) + 1
        ends = np.concatenate([[0], ends, [len(self.height)]])
        self.blocks = [
            (self.height[first], slice(first, last))
            for first, last in pairwise(ends)
        ]


class _LaserErrors(NamedTuple):
    """The errors of L lasers: five arrays (L,).

    Attributes:
        range_error: error of ranges [m].
        elevation, azimuth: errors of the direction [rad].
        gain: error of the gain, as a fraction.
        flicker: fraction by which shots are alternately brighter and darker.
    """

    range_error: np.ndarray
    elevation: np.ndarray
    azimuth: np.ndarray
    gain: np.ndarray
    flicker: np.ndarray


def _make_unit_beams(
    beams: Beams, sheet: ReturnsSheet, key: np.uint64
) -> _UnitBeams:
    """Returns the beams of a revolution, with the errors of their lasers.

    Args:
        sheet: data sheet of the unit.
        key: key of the random numbers of the individual unit, from
            `cns_drake.sensors.returns.random_numbers.frame_key`.
    """
    laser = np.arange(int(beams.ring.max()) + 1)
    by_laser = _draw_laser_errors(laser, sheet, key)
    errors = _LaserErrors(
        *(errors_of_laser[beams.ring] for errors_of_laser in by_laser)
    )
    x, y, z = beams.d_Sset.T
    to_tick = 0.0
    offset = 0.0
    if sheet.head.tick_deg:
        tick = np.radians(sheet.head.tick_deg)
        azimuth = arctan2(y, x)
        to_tick = np.rint(azimuth / tick) * tick - azimuth
        draw = uniform(key, laser, len(_LaserErrors._fields))
        offset = ((draw - 0.5) * 2.0 * tick)[beams.ring]
    across = np.maximum(np.sqrt(x * x + y * y), 1e-9)
    lowest, heights, factors = np.transpose(sheet.head.blocks)
    block = (np.degrees(arcsin(z))[:, None] < lowest[:-1]).sum(axis=1)
    flicker = errors.flicker
    return _UnitBeams(
        beams,
        _turned_directions(
            beams.d_Sset, offset + errors.azimuth, errors.elevation / across
        ),
        _turned_directions(beams.d_Sset, offset + to_tick, 0.0),
        heights[block],
        errors.range_error * factors[block],
        np.maximum(1.0 + errors.gain, 0.0)
        * np.where(beams.column % 2, 1.0 + flicker, 1.0 - flicker),
    )


def _draw_laser_errors(
    laser: np.ndarray, sheet: ReturnsSheet, key: np.uint64
) -> _LaserErrors:
    """Returns the random errors of lasers with the numbers (L,)."""
    alternate, response = sheet.head.alternate, sheet.response
    angle = np.radians(sheet.angle_error_deg)
    # The alternating offset is part of the unit's range errors.
    rest = np.sqrt(sheet.range_bias**2 - alternate**2)
    sizes = (rest, angle, angle, response.gain, response.flicker)
    # No error is larger than three standard deviations.
    range_error, elevation, azimuth, gain, flicker = (
        size * np.clip(normal(key, laser, draw), -3.0, 3.0)
        for draw, size in enumerate(sizes)
    )
    range_error += np.where(laser % 2, -alternate, alternate)
    gain += response.dim * np.minimum(gain + response.gain, 0.0)
    return _LaserErrors(range_error, elevation, azimuth, gain, flicker)


def _turned_directions(
    d_Sset: np.ndarray, left: np.ndarray | float, up: np.ndarray | float
) -> np.ndarray:
    """Returns (N, 3) directions turned by small angles.

    Azimuths grow by `left` [rad]. Elevations grow by about `up` times the
    cosine of the elevation [rad].
    """
    x, y, z = d_Sset.T
    c, s = cos(left), sin(left)
    x, y = c * x - s * y, s * x + c * y
    x, y, z = x - up * x * z, y - up * y * z, z + up * (x * x + y * y)
    return np.stack([x, y, z], axis=1) / np.sqrt(x * x + y * y + z * z)[:, None]


@dataclass(frozen=True)
class CalibratedReturns:
    """A model of returns that follows the data sheet of a LiDAR.

    The model adds the unit's noise, losses, angular errors and calibrated
    intensities. Random numbers depend only on the seed, the name of the sensor,
    the frame and the beam. Errors of the individual unit depend on `unit_seed`,
    the name of the sensor and the laser, so they are the same in all drives
    with the same unit.

    Attributes:
        sheet: what the data sheet of the unit says of its returns.
        echoes: which echoes of a beam are reported.
        weather: weather of the drive.
        seed: seed of random numbers.
        sensor_name: name of the LiDAR; LiDARs with different names get
            different random numbers.
        unit_seed: seed of the errors of the unit.

    Raises:
        TypeError: a value is of another type.
        ValueError: a seed is negative.

    Example:
        from cns_drake import CalibratedReturns

        returns = CalibratedReturns.of_preset("os1-64", seed=7)
    """

    sheet: ReturnsSheet
    echoes: Echoes = Echoes.STRONGEST
    weather: Weather = CLEAR
    seed: int = 0
    sensor_name: str = ""
    unit_seed: int = 0

    def __post_init__(self) -> None:
        check_fields(self)
        for seed in (self.seed, self.unit_seed):
            check_seed(seed)

    @classmethod
    def of_preset(
        cls,
        unit: str | Path,
        *,
        echoes: Echoes | str = Echoes.STRONGEST,
        weather: Weather = CLEAR,
        seed: int = 0,
        sensor_name: str = "",
        unit_seed: int = 0,
    ) -> CalibratedReturns:
        """Returns a model that follows the data sheet of a LiDAR.

        Args:
            unit: a key of `LIDAR_PRESETS`, or the file of a data sheet.
            echoes: which echoes of a beam are reported.
            weather: fog, rain and snowfall.
            seed: seed of the noise, which differs from frame to frame.
            sensor_name: the name of the LiDAR.
            unit_seed: seed of the errors that are constant for a laser.

        Raises:
            ValueError: there is no such preset, or no such choice of echoes.
            InputError: the file cannot be read, or is no data sheet.
        """
        return cls(
            find_sheet(unit).returns,
            Echoes(echoes),
            weather,
            seed,
            sensor_name,
            unit_seed,
        )

    def materials(
        self,
        geometries: Sequence[PerceptionGeometry],
        structures: object,
    ) -> Materials:
        """Returns the materials of geometries, with wet ground in rain.

        `structures` supplies the classes if it is a `StructureTable`; otherwise
        no structure has a class.
        """
        if not isinstance(structures, StructureTable):
            structures = StructureTable(())
        is_wet = self.weather.rain > 0.0
        return find_materials(geometries, structures, is_wet=is_wet)

    def reach(self, max_range: float) -> float:
        """Returns how far rays must be cast [m], given the maximum range [m].

        The result exceeds the maximum range, because range noise can bring a
        surface beyond the maximum range into range.
        """
        return max_range + 8.0 * self.sheet.range_noise

    def _make_receiver(self, min_range: float, max_range: float) -> Receiver:
        """Returns the receiver of the unit, with range limits [m]."""
        sheet = self.sheet
        budget = fit_link_budget(sheet)
        scattering = None
        if not self.weather.is_clear:
            scattering = tabulate_scattering(
                self.weather,
                budget,
                sheet.divergence,
                sheet.resolution,
                min_range,
            )
        return Receiver(
            sheet,
            budget,
            self.weather.extinction,
            min_range,
            max_range,
            self.echoes,
            scattering,
        )

    def measure(
        self,
        scene: RayCastingScene,
        materials: Materials,
        pattern: BeamPattern,
        unit: _UnitBeams,
        p_WSset: np.ndarray,
        R_WSset: np.ndarray,
        times: np.ndarray,
        frame: int,
    ) -> Reported:
        """Returns the reported points of a revolution.

        Rays are numbered in the order in which they are cast. Ray i is cast
        from pose i mod K at time i mod T.

        Args:
            scene: geometry on which rays are cast.
            materials: reflection properties of each geometry.
            pattern: the beams of a revolution.
            unit: the beams with the errors of the individual unit, from
                `CalibratedReturns.unit_beams`.
            p_WSset: (K, 3) positions of S in the world [m].
            R_WSset: (K, 3, 3) orientations of S in the world.
            times: (T,) firing times as fractions of the revolution.
            frame: number of the revolution.
        """
        key = frame_key(self.seed, self.sensor_name, frame)
        reach = self.reach(pattern.max_range)
        times = np.asarray(times, np.float32)
        hits = _cast_axes(scene, unit, p_WSset, R_WSset, times, reach)
        met = BeamHits.of(rotate(R_WSset, unit.d_Sset), hits)
        if unit.height.any():
            every = np.arange(len(unit.height))
            up = unit.height[:, None] * _values_of_rays(R_WSset[:, :, 2], every)
            p_WSset = _values_of_rays(p_WSset, every) + up

        def cast(
            p_Wset: np.ndarray,
            d_Wset: np.ndarray,
            when: np.ndarray,
            reaches: np.ndarray,
        ) -> SceneHits:
            return scene.cast_rays(
                p_Wset, d_Wset, reaches, times=when, with_normals=True
            )

        shots = Shots(
            key,
            unit.beam,
            p_WSset,
            times,
            self.sheet.divergence,
            reach,
            materials,
            cast,
        )
        sides = find_sides(shots, unit.orders, met)
        # A single origin for all rays is faster.
        origins = _values_of_rays(p_WSset, sides.row)
        when = times[sides.row % len(times)]
        side_met = BeamHits.of(
            sides.d_Wset, cast(origins, sides.d_Wset, when, sides.reach)
        )
        axis_shares = correct_side_hits(sides, side_met, met)
        lights, ways, ways_met = start_ways(
            shots, axis_shares, met, sides, side_met
        )
        receiver = self._make_receiver(pattern.min_range, pattern.max_range)
        followed = follow(shots, ways, ways_met, receiver.budget.scale)
        light = with_texture(
            join([*lights, *followed]),
            unit.orders[1],
            np.asarray(p_WSset, float),
            met.d_Wset,
            materials,
            scene.surface_frames(),
        )
        return report_echoes(light, receiver, key, unit.range_error, unit.gain)

    def unit_beams(self, beams: Beams) -> _UnitBeams:
        """Returns the beams of a revolution, with the errors of this unit.

        Each laser has errors of direction, range and gain, which are the same
        in all revolutions.

        Args:
            beams: the nominal beams, from `BeamPattern.beams`.
        """
        key = frame_key(self.unit_seed, f"unit/{self.sensor_name}", 0)
        return _make_unit_beams(beams, self.sheet, key)


def _values_of_rays(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Returns values[i mod K] for i in `rows`; the only value if K is 1."""
    return values if len(values) == 1 else values[rows % len(values)]


def _cast_axes(
    scene: RayCastingScene,
    unit: _UnitBeams,
    p_WSset: np.ndarray,
    R_WSset: np.ndarray,
    times: np.ndarray,
    reach: float,
) -> SceneHits:
    """Returns the hits of the beams' axes; see `CalibratedReturns.measure`."""
    found = []
    for height, rows in unit.blocks:
        # An array with one entry per column is used whole, because a block
        # contains whole cycles of the columns.
        p, R, when = (
            array[rows] if len(array) == len(unit.beam) else array
            for array in (p_WSset, R_WSset, times)
        )
        # A single origin for all rays is faster.
        hits = scene.cast_rays(
            p + height * R[:, :, 2],
            unit.d_Sset[rows],
            reach,
            R_WSset=R,
            times=when,
            with_normals=True,
        )
        found.append(hits)
    if len(found) == 1:
        return found[0]
    fields = zip(*(vars(hits).values() for hits in found), strict=True)
    return SceneHits(*map(np.concatenate, fields))
