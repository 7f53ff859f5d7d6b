"""Descriptions of a LiDAR and the weather, and their conversion to models."""

from dataclasses import dataclass
import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, PlainSerializer, field_validator, model_validator

from cns_drake.base import validated
from cns_drake.drives import LayoutName
from cns_drake.sensors.lidar.measurement import Echoes
from cns_drake.sensors.lidar.presets import (
    LIDAR_PRESETS,
    UnitPattern,
    check_preset,
    make_beam_pattern,
)
from cns_drake.sensors.sensor_config import (
    Mount,
    Section,
    Triple,
    field_off_by_default,
)

if TYPE_CHECKING:
    from cns_drake.sensors.returns.calibrated import CalibratedReturns


class WeatherConfig(Section):
    """The weather. It affects only LiDARs with calibrated returns.

    The notes on calibrated returns list the limits of the model.

    Attributes:
        visibility: meteorological visibility in fog [m]; a lower visibility
            means denser fog. By default there is no fog.
        rain: rain rate [mm/h].
        snowfall: snowfall rate, as melted water [mm/h].
    """

    visibility: float | None = Field(default=None, ge=5.0, le=1e6)
    rain: float = Field(default=0.0, ge=0.0, le=300.0)
    snowfall: float = Field(default=0.0, ge=0.0, le=300.0)


# Drake's YAML reads the types of the fields, which thus must not be texts, as
# `from __future__ import annotations` makes them.
@dataclass(init=False, repr=False, eq=False)
class LidarDescription:
    """A LiDAR and its errors, in a scenario and in a `LidarConfig` alike.

    A `LidarSection` limits the values of the fields.

    Attributes:
        preset: name of the LiDAR model, from the table of presets in the
            documentation.
        columns: number of columns (azimuths) per revolution; by default the
            preset's.
        min_range: smallest range that is measured [m]; by default the preset's.
        max_range: largest range that is measured [m]; by default the preset's.
        resolution: step to which coordinates are rounded [m]. 0 gives exact
            values.
        range_noise: standard deviation of a Gaussian error of the range [m].
            The limits `min_range` and `max_range` apply after the error has
            been added. Only with ideal returns.
        dropout: probability that a return is lost. Only with ideal returns.
        faint_dropout: additional loss of faint returns: a return of intensity I
            (from 0 to 1) is lost with the probability `faint_dropout` * (1 -
            I). Only with ideal returns.
        motion_distortion: whether the motion of the LiDAR during a revolution
            distorts the scan, as in real units. Each column is then measured
            from the LiDAR's pose at the firing time of this column, `stamp +
            t`, and expressed in the LiDAR's frame at that time. By default the
            whole scan is measured from one pose.
        returns: model of the returns. `ideal` returns are exact, apart from the
            errors that you set; `calibrated` returns have the losses, errors
            and intensities of the unit's data sheet.
        echoes: which echoes of a beam are reported. `dual` reports the
            strongest and the last echo. Fog has an echo only in beams without
            any other echo. Only with calibrated returns.
        unit_seed: seed of the errors in the ranges, angles and gains of an
            individual unit's lasers. Use the same seed in all drives with the
            same unit. Only with calibrated returns.
    """

    preset: str = "cns"
    columns: int | None = None
    min_range: float | None = None
    max_range: float | None = None
    resolution: float = 0.0
    range_noise: float = 0.0
    dropout: float = 0.0
    faint_dropout: float = 0.0
    motion_distortion: bool = False
    returns: str = "ideal"
    echoes: str = Echoes.STRONGEST.value
    unit_seed: int = 0


