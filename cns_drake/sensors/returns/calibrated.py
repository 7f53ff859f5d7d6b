"""A LiDAR that measures like the unit of its data sheet, in any weather."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cns_drake.ray_casting.ray_casting_scene import (
    RayCastingScene,
    RayHits,
    join_hits,
)
from cns_drake.sensors.beam_pattern import BeamPattern, Beams
from cns_drake.sensors.returns.counter_random import frame_key
from cns_drake.sensors.returns.echo_choice import Echoes
from cns_drake.sensors.returns.echoes import (
    Receiver,
    Reported,
    choice_of,
    report_echoes,
)
from cns_drake.sensors.returns.footprint import (
    NUM_SUB_RAYS,
    find_jumps,
    mark_edges,
)
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.link_budget import LinkBudget
from cns_drake.sensors.returns.materials import Materials
from cns_drake.sensors.returns.propagation import Cast, Ways, follow
from cns_drake.sensors.returns.starting_rays import start_ways
from cns_drake.sensors.returns.unit_sheets import UNIT_SHEETS, UnitSheet
from cns_drake.sensors.returns.weather import (
    Scattering,
    Weather,
    tabulate_scattering,
)

CLEAR = Weather()


@dataclass(frozen=True)
class CalibratedReturns:
    """Makes returns by the data sheet of a unit.

    Random numbers depend on the seed, the name of the sensor, the frame and
    the beam alone.

    Attributes:
        sheet: of the unit.
        echoes: which echoes of a beam it reports.
        weather: in which it measures.
        seed: of what is random.
        sensor_name: makes one LiDAR differ from another.

    Example:
        from cns_drake import CalibratedReturns

        returns = CalibratedReturns.of_preset("os1-64", seed=7)
    """

    sheet: UnitSheet
    echoes: Echoes = Echoes.STRONGEST
    weather: Weather = CLEAR
    seed: int = 0
    sensor_name: str = ""

    @classmethod
    def of_preset(
        cls,
        preset: str,
        *,
        echoes: Echoes | str = Echoes.STRONGEST,
        weather: Weather = CLEAR,
        seed: int = 0,
        sensor_name: str = "",
    ) -> CalibratedReturns:
        """Returns the model of a preset's unit.

        Args:
            preset: a key of `LIDAR_PRESETS`.
            echoes: see the class, like those that follow.
            weather: fog, rain and snowfall.
            seed: of the random draws.
            sensor_name: the name of the LiDAR.

        Raises:
            KeyError: there is no such preset.
            ValueError: there is no such choice of echoes.
        """
        return cls(
            UNIT_SHEETS[preset], Echoes(echoes), weather, seed, sensor_name
        )

    @property
    def is_wet(self) -> bool:
        """Whether water lies on the ground."""
        return self.weather.rain > 0.0

    def reach(self, max_range: float) -> float:
        """Returns how far rays are cast [m].

        Farther than what is reported, since the range noise can bring a
        surface there into reach.
        """
        return max_range + 8.0 * self.sheet.range_noise

    @cached_property
    def _budget(self) -> LinkBudget:
        return self.sheet.budget

    @cached_property
    def _receivers(self) -> dict[tuple[float, float], Receiver]:
        return {}

    def _receiver(self, pattern: BeamPattern) -> Receiver:
        """Returns the receiver of a pattern; those made before are kept."""
        limits = pattern.min_range, pattern.max_range
        if limits not in self._receivers:
            sheet = self.sheet
            scattering = _no_scattering()
            if not self.weather.is_clear:
                scattering = tabulate_scattering(
                    self.weather,
                    self._budget,
                    sheet.divergence,
                    sheet.resolution,
                    pattern.min_range,
                )
            self._receivers[limits] = Receiver(
                self._budget,
                self.weather.extinction,
                sheet.resolution,
                *limits,
                sheet.retro_from,
                choice_of(self.echoes),
                scattering,
            )
        return self._receivers[limits]

    def measure(
        self,
        scene: RayCastingScene,
        materials: Materials,
        pattern: BeamPattern,
        turn: CalibratedTurn,
        p_WSset: np.ndarray,
        R_WSset: np.ndarray,
        times: np.ndarray,
        frame: int,
    ) -> Reported:
        """Returns what the unit reports of a turn.

        Args:
            scene: casts rays.
            materials: of the scene's geometries.
            pattern: of the beams.
            turn: the beams of this turn.
            p_WSset: (K, 3) positions of S; ray i of the order of casting
                starts at position i mod K.
            R_WSset: (K, 3, 3) its orientations, taken in turn likewise.
            times: (T,) parts of the turn, taken in turn likewise.
            frame: number of the turn.
        """
        key = frame_key(self.seed, self.sensor_name, frame)
        reach = self.reach(pattern.max_range)
        hits = scene.cast_rays(
            p_WSset,
            turn.d_Sset,
            reach,
            R_WSset=R_WSset,
            times=times,
            with_normals=True,
        )

        def cast(
            p_Wset: np.ndarray, d_Wset: np.ndarray, when: np.ndarray
        ) -> RayHits:
            return scene.cast_rays(
                p_Wset, d_Wset, reach, times=when, with_normals=True
            )

        is_edge = self._find_edges(turn, p_WSset, R_WSset, times, hits, cast)
        whole = np.flatnonzero(~is_edge & (hits.geometry >= 0))
        edges = np.flatnonzero(is_edge)
        ways = Ways.room_for(len(whole) + NUM_SUB_RAYS * len(edges))
        start_ways(
            key,
            whole,
            edges,
            turn.beam,
            turn.d_Sset,
            p_WSset,
            R_WSset,
            np.asarray(times, np.float32),
            self.sheet.divergence,
            ways,
        )
        p_W, d_W, when = (
            values[len(whole) :]
            for values in (ways.p_Wset, ways.d_Wset, ways.time)
        )
        # From one place, where they have one, which is faster.
        sub_hits = cast(p_W if len(p_WSset) > 1 else p_WSset, d_W, when)
        light = follow(
            key,
            ways,
            join_hits(hits.take(whole), sub_hits),
            materials,
            self._budget,
            self.sheet.divergence,
            cast,
        )
        return report_echoes(
            Light.sorted(light), self._receiver(pattern), key, len(turn.beam)
        )

    def _find_edges(
        self,
        turn: CalibratedTurn,
        p_WSset: np.ndarray,
        R_WSset: np.ndarray,
        times: np.ndarray,
        hits: RayHits,
        cast: Cast,
    ) -> np.ndarray:
        """Returns (N,) which beams meet an edge."""
        is_edge = np.zeros(len(turn.beam), bool)
        seen = (turn.d_Sset, R_WSset, hits.ranges, hits.normals_W)
        probes = find_jumps(turn.orders, *seen, self.sheet.divergence, is_edge)
        origins = p_WSset
        if len(p_WSset) > 1:
            origins = p_WSset[probes.ray % len(p_WSset)]
        when = np.asarray(times, np.float32)[probes.ray % len(times)]
        met = cast(origins, probes.d_Wset, when)
        mark_edges(*probes, met.ranges, met.normals_W, *seen, is_edge)
        return is_edge


class CalibratedTurn:
    """The beams of a turn in the order of casting.

    Attributes:
        d_Sset: (N, 3) directions in the order of casting.
        beam: (N,) number of each beam, in firing order.
        orders: orders of the rays in which neighbours follow each other: that
            of casting, and that of firing.
    """

    def __init__(self, beams: Beams):
        self.beam = np.asarray(beams.packet_order, np.int64)
        self.d_Sset = np.ascontiguousarray(beams.d_Sset[self.beam])
        self.orders = (np.arange(len(self.beam)), np.argsort(self.beam))


def _no_scattering() -> Scattering:
    nothing = np.zeros(0)
    return Scattering(nothing, nothing, np.zeros((0, 1)), nothing, nothing)
