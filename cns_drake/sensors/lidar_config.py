"""Descriptions of a LiDAR and the weather, and the models that follow.

Scenarios are read with this module, and thus without Drake.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Literal,
    NamedTuple,
    TypeAlias,
    TypeVar,
)
import warnings

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    PlainSerializer,
    ValidationInfo,
    field_validator,
    model_validator,
)

from cns_drake.sensors.lidar.beams import BeamPattern, period_of_rate
from cns_drake.sensors.lidar.measurement import Echoes, MeasurementModel
from cns_drake.sensors.lidar.patterns import (
    NoddingPattern,
    RosettePattern,
    SpinningPattern,
)
from cns_drake.sensors.sensor_config import Mount, Triple, field_off_by_default
from evaluation.base import InputError, Section, of_type, validated
from evaluation.drives import LayoutName
from evaluation.lidar_sheets import (
    DEFAULT_PRESET,
    LONGEST_PERIOD,
    MOST_BEAMS,
    MOST_RINGS,
    LidarSheet,
    NoddingSheet,
    ReturnsSheet,
    RosetteSheet,
    SpinningSheet,
    check_one_unit,
    check_preset,
    find_sheet,
    is_sheet_file,
    make_sheet,
    read_sheet,
)
from evaluation.lidar_sheets import LIDAR_PRESETS as LIDAR_PRESETS

if TYPE_CHECKING:
    from cns_drake.sensors.returns.calibrated import CalibratedReturns

UnitPattern: TypeAlias = SpinningPattern | RosettePattern | NoddingPattern
_Pattern = TypeVar("_Pattern", bound=BeamPattern)


class WeatherConfig(Section):
    """The weather. It affects only LiDARs with calibrated returns.

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

    Attributes:
        preset: name of the LiDAR model, from the table of presets in the
            documentation; none if there is a `unit`.
        unit: file with the data sheet of a LiDAR of your own, instead of a
            preset.
        rings: number of rings, evenly spaced from the highest to the lowest
            ring of the data sheet; by default the rings of the data sheet.
        columns: number of columns (azimuths) per revolution; by default the
            data sheet's.
        min_range: smallest range that is measured [m]; by default the data
            sheet's.
        max_range: largest range that is measured [m]; by default the data
            sheet's.
        hidden_deg: first and last azimuth, counterclockwise, of a sector that
            something beside the LiDAR hides, from -180 to 180 [deg]; by
            default nothing is hidden.
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
            distorts the scan: each column is then measured from the pose at its
            firing time, `stamp + t`, and expressed in the frame at that time.
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

    preset: str | None = DEFAULT_PRESET
    unit: str | None = None
    rings: Annotated[
        int | None, field_off_by_default(None, ge=2, le=MOST_RINGS)
    ] = None
    columns: Annotated[int | None, Field(ge=4, le=8192)] = None
    min_range: Annotated[float | None, Field(ge=0.0)] = None
    max_range: Annotated[float | None, Field(gt=0.0, le=1000.0)] = None
    hidden_deg: Annotated[
        list[float] | None,
        field_off_by_default(None, min_length=2, max_length=2),
    ] = None
    resolution: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    range_noise: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    dropout: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    faint_dropout: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    motion_distortion: bool = False
    returns: str = "ideal"
    echoes: str = Echoes.STRONGEST.value
    unit_seed: Annotated[int, field_off_by_default(0, ge=0)] = 0


def _find_unit(given: Any) -> Any:
    """Returns the data sheet in a file, or with the given fields."""
    try:
        if isinstance(given, str | Path):
            return read_sheet(Path(given))
        if isinstance(given, Mapping):
            return make_sheet(given, "its data sheet")
    except InputError as error:
        # Becomes an error at the section's field.
        raise ValueError(str(error)) from None
    if given is not None and not isinstance(given, LidarSheet):
        raise ValueError(f"{given!r} is not the file of a data sheet")
    return given


# Fields in which another model has values of its own.
_OF_MODEL = ("rings", "columns", "min_range", "max_range")


