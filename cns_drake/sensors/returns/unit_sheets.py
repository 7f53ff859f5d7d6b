"""Values from the data sheets of commercial LiDARs: unit_sheets.yaml."""

from dataclasses import dataclass, replace
from functools import cached_property
import math
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from cns_drake.base import log, parse_yaml
from cns_drake.sensors.lidar.beams import BeamPattern
from cns_drake.sensors.lidar.patterns import SpinningPattern
from cns_drake.sensors.returns import link_budget

_Pattern = TypeVar("_Pattern", bound=BeamPattern)
# Speed of light [m/s].
_LIGHT = 299_792_458.0


@dataclass(frozen=True)
class Response:
    """How a unit converts energy to intensity; no data sheet states this.

    Attributes:
        slope: the intensity of a diffuse target is `full` plus `slope` times
            the natural logarithm of its energy. With a slope of 0, this formula
            does not hold: intensity is proportional to energy, as the data
            sheet says.
        full: intensity of an energy of 1, if `slope` is not 0.
        far: range up to which the unit compensates intensity for distance [m],
            if `slope` is not 0. With a slope of 0, the unit compensates at
            every range.
        floor: least intensity. Lower intensities are reported as 0, whatever
            the gain.
        least: least energy of a reported echo, even at close range, where the
            unit reduces its power.
        gain: standard deviation of the gain over the lasers; the mean gain is
            1.
        dim: lowers the gains of dim lasers. If a gain is more than one standard
            deviation below the mean, the part beyond one standard deviation is
            multiplied by 1 + `dim`.
        flicker: the shots of a laser are alternately brighter and darker, by a
            fraction of the intensity that is constant for the laser. `flicker`
            is the standard deviation of this fraction over the lasers.
        speckle: standard deviation of the intensity of single shots, as a
            fraction of the intensity.
    """

    slope: float = 0.0
    full: float = 0.0
    far: float = math.inf
    floor: float = 0.0
    least: float = 0.0
    gain: float = 0.05
    dim: float = 0.0
    flicker: float = 0.0
    speckle: float = 0.1

    @cached_property
    def table(self) -> np.ndarray:
        """Intensities of diffuse targets, at 4097 energies of the echo.

        The square roots of the energies are evenly spaced from 0 to 1.
        Intensities in between are interpolated.
        """
        root = np.linspace(0.0, 1.0, 4097)
        energy = np.maximum(root, 1e-6) ** 2
        return np.maximum(self.full + self.slope * log(energy), 0.0)


@dataclass(frozen=True)
class Head:
    """Positions of the lasers of a unit, and how the unit reports azimuths.

    Attributes:
        blocks: for each block of lasers, from the top: lowest elevation [deg],
            height above the origin [m], and a factor by which the range errors
            are multiplied.
        alternate: range offset [m]. Every second laser, starting with the
            first, measures ranges that are too long by this offset; all other
            lasers measure ranges that are too short by this offset. The offset
            is part of the lasers' range errors.
        tick_deg: step in which azimuths are reported [deg]; 0 for exact
            azimuths. With a step, each laser has an azimuth offset of its own,
            of up to one step.
        elevations_deg: elevation of each laser of one real unit, from the top;
            empty if only the nominal elevations are known.
    """

    blocks: tuple[tuple[float, float, float], ...] = ((-90.0, 0.0, 1.0),)
    alternate: float = 0.0
    tick_deg: float = 0.0
    elevations_deg: tuple[float, ...] = ()


@dataclass(frozen=True)
class UnitSheet:
    """The data sheet of a LiDAR model (unit).

    Attributes:
        rows: ranges at stated reflectivities, at most two.
        range_noise: standard deviation of a range at an SNR of 1 [m].
        range_floor: the best stated accuracy or precision, as the standard
            deviation of a range at any SNR [m].
        divergence_deg: full angle of the beam at 1 / e^2 of its peak [deg].
        pulse_ns: width of a pulse at half of its peak [ns].
        retro_from: least intensity of retro-reflectors. Diffuse targets with
            reflectivities from 0 to 1 have intensities from 0 to this value.
        unknown: names of the fields that the sheet does not state.
        source: where the numbers come from.
        angle_error_deg: standard deviation of a laser's elevation and azimuth
            [deg].
        own_part: fraction of `range_floor` that is an error that stays constant
            for a laser. The other fraction varies from shot to shot; the
            squares of both fractions add up to 1.
        response: how the unit converts energy to intensity.
        head: positions of the lasers.
    """

    rows: tuple[link_budget.SheetRow, ...]
    range_noise: float
    range_floor: float
    divergence_deg: float
    pulse_ns: float
    unknown: tuple[str, ...]
    source: str
    retro_from: float = 100.0
    angle_error_deg: float = 0.03
    own_part: float = 0.8
    response: Response = Response()
    head: Head = Head()

    @property
    def budget(self) -> link_budget.LinkBudget:
        return link_budget.fit_link_budget(
            self.rows, self.range_noise, self.range_floor, self.range_bias
        )

    @property
    def range_bias(self) -> float:
        """Standard deviation of each laser's constant range error [m]."""
        return self.own_part * self.range_floor

    @property
    def divergence(self) -> float:
        """Half angle of the beam at 1 / e^2 of its peak [rad]."""
        return math.radians(self.divergence_deg) / 2.0

    @property
    def resolution(self) -> float:
        """Difference in distance below which two echoes merge [m]."""
        return _LIGHT * self.pulse_ns * 1e-9 / 2.0

    def aimed(self, pattern: _Pattern) -> _Pattern:
        """Returns a pattern with the elevations that were measured on one unit.

        If the elevations are not known (see `Head`), or the pattern is not
        spinning or has another number of rings, the pattern is returned
        unchanged.
        """
        own = tuple(map(math.radians, self.head.elevations_deg))
        if not isinstance(pattern, SpinningPattern):
            return pattern
        is_own = len(own) == pattern.num_rings
        return replace(pattern, elevations_rad=own) if is_own else pattern


def _make_sheet(
    rows: list, unknown: list[str], source: str, **fields: Any
) -> UnitSheet:
    """Returns a unit's sheet from its fields in unit_sheets.yaml."""
    if "response" in fields:
        fields["response"] = Response(**fields["response"])
    if "head" in fields:
        head = fields["head"]
        blocks = tuple(map(tuple, head.pop("blocks")))
        elevations_deg = tuple(head.pop("elevations_deg"))
        fields["head"] = Head(blocks, elevations_deg=elevations_deg, **head)
    return UnitSheet(
        rows=tuple(link_budget.SheetRow(*row) for row in rows),
        unknown=tuple(unknown),
        source=source,
        **fields,
    )


UNIT_SHEETS: dict[str, UnitSheet] = {
    name: _make_sheet(**fields)
    for name, fields in parse_yaml(
        Path(__file__).with_name("unit_sheets.yaml").read_bytes()
    ).items()
}