class LidarSection(LidarDescription, Mount):
    """A LiDAR on the vehicle.

    Attributes:
        xyz: position in `base_link` [m].
        rpy_deg: roll, pitch, yaw in `base_link` [deg].
        resolution: step to which recorded coordinates are rounded [m]; the
            default is 2^-10 m, about 1 mm. 0 records exact values.
        rate: revolutions per second [Hz]. The rate of the fastest LiDAR of the
            drive must be a multiple of this rate. If the lasers of a unit fire
            at a fixed frequency, a revolution has more columns at a lower
            `rate`.
        layout: LiDAR driver, or other program, whose format the recorded points
            have.
    """

    xyz: Triple = (0.0, 0.0, 1.6)
    # Fields of the description, with their limits.
    columns: int | None = Field(default=None, ge=4, le=8192)
    min_range: float | None = Field(default=None, ge=0.0)
    max_range: float | None = Field(default=None, gt=0.0, le=1000.0)
    # About the resolution of real units; needs a third less space than exact
    # values.
    resolution: float = Field(default=2.0**-10, ge=0.0, le=1.0)
    range_noise: float = Field(default=0.0, ge=0.0, le=10.0)
    dropout: float = Field(default=0.0, ge=0.0, le=1.0)
    faint_dropout: float = Field(default=0.0, ge=0.0, le=1.0)
    returns: Literal["ideal", "calibrated"] = field_off_by_default("ideal")
    echoes: Annotated[Echoes, PlainSerializer(lambda echoes: echoes.value)] = (
        field_off_by_default(Echoes.STRONGEST)
    )
    unit_seed: int = field_off_by_default(0, ge=0)
    rate: int = field_off_by_default(20, ge=1, le=100)
    layout: LayoutName = field_off_by_default("cns")

    @field_validator("preset")
    @classmethod
    def _check_known(cls, preset: str) -> str:
        check_preset(preset)
        return preset

    @model_validator(mode="after")
    def _check_returns(self) -> "LidarSection":
        if self.returns == "ideal":
            if self.echoes != Echoes.STRONGEST:
                raise ValueError(
                    "echoes: only calibrated returns have a choice; add "
                    "returns: calibrated"
                )
            if self.unit_seed:
                raise ValueError(
                    "unit_seed: only calibrated returns have errors of a unit; "
                    "add returns: calibrated"
                )
            return self
        for field in ("range_noise", "dropout", "faint_dropout"):
            if getattr(self, field):
                raise ValueError(
                    f"{field}: calibrated returns have their own; leave it out"
                )
        return self

    @model_validator(mode="after")
    def _check_unit(self) -> "LidarSection":
        unit = LIDAR_PRESETS[self.preset].pattern
        if self.columns and unit.num_columns is None:
            raise ValueError(f"the preset '{self.preset}' has no columns")
        nearest = unit.min_range if self.min_range is None else self.min_range
        farthest = unit.max_range if self.max_range is None else self.max_range
        if nearest >= farthest:
            raise ValueError(
                f"min_range {nearest:g} is not below max_range {farthest:g}"
            )
        return self

    def with_preset(self, preset: str) -> "LidarSection":
        """Returns this description of a LiDAR, with another model.

        The name of the preset, the number of columns and the range limits come
        from the new preset; all other fields stay the same.

        Args:
            preset: name of the other model.

        Raises:
            InputError: there is no such preset.
        """
        unit = make_lidar_config(preset)
        names = ("preset", "columns", "min_range", "max_range")
        return self.replaced(**{name: getattr(unit, name) for name in names})


def make_lidar_config(preset: str) -> LidarSection:
    """Returns the description of a LiDAR with a given preset.

    All its other fields have their defaults.

    Raises:
        InputError: there is no such preset.
    """
    return validated(LidarSection, {"preset": preset}, "--lidar")


def make_pattern(
    config: LidarSection, period: float | None = None
) -> UnitPattern:
    """Returns the beam pattern of a LiDAR.

    With calibrated returns, the elevations are the elevations of a real unit,
    if a unit of this preset was measured.

    Args:
        config: description of the LiDAR.
        period: duration of a revolution [s]; by default 1 / `config.rate`.
    """
    pattern = make_beam_pattern(
        config.preset,
        period or 1.0 / config.rate,
        num_columns=config.columns,
        min_range=config.min_range,
        max_range=config.max_range,
    )
    if config.returns == "ideal":
        return pattern
    # Slow to import, and ideal returns do without.
    from cns_drake.sensors.returns.unit_sheets import UNIT_SHEETS

    return UNIT_SHEETS[config.preset].aimed(pattern)


def describe_unit(config: LidarSection) -> dict[str, Any]:
    """Returns facts about a LiDAR that are stored in its recordings.

    Returns:
        A mapping with the keys `preset`, `unit_seed`, and `elevations_deg`: the
        nominal elevations of the lasers [deg], empty for a preset without
        rings. The true angles differ from the nominal elevations by the errors
        of the individual unit.
    """
    nominal = getattr(make_pattern(config), "elevations_rad", ())
    return {
        "preset": config.preset,
        "unit_seed": config.unit_seed,
        "elevations_deg": [round(math.degrees(one), 6) for one in nominal],
    }


def make_returns(
    config: LidarSection, weather: WeatherConfig, name: str, seed: int
) -> "CalibratedReturns | None":
    """Returns the model of calibrated returns; None for ideal returns.

    Args:
        config: description of the LiDAR.
        weather: weather of the drive.
        name: name of the LiDAR; other names give other random numbers.
        seed: seed of the random numbers.
    """
    if config.returns == "ideal":
        return None
    # Slow to import, and not needed to describe a scenario.
    from cns_drake.sensors.returns.calibrated import CalibratedReturns
    from cns_drake.sensors.returns.weather import Weather

    return CalibratedReturns.of_preset(
        config.preset,
        echoes=config.echoes,
        weather=Weather(**weather.model_dump()),
        seed=seed,
        sensor_name=name,
        unit_seed=config.unit_seed,
    )