class LidarSection(LidarDescription, Mount):
    """A LiDAR on the vehicle.

    Attributes:
        unit: file with the data sheet of a LiDAR of your own, or the fields of
            the data sheet, instead of a preset.
        xyz: position in `base_link` [m].
        rpy_deg: roll, pitch, yaw in `base_link` [deg].
        resolution: step to which recorded coordinates are rounded [m]; the
            default is 2^-10 m, about 1 mm. 0 records exact values.
        rate: revolutions per second [Hz]. The rate of the fastest LiDAR of the
            drive must be a multiple. A unit that fires steadily has more
            columns at a lower `rate`.
        layout: LiDAR driver, or other program, whose format the recorded points
            have.
    """

    xyz: Triple = (0.0, 0.0, 1.6)
    # The content of the file, so that a recording states all of it.
    unit: Annotated[
        LidarSheet | None,
        BeforeValidator(_find_unit, json_schema_input_type=str | None),
        PlainSerializer(lambda sheet: sheet and sheet.to_fields()),
    ] = field_off_by_default(None)  # type: ignore[assignment]  # Narrower.
    # About the resolution of real units; needs a third less space than exact
    # values.
    resolution: Annotated[float, Field(ge=0.0, le=1.0)] = 2.0**-10
    returns: Literal["ideal", "calibrated"] = field_off_by_default("ideal")
    echoes: Annotated[Echoes, PlainSerializer(lambda echoes: echoes.value)] = (
        field_off_by_default(Echoes.STRONGEST)
    )
    rate: int = field_off_by_default(20, ge=1, le=100)
    layout: LayoutName = field_off_by_default("cns")

    # A field -> the fields that a change of it removes.
    replaces: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "preset": ("unit", *_OF_MODEL),
        "unit": ("preset", *_OF_MODEL),
    }

    @model_validator(mode="before")
    @classmethod
    def _choose_unit(cls, fields: Any) -> Any:
        """Leaves out the preset of a LiDAR with a data sheet of its own."""
        if not isinstance(fields, Mapping):
            return fields
        preset, unit = fields.get("preset"), fields.get("unit")
        if unit is not None and preset is None:
            return {**fields, "preset": None}
        if unit is None and preset is None:
            return {**fields, "preset": DEFAULT_PRESET}
        return fields

    @field_validator("preset")
    @classmethod
    def _check_known(cls, preset: str | None) -> str | None:
        if preset is not None:
            check_preset(preset)
        return preset

    @field_validator("unit")
    @classmethod
    def _check_one(
        cls, unit: LidarSheet | None, info: ValidationInfo
    ) -> LidarSheet | None:
        check_one_unit(info.data.get("preset"), unit)
        return unit

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
        sheet = self.sheet
        nearest, farthest = sheet.ranges
        nearest = nearest if self.min_range is None else self.min_range
        farthest = farthest if self.max_range is None else self.max_range
        if nearest >= farthest:
            raise ValueError(
                f"min_range {nearest:g} is not below max_range {farthest:g}"
            )
        _without_hidden(make_pattern(self), self.hidden_deg)
        if self.returns == "calibrated":
            sheet.returns.check_range(farthest)
        return self

    @property
    def sheet(self) -> LidarSheet:
        """The data sheet, with the number of rings that the section sets."""
        sheet = self.unit
        if sheet is None:
            assert self.preset is not None  # One of the two is given.
            sheet = LIDAR_PRESETS[self.preset]
        return sheet if self.rings is None else sheet.with_rings(self.rings)

    def with_lidar(self, unit: str | Path | LidarSheet) -> "LidarSection":
        """Returns this description of a LiDAR, with another model.

        The data sheet, the numbers of rings and columns, and the range limits
        are the other model's; all other fields stay the same.

        Args:
            unit: name of a preset, the file of a data sheet, or a data sheet.

        Raises:
            InputError: there is no such preset, or the file is no data sheet.
        """
        new = make_lidar_config(unit)
        names = ("preset", "unit", *_OF_MODEL)
        return self.replaced(**{name: getattr(new, name) for name in names})


def make_lidar_config(unit: str | Path | LidarSheet) -> LidarSection:
    """Returns the description of a LiDAR of a given model.

    All other fields have their defaults.

    Args:
        unit: name of a preset, the file of a data sheet, or a data sheet.

    Raises:
        InputError: there is no such preset, or the file is no data sheet.
    """
    try:
        sheet = find_sheet(unit)
    except (InputError, ValueError) as error:
        raise InputError(f"unit: {error}") from None
    is_preset = not (unit is sheet or is_sheet_file(unit))
    fields = {"preset": str(unit)} if is_preset else {"unit": sheet}
    return validated(LidarSection, fields, "unit")


