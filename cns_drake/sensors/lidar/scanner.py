"""The scanning unit of a LiDAR: from its poses to the points of a scan.

A `Scanner` knows no Diagram and no Context; `Lidar` is the Drake system.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cns_drake.scene import PerceptionGeometry
from cns_drake.sensors.lidar.beams import BeamPattern
from cns_drake.sensors.lidar.measurement import MeasurementModel, Returns
from cns_drake.sensors.lidar.scan_assembly import (
    POINT_DTYPE,
    Revolution,
    assemble_points,
    shared_revolution,
)
from cns_drake.sensors.lidar.seen_geometry import SeenGeometry

if TYPE_CHECKING:
    # Slow to import, and ideal returns do without.
    from cns_drake.sensors.returns.calibrated import CalibratedReturns


class MeasuredReturns(NamedTuple):
    """The N returns of a revolution, and the geometry that each comes from.

    Attributes:
        revolution: the beams of the revolution.
        returns: the returns.
        geometry: (N,) index of each return's geometry in `geometries`; negative
            for a return without a surface, such as rain.
        geometries: the geometry that the LiDAR sees.
    """

    revolution: Revolution
    returns: Returns
    geometry: np.ndarray
    geometries: tuple[PerceptionGeometry, ...]

    def __deepcopy__(self, memo: dict) -> MeasuredReturns:
        # A Context is cloned together with this value. It never changes, and
        # geometry ids cannot be copied.
        return self


class Scanner:
    """The scanning unit of a LiDAR: its beams, and how it measures returns.

    Attributes:
        pattern: the beams of a revolution.
        column_times: (C,) time at which each column fires, as a fraction of the
            revolution.
        column_t_ns: (C,) these times since the start of the revolution [ns].
    """

    def __init__(
        self,
        pattern: BeamPattern,
        measurement: MeasurementModel,
        returns: CalibratedReturns | None,
    ):
        """Prepares the first revolution.

        Args:
            pattern: the beams.
            measurement: the model of noise, losses and rounding.
            returns: the model of a real unit; None for ideal returns. With a
                model, only the resolution is taken from `measurement`.
        """
        self.pattern = pattern
        self._measurement = measurement
        self._returns = returns
        # The models of the latest draw.
        self._drawn = 0, measurement, returns
        self._first = shared_revolution(pattern.beams(0), returns)
        self.column_t_ns = self._first.beams.column_t_ns
        self.column_times = self.column_t_ns / (pattern.period * 1e9)

    @property
    def is_random(self) -> bool:
        """Whether scans depend on a seed."""
        return self._measurement.is_random or self._returns is not None

    @property
    def varies(self) -> bool:
        """Whether scans of the same geometry from one pose differ."""
        return self.is_random or not self.pattern.repeats

    def reach(self) -> float:
        """Returns how far beams must be cast [m]."""
        model = self._returns or self._measurement
        return model.reach(self.pattern.max_range)

    def greys(self, intensity: np.ndarray) -> np.ndarray:
        """Returns the greys (N,) that stand for intensities (N,) of points.

        The greys are not limited to the range from 0 to 255.
        """
        return 255.0 * intensity if self._returns is None else intensity

    def measure(
        self,
        seen: SeenGeometry,
        p_WSset: np.ndarray,
        R_WSset: np.ndarray,
        frame: int,
        draw: int = 0,
    ) -> MeasuredReturns:
        """Casts the beams of a revolution, and measures what returns.

        Args:
            seen: the geometry, with a scene.
            p_WSset: (K, 3) positions of S in the world: one, or one for each
                column [m].
            R_WSset: (K, 3, 3) orientations of S in the world.
            frame: number of the revolution.
            draw: number of a draw of all random numbers; 0 for the seed with
                which the LiDAR was made.
        """
        revolution = self._revolution(frame)
        columns = revolution.beams.cast_columns
        times = self.column_times
        if columns is not None:
            times = times[columns]
            if len(p_WSset) > 1:
                p_WSset, R_WSset = p_WSset[columns], R_WSset[columns]
        geometry, returns = self._measure(
            seen, revolution, p_WSset, R_WSset, times, frame, draw
        )
        return MeasuredReturns(revolution, returns, geometry, seen.built)

    def assemble(
        self, measured: MeasuredReturns, labels: np.ndarray, ids: np.ndarray
    ) -> np.ndarray:
        """Returns the points of a scan: (N,) of `POINT_DTYPE`, read-only.

        Args:
            measured: the returns.
            labels: (num_geometries,) uint16 present class of each geometry.
            ids: (num_geometries,) uint16 instance id of each geometry.
        """
        # Zeros, so that the padding between fields is defined, too.
        points = np.zeros(len(measured.returns.beams), POINT_DTYPE)
        assemble_points(
            points,
            measured.revolution.table,
            measured.returns,
            measured.geometry,
            labels,
            ids,
            np.float32(self._measurement.resolution),
        )
        # Ports and methods of the LiDAR share the points.
        points.flags.writeable = False
        return points

    def _revolution(self, frame: int) -> Revolution:
        """Returns the beams of the revolution with a number."""
        if self.pattern.repeats:
            return self._first
        return shared_revolution(self.pattern.beams(frame), self._returns)

    def _measure(
        self,
        seen: SeenGeometry,
        revolution: Revolution,
        p_WSset: np.ndarray,
        R_WSset: np.ndarray,
        times: np.ndarray,
        frame: int,
        draw: int,
    ) -> tuple[np.ndarray, Returns]:
        """Returns the index of the geometry of each return, and the returns."""
        assert seen.scene is not None
        measurement, returns_model = self._models(draw)
        if self._returns is not None:
            assert revolution.unit_beams is not None
            assert returns_model is not None
            reported = returns_model.measure(
                seen.scene,
                seen.materials(self._returns),
                self.pattern,
                revolution.unit_beams,
                p_WSset,
                R_WSset,
                times,
                frame,
            )
            return reported.geometry, Returns(*reported[:3])
        hits = seen.scene.cast_rays(
            p_WSset,
            revolution.d_Sset_cast,
            self.reach(),
            R_WSset=R_WSset,
            times=times,
        )
        place = revolution.table.place
        returns = measurement.measure(
            hits.ranges.take(place),
            self.pattern.min_range,
            self.pattern.max_range,
            frame,
        )
        return hits.geometry.take(place.take(returns.beams)), returns

    def _models(
        self, draw: int
    ) -> tuple[MeasurementModel, CalibratedReturns | None]:
        # Read once: threads share the scanner.
        latest, measurement, returns = self._drawn
        if latest != draw:
            measurement, returns = self._measurement, self._returns
            if draw:
                measurement = replace(
                    measurement, seed=_drawn_seed(measurement.seed, draw)
                )
            if draw and returns is not None:
                returns = replace(returns, seed=_drawn_seed(returns.seed, draw))
            self._drawn = draw, measurement, returns
        return measurement, returns


def _drawn_seed(seed: int, draw: int) -> int:
    words = np.random.SeedSequence([seed, draw]).generate_state(1, np.uint64)
    return int(words[0])
