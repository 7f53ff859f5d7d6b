"""The beams of one individual unit, with the errors of its lasers."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cns_drake.base import cos, sin
from cns_drake.sensors.lidar.beams import Beams
from cns_drake.sensors.returns.random_numbers import normal, uniform
from cns_drake.sensors.returns.unit_sheets import UnitSheet


class UnitBeams:
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
            [np.arange(len(self.beam)), np.argsort(self.beam)]
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


def make_unit_beams(
    beams: Beams, sheet: UnitSheet, key: np.uint64
) -> UnitBeams:
    """Returns the beams of a revolution, with the errors of their lasers.

    Args:
        beams: the nominal beams.
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
        azimuth = np.arctan2(y, x)
        to_tick = np.rint(azimuth / tick) * tick - azimuth
        draw = uniform(key, laser, len(_LaserErrors._fields))
        offset = ((draw - 0.5) * 2.0 * tick)[beams.ring]
    across = np.maximum(np.sqrt(x * x + y * y), 1e-9)
    lowest, heights, factors = np.transpose(sheet.head.blocks)
    block = (np.degrees(np.arcsin(z))[:, None] < lowest[:-1]).sum(axis=1)
    flicker = errors.flicker
    return UnitBeams(
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
    laser: np.ndarray, sheet: UnitSheet, key: np.uint64
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