def make_beam_pattern(
    unit: str | Path | LidarSheet,
    period: float | None = None,
    *,
    num_columns: int | None = None,
    min_range: float | None = None,
    max_range: float | None = None,
) -> UnitPattern:
    """Returns the beam pattern of a LiDAR.

    Args:
        unit: a key of `LIDAR_PRESETS`, the file of a data sheet, or a data
            sheet.
        period: duration of a revolution [s]; by default the duration in the
            data sheet.
        num_columns: columns in a revolution; by default the number in the data
            sheet. If the lasers of a unit fire at a fixed rate, the period
            determines this number.
        min_range: nearest range that is measured [m]; by default the value in
            the data sheet.
        max_range: farthest range that is measured [m]; by default the value in
            the data sheet.

    Raises:
        ValueError: there is no preset of that name, `num_columns` is given for
            a LiDAR without columns, or a value is impossible.
        InputError: the file cannot be read, or is no data sheet.

    Example:
        from cns_drake import LIDAR_PRESETS, make_beam_pattern

        patterns = [make_beam_pattern(name, 0.1) for name in LIDAR_PRESETS]
    """
    sheet = find_sheet(unit)
    of_type(period, float | None, "period")
    if period is not None and not 0.0 < period <= LONGEST_PERIOD:
        raise ValueError(
            f"period: {period:g} s is not above 0 and up to {LONGEST_PERIOD:g}"
        )
    if isinstance(sheet, SpinningSheet):
        if sheet.fires_steadily and period and num_columns is None:
            num_columns = max(round(sheet.columns * period / sheet.period), 1)
    elif num_columns is not None:
        raise ValueError(
            f"columns: a LiDAR with the pattern '{sheet.pattern}' has none"
        )
    common: dict[str, Any] = {
        "period": sheet.period if period is None else period,
        "min_range": sheet.ranges[0] if min_range is None else min_range,
        "max_range": sheet.ranges[1] if max_range is None else max_range,
    }
    match sheet:
        case SpinningSheet():
            limits = sheet.azimuths_deg
            return SpinningPattern(
                tuple(np.deg2rad(sheet.elevations).tolist()),
                sheet.columns if num_columns is None else num_columns,
                azimuths_rad=(
                    None
                    if limits is None
                    else tuple(np.deg2rad(limits).tolist())
                ),
                **common,
            )
        case RosetteSheet():
            return RosettePattern(
                sheet.fov_deg,
                height_deg=sheet.height_deg,
                num_lines=sheet.num_lines,
                points_per_second=sheet.points_per_second,
                **common,
            )
        case NoddingSheet():
            return NoddingPattern(
                sheet.elevations_deg,
                num_lines=sheet.num_lines,
                points_per_second=sheet.points_per_second,
                **common,
            )
    raise AssertionError(sheet)  # There is no other kind.


def revolution_at_rate(
    unit: str | Path | LidarSheet,
    rate: float | None,
    num_columns: int | None = None,
) -> float:
    """Returns the duration of a revolution of a LiDAR that takes scans [s].

    It is the duration in the data sheet, or 1 / `rate` if that is shorter.

    Args:
        unit: as for `make_beam_pattern`.
        rate: scans per second; None for the duration in the data sheet.
        num_columns: as for `make_beam_pattern`.

    Raises:
        ValueError: see `make_beam_pattern`, or the rate is out of range.

    Warns:
        UserWarning: the revolution has fewer beams than in the data sheet.
    """
    sheet = find_sheet(unit)
    if rate is None:
        return sheet.period
    period = period_of_rate(rate, LONGEST_PERIOD)
    if period >= sheet.period:
        return sheet.period
    num_beams, usual = (
        make_beam_pattern(sheet, one, num_columns=num_columns).num_beams
        for one in (period, None)
    )
    if num_beams != usual:
        warnings.warn(
            f"rate: {rate:g} scans per second: a revolution takes {period:g} s "
            f"and has {num_beams} beams, not {sheet.period:g} s and {usual} "
            "beams as in the data sheet",
            stacklevel=3,
        )
    return period


def aimed(pattern: _Pattern, sheet: ReturnsSheet) -> _Pattern:
    """Returns a pattern with the elevations that were measured on one unit.

    If the elevations are not known (see `Head`), or the pattern is not spinning
    or has another number of rings, the pattern is returned unchanged.
    """
    own = tuple(map(math.radians, sheet.head.elevations_deg))
    if not isinstance(pattern, SpinningPattern):
        return pattern
    is_own = len(own) == pattern.num_rings
    return replace(pattern, elevations_rad=own) if is_own else pattern


def make_pattern(
    config: LidarSection, period: float | None = None
) -> UnitPattern:
    """Returns the beam pattern of a LiDAR.

    With calibrated returns, the elevations are those of a real unit, if the
    data sheet states them.

    Args:
        config: description of the LiDAR.
        period: duration of a revolution [s]; by default 1 / `config.rate`.

    Raises:
        ValueError: a revolution takes too long or has too many beams, or the
            LiDAR has no columns to choose.
    """
    pattern = make_beam_pattern(
        config.sheet,
        period or 1.0 / config.rate,
        num_columns=config.columns,
        min_range=config.min_range,
        max_range=config.max_range,
    )
    if isinstance(pattern, SpinningPattern):
        number = pattern.num_beams
    else:
        number = pattern.num_firings * pattern.num_lines
    if number > MOST_BEAMS:
        raise ValueError(
            f"{number} beams in a revolution, more than {MOST_BEAMS}; "
            "give fewer rings or columns, or a higher rate"
        )
    if config.returns == "ideal":
        return pattern
    return aimed(pattern, config.sheet.returns)


def describe_unit(config: LidarSection) -> dict[str, Any]:
    """Returns facts about a LiDAR that are stored in its recordings.

    Returns:
        A mapping with the keys `preset` (or, for a data sheet of the user's,
        its `source`), `unit_seed`, and `elevations_deg`: the nominal elevations
        of the lasers [deg], empty for a LiDAR without rings. The true angles
        differ from the nominal elevations by the errors of the individual unit.
    """
    nominal = getattr(make_pattern(config), "elevations_rad", ())
    model = {"preset": config.preset}
    if config.unit is not None:
        model = {"source": config.unit.source}
    return {
        **model,
        "unit_seed": config.unit_seed,
        "elevations_deg": [round(math.degrees(one), 6) for one in nominal],
    }


class LidarModel(NamedTuple):
    """The arguments of `add_lidar` that follow from the description of a LiDAR.

    Attributes:
        pattern: the beams.
        measurement: the model of noise, losses and rounding.
        returns: the model of calibrated returns; None for ideal returns.
    """

    pattern: BeamPattern
    measurement: MeasurementModel
    returns: "CalibratedReturns | None"


def _without_hidden(
    pattern: BeamPattern, hidden_deg: Sequence[float] | None
) -> BeamPattern:
    """Returns a pattern without the beams of a hidden sector."""
    if hidden_deg is None:
        return pattern
    first, last = hidden_deg
    if first == last:
        raise ValueError(f"hidden_deg: {list(hidden_deg)} is no sector")
    try:
        return pattern.within(azimuths_deg=(last, first))
    except ValueError:
        raise ValueError(
            f"hidden_deg: {list(hidden_deg)} is not two azimuths from -180 to"
            " 180, or hides every beam"
        ) from None


def make_lidar_model(
    config: LidarSection,
    name: str,
    seed: int,
    weather: WeatherConfig | None = None,
    period: float | None = None,
) -> LidarModel:
    """Returns the model of a LiDAR that a scenario describes.

    Args:
        config: description of the LiDAR.
        name: name of the LiDAR; other names give other random numbers.
        seed: seed of the random numbers.
        weather: weather of calibrated returns; by default clear.
        period: duration of a revolution [s]; by default 1 / `config.rate`.

    Raises:
        ValueError: see `make_pattern`.
    """
    pattern = _without_hidden(make_pattern(config, period), config.hidden_deg)
    measurement = MeasurementModel(
        resolution=config.resolution,
        range_noise=config.range_noise,
        dropout=config.dropout,
        faint_dropout=config.faint_dropout,
        seed=seed,
        sensor_name=name,
    )
    if config.returns == "ideal":
        return LidarModel(pattern, measurement, None)
    # Slow to import, and not needed to describe a scenario.
    from cns_drake.sensors.returns.calibrated import CalibratedReturns
    from cns_drake.sensors.returns.weather import Weather

    weather = weather or WeatherConfig()
    returns = CalibratedReturns(
        config.sheet.returns,
        config.echoes,
        Weather(**weather.model_dump()),
        seed,
        name,
        config.unit_seed,
    )
    return LidarModel(pattern, measurement, returns)
