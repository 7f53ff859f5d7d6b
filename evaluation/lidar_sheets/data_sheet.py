"""The data sheet of a LiDAR, and its reader."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from itertools import pairwise
import math
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from evaluation.base import (
    InputError,
    InputModel,
    no_such,
    read_yaml,
    validated,
)

if TYPE_CHECKING:
    from typing_extensions import Self

# Speed of light [m/s].
_LIGHT = 299_792_458.0
# Most rings of a sheet: four times those of the largest units.
MOST_RINGS = 512
# Most beams of a revolution: each takes some 100 bytes while a scan is made.
MOST_BEAMS = 2**22
# Farthest range [m].
_FARTHEST = 1000.0
# Longest revolution [s]: points have room for firing times up to 4.29 s.
LONGEST_PERIOD = 4.0
# Shortest revolution [s]; no unit turns that fast.
_SHORTEST = 1e-3

_Elevation = Annotated[float, Field(ge=-90.0, le=90.0)]


def _one_ring(entry: Any) -> Any:
    """Returns a single elevation as a block of one ring."""
    is_number = isinstance(entry, int | float) and not isinstance(entry, bool)
    return (entry, entry, 1) if is_number else entry


# From the first elevation [deg] to the last, in this number of even steps.
_Rings = Annotated[
    tuple[_Elevation, _Elevation, Annotated[int, Field(ge=1, le=MOST_RINGS)]],
    BeforeValidator(_one_ring),
]
_Columns = Annotated[int, Field(ge=4, le=8192)]


class _Part(InputModel):
    """A part of a data sheet, which cannot be changed after it was made."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def replaced(self, **fields: Any) -> Self:
        """Returns a copy with some fields replaced, without checks."""
        return type(self).model_construct(**{**dict(self), **fields})


class Response(_Part):
    """How a unit converts energy to intensity; no data sheet states this.

    Attributes:
        slope: the intensity of a diffuse target is `full` plus `slope` times
            the natural logarithm of its energy. With 0, it is proportional to
            energy, as the data sheet says.
        full: intensity of an energy of 1, if `slope` is not 0.
        far: range up to which the unit compensates intensity for distance [m],
            if `slope` is not 0; with a slope of 0, it does so at every range.
        floor: least intensity. Lower intensities are reported as 0, whatever
            the gain.
        least: least energy of a reported echo, even at close range, where the
            unit reduces its power.
        gain: standard deviation of the gain over the lasers; the mean gain is
            1.
        dim: lowers the gains of dim lasers: the part of a gain that is more
            than one standard deviation below the mean is multiplied by 1 +
            `dim`.
        flicker: standard deviation over the lasers of the fraction of the
            intensity, constant for a laser, by which its shots are alternately
            brighter and darker.
        speckle: standard deviation of the intensity of single shots, as a
            fraction of the intensity.
    """

    slope: float = Field(default=0.0, ge=0.0, le=1e4)
    full: float = Field(default=0.0, ge=0.0, le=1e4)
    far: float = Field(default=math.inf, gt=0.0)
    floor: float = Field(default=0.0, ge=0.0, le=1e4)
    least: float = Field(default=0.0, ge=0.0, le=1.0)
    gain: float = Field(default=0.05, ge=0.0, le=1.0)
    dim: float = Field(default=0.0, ge=0.0, le=100.0)
    flicker: float = Field(default=0.0, ge=0.0, le=1.0)
    speckle: float = Field(default=0.1, ge=0.0, le=1.0)


class Head(_Part):
    """Positions of the lasers of a unit, and how the unit reports azimuths.

    Attributes:
        blocks: for each block of lasers, from the top: lowest elevation [deg],
            height above the origin [m], and a factor by which the range errors
            are multiplied.
        alternate: range offset [m], part of the lasers' constant range errors:
            every second laser, starting with the first, measures ranges that
            are too long by this offset, and the others ranges that are too
            short by it.
        tick_deg: step in which azimuths are reported [deg]; 0 for exact
            azimuths. With a step, each laser has an azimuth offset of up to one
            step.
        elevations_deg: elevation of each laser of one real unit, from the top;
            empty if only the nominal elevations are known.
    """

    blocks: tuple[
        tuple[
            _Elevation,
            Annotated[float, Field(ge=-10.0, le=10.0)],
            Annotated[float, Field(ge=0.0, le=100.0)],
        ],
        ...,
    ] = Field(default=((-90.0, 0.0, 1.0),), min_length=1, max_length=MOST_RINGS)
    alternate: float = Field(default=0.0, ge=0.0, le=10.0)
    tick_deg: float = Field(default=0.0, ge=0.0, le=10.0)
    elevations_deg: tuple[_Elevation, ...] = Field(
        default=(), max_length=MOST_RINGS
    )

    @field_validator("blocks")
    @classmethod
    def _check_blocks(cls, given: tuple) -> tuple:
        _check_descending([lowest for lowest, _, _ in given])
        return given

    @field_validator("elevations_deg")
    @classmethod
    def _check_order(cls, given: tuple[float, ...]) -> tuple[float, ...]:
        _check_descending(given)
        return given


# The SNR that a unit detects in half of all cases: Ouster's sheet of the OS1
# (first generation) states 10 cm of range noise at an SNR of 12, its lowest.
THRESHOLD_SNR = 9.0


class SheetRow(NamedTuple):
    """A row of a data sheet: how well a target is detected at a range.

    The target is Lambertian and faces the unit.

    Attributes:
        reflectivity: reflectivity of the target, 0 to 1.
        range: range of the target [m].
        probability: probability that the target is detected.
    """

    reflectivity: Annotated[float, Field(ge=1e-3, le=1.0)]
    range: Annotated[float, Field(ge=1e-3, le=_FARTHEST)]
    probability: Annotated[float, Field(gt=0.0, lt=1.0)]

    @property
    def snr(self) -> float:
        """The SNR at which a target is detected with this probability."""
        # `detection_probability` of the link budget, solved for the root.
        z = NormalDist().inv_cdf(self.probability)
        root = (z + math.sqrt(z * z + 4.0 * THRESHOLD_SNR)) / 2.0
        return root * root

    @property
    def log_strength(self) -> float:
        """Logarithm of the SNR of a target of reflectivity 1 at 1 m.

        This is what the row says if the SNR falls with the square of the range.
        """
        return math.log(self.snr * self.range**2 / self.reflectivity)


class ReturnsSheet(_Part):
    """What a data sheet says of a unit's beams, noise and returns.

    Only [calibrated returns](../scenarios.md#calibrated-returns) use these
    fields. The defaults are typical of spinning units.

    Attributes:
        rows: one or two rows of `[reflectivity, range (m), probability of
            detection]`; by default a target of 80 % is detected at the greatest
            range with a probability of 90 %.
        range_noise: standard deviation of a range at an SNR of 1 [m].
        range_floor: the best stated accuracy or precision, as the standard
            deviation of a range at any SNR [m].
        divergence_deg: full angle of the beam at 1 / e^2 of its peak [deg].
        pulse_ns: width of a pulse at half of its peak [ns].
        retro_from: least intensity of retro-reflectors. Diffuse targets with
            reflectivities from 0 to 1 have intensities from 0 to this value.
        angle_error_deg: standard deviation of a laser's elevation and azimuth
            [deg].
        own_part: fraction of `range_floor` that is a constant error of a laser.
            The rest varies from shot to shot; the squares of both fractions add
            up to 1.
        response: how the unit converts energy to intensity.
        head: positions of the lasers.
        unknown: what the data sheet does not state, in words.
    """

    rows: tuple[SheetRow, ...] = Field(min_length=1, max_length=2)
    range_noise: float = Field(default=0.10, ge=0.0, le=10.0)
    range_floor: float = Field(default=0.03, ge=0.0, le=10.0)
    divergence_deg: float = Field(default=0.18, gt=0.0, le=10.0)
    pulse_ns: float = Field(default=6.0, gt=0.0, le=1000.0)
    retro_from: float = Field(default=100.0, gt=0.0, le=255.0)
    angle_error_deg: float = Field(default=0.03, ge=0.0, le=10.0)
    own_part: float = Field(default=0.8, ge=0.0, le=1.0)
    response: Response = Response()
    head: Head = Head()
    unknown: tuple[str, ...] = Field(default=(), max_length=100)

    @field_validator("rows")
    @classmethod
    def _check_rows(cls, rows: tuple[SheetRow, ...]) -> tuple[SheetRow, ...]:
        if len({row.range for row in rows}) < len(rows):
            raise ValueError("two rows have the same range")
        for near, far in pairwise(sorted(rows, key=lambda row: row.range)):
            if (
                far.reflectivity <= near.reflectivity
                and far.probability >= near.probability
            ):
                raise ValueError(
                    f"a target of {far.reflectivity:g} cannot be detected as "
                    f"well, and farther, than one of {near.reflectivity:g}"
                )
        return rows

    @model_validator(mode="after")
    def _check_falling(self) -> Self:
        self.check_range(max(row.range for row in self.rows))
        return self

    @field_validator("head")
    @classmethod
    def _check_alternate(cls, head: Head, info: ValidationInfo) -> Head:
        if {"own_part", "range_floor"} <= info.data.keys():
            most = info.data["own_part"] * info.data["range_floor"]
            if head.alternate > most:
                raise ValueError(
                    f"alternate: {head.alternate:g} is more than range_floor "
                    f"times own_part, {most:g}"
                )
        return head

    def check_range(self, farthest: float) -> None:
        """Checks that echoes get weaker with the range, up to a range [m].

        Raises:
            ValueError: the rows say that they get stronger.
        """
        # exp(-2 a r) / r^2 falls with r as long as a r > -1.
        extinction = self.own_extinction
        if extinction * farthest <= -1.0:
            raise ValueError(
                "rows: these two say that echoes get stronger with the range "
                f"from {-1.0 / extinction:.1f} m on; the brighter target must "
                "be detected farther or more often"
            )

    @property
    def own_extinction(self) -> float:
        """The constant alpha_0 of the link budget [1/m]; 0 with one row."""
        if len(self.rows) == 1:
            return 0.0
        first, second = self.rows
        way = 2.0 * (second.range - first.range)
        return (first.log_strength - second.log_strength) / way

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


class LidarSheet(_Part, ABC):
    """The data sheet of a LiDAR: the fields of every kind of LiDAR.

    Attributes:
        pattern: kind of LiDAR: `spinning`, `rosette` or `nodding`. Each kind
            has further fields.
        ranges: nearest and farthest measured range [m].
        period: duration of a revolution, or of a frame of a LiDAR that does not
            spin [s]; by default 0.05 s for a spinning LiDAR, and 0.1 s for
            others. In a drive, the field `rate` sets the duration.
        source: where the numbers come from, in words.
        returns: width of the beams, noise, and strength of the returns.
    """

    pattern: str
    ranges: tuple[
        Annotated[float, Field(ge=0.0, le=_FARTHEST)],
        Annotated[float, Field(gt=0.0, le=_FARTHEST)],
    ]
    period: float = Field(ge=_SHORTEST, le=LONGEST_PERIOD)
    source: str = Field(min_length=1, max_length=2000)
    returns: ReturnsSheet = Field(
        default_factory=dict,
        validate_default=True,
    )

    @field_validator("ranges")
    @classmethod
    def _check_ranges(cls, given: tuple[float, float]) -> tuple[float, float]:
        if given[0] >= given[1]:
            raise ValueError(
                f"{given[0]:g} is not below {given[1]:g}; give the nearest, "
                "then the farthest range"
            )
        return given

    @field_validator("returns", mode="before")
    @classmethod
    def _fill_rows(cls, given: Any, info: ValidationInfo) -> Any:
        """Gives the returns their default rows."""
        if not isinstance(given, Mapping) or "ranges" not in info.data:
            return given
        return {"rows": [[0.8, info.data["ranges"][1], 0.9]], **given}

    @field_validator("returns")
    @classmethod
    def _check_falling(
        cls, given: ReturnsSheet, info: ValidationInfo
    ) -> ReturnsSheet:
        if "ranges" in info.data:
            given.check_range(info.data["ranges"][1])
        return given

    @property
    @abstractmethod
    def num_rings(self) -> int:
        """Number of rings, one for each laser."""

    @property
    @abstractmethod
    def field_deg(self) -> tuple[float, float]:
        """Lowest and highest elevation of a beam [deg]."""

    def to_fields(self) -> dict[str, Any]:
        """Returns the fields that differ from their defaults, for JSON."""
        return self.model_dump(mode="json", exclude_defaults=True)

    def with_rings(self, number: int) -> LidarSheet:
        """Returns a sheet with evenly spaced rings between the same limits.

        Raises:
            ValueError: the LiDAR does not spin, so that it has no rings, its
                limits are one elevation, or there would be too many beams.
        """
        raise ValueError("rings: only a spinning LiDAR has rings")


class SpinningSheet(LidarSheet):
    """A LiDAR that spins: `pattern: spinning`, or no pattern.

    All lasers of a column fire at once. Column 0 points to the rear, and the
    LiDAR turns clockwise, seen from above; `azimuths_deg` changes both.

    Attributes:
        rings_deg: elevations of the rings from ring 0, the highest, downwards.
            Each entry is a block of evenly spaced rings, `[first, last,
            number]`, or a single elevation [deg].
        elevations_deg: elevations of all rings one by one, the highest first;
            an alternative to `rings_deg`.
        columns: number of columns (azimuths) per revolution.
        azimuths_deg: azimuths of the first and the last column, if the columns
            do not fill the circle; counted to the left from straight ahead. The
            order of the two also says which way the LiDAR turns [deg].
        fires_steadily: whether the lasers fire at a fixed rate, so that a
            slower revolution has more columns.
    """

    pattern: Literal["spinning"] = "spinning"
    rings_deg: tuple[_Rings, ...] | None = Field(
        default=None, max_length=MOST_RINGS
    )
    elevations_deg: tuple[_Elevation, ...] | None = Field(
        default=None, max_length=MOST_RINGS, validate_default=True
    )
    columns: _Columns
    azimuths_deg: (
        tuple[
            Annotated[float, Field(ge=-360.0, le=360.0)],
            Annotated[float, Field(ge=-360.0, le=360.0)],
        ]
        | None
    ) = None
    fires_steadily: bool = False
    period: float = Field(default=0.05, ge=_SHORTEST, le=LONGEST_PERIOD)

    @field_validator("rings_deg")
    @classmethod
    def _check_rings(cls, given: tuple | None) -> tuple | None:
        if given is not None:
            for first, last, count in given:
                if count == 1 and first != last:
                    raise ValueError(
                        f"one ring cannot be at {first:g} and {last:g}"
                    )
            number = sum(count for _, _, count in given)
            if number == 0:
                raise ValueError("there is no ring")
            if number > MOST_RINGS:
                raise ValueError(f"{number} rings, more than {MOST_RINGS}")
            _check_descending(_spread(given))
        return given

    @field_validator("elevations_deg")
    @classmethod
    def _check_elevations(
        cls, given: tuple[float, ...] | None, info: ValidationInfo
    ) -> tuple[float, ...] | None:
        # An invalid earlier field has its own error.
        if "rings_deg" in info.data:
            has_rings = info.data["rings_deg"] is not None
            if has_rings and given is not None:
                raise ValueError("give either these or rings_deg")
            if not has_rings and given is None:
                raise ValueError("missing; give these or rings_deg")
        if given == ():
            raise ValueError("there is no ring")
        _check_descending(given or ())
        return given

    @field_validator("columns")
    @classmethod
    def _check_beams(cls, columns: int, info: ValidationInfo) -> int:
        rings = info.data.get("rings_deg")
        number = len(info.data.get("elevations_deg") or ())
        if rings is not None:
            number = sum(count for _, _, count in rings)
        _check_num_beams(number * columns, f"{number} rings x {columns}")
        return columns

    @model_validator(mode="after")
    def _check_lasers(self) -> Self:
        own = len(self.returns.head.elevations_deg)
        if own not in (0, self.num_rings):
            raise ValueError(
                f"returns.head.elevations_deg: {own} elevations of "
                f"{self.num_rings} rings"
            )
        return self

    @field_validator("azimuths_deg")
    @classmethod
    def _check_azimuths(
        cls, given: tuple[float, float] | None
    ) -> tuple[float, float] | None:
        if given is not None and not 0.0 < abs(given[1] - given[0]) <= 360.0:
            raise ValueError(f"{list(given)} is no range within 360 deg")
        return given

    @property
    def elevations(self) -> tuple[float, ...]:
        """Elevation of each ring, from ring 0, the highest [deg]."""
        if self.elevations_deg is not None:
            return self.elevations_deg
        assert self.rings_deg is not None  # One of the two is given.
        return tuple(_spread(self.rings_deg).tolist())

    @property
    def num_rings(self) -> int:
        return len(self.elevations)

    @property
    def field_deg(self) -> tuple[float, float]:
        return self.elevations[-1], self.elevations[0]

    def with_rings(self, number: int) -> SpinningSheet:
        lowest, highest = self.field_deg
        if lowest == highest:
            raise ValueError(
                f"rings: all rings of the data sheet are at {lowest:g} deg"
            )
        _check_num_beams(number * self.columns, f"rings: {number}")
        # The lasers of a real unit are not those of other rings.
        head = self.returns.head.replaced(elevations_deg=())
        return self.replaced(
            rings_deg=((highest, lowest, number),),
            elevations_deg=None,
            returns=self.returns.replaced(head=head),
        )


class _TimedSheet(LidarSheet):
    """The data sheet of a LiDAR whose pattern does not repeat."""

    num_lines: int = Field(default=1, ge=1, le=MOST_RINGS)
    points_per_second: float = Field(gt=0.0, le=1e8)
    period: float = Field(default=0.1, ge=_SHORTEST, le=LONGEST_PERIOD)

    @field_validator("points_per_second")
    @classmethod
    def _check_beams(cls, rate: float, info: ValidationInfo) -> float:
        _check_num_beams(rate * info.data.get("period", 0.0), f"{rate:g}")
        return rate

    @property
    def num_rings(self) -> int:
        return self.num_lines


class RosetteSheet(_TimedSheet):
    """A LiDAR with two rotating prisms, such as Livox's: `pattern: rosette`.

    Attributes:
        num_lines: number of lasers, which fire together.
        points_per_second: number of beams per second.
        fov_deg: full opening angle of the disc that a laser scans [deg].
        height_deg: angle between the highest and the lowest laser [deg].
    """

    pattern: Literal["rosette"]
    fov_deg: float = Field(gt=0.0, le=180.0)
    height_deg: float = Field(default=0.0, ge=0.0, lt=180.0)

    @property
    def field_deg(self) -> tuple[float, float]:
        most = min(0.5 * (self.fov_deg + self.height_deg), 90.0)
        return -most, most


class NoddingSheet(_TimedSheet):
    """A LiDAR whose beams rotate and slowly nod: `pattern: nodding`.

    Attributes:
        num_lines: number of lasers, which fire together.
        points_per_second: number of beams per second.
        elevations_deg: lowest and highest elevation [deg].
    """

    pattern: Literal["nodding"]
    elevations_deg: tuple[_Elevation, _Elevation]

    @field_validator("elevations_deg")
    @classmethod
    def _check_limits(cls, given: tuple[float, float]) -> tuple[float, float]:
        if given[0] >= given[1]:
            raise ValueError("not the lowest, then the highest elevation")
        return given

    @property
    def field_deg(self) -> tuple[float, float]:
        return self.elevations_deg


_KINDS: dict[str, type[LidarSheet]] = {
    "spinning": SpinningSheet,
    "rosette": RosetteSheet,
    "nodding": NoddingSheet,
}


def make_sheet(values: object, source: object) -> LidarSheet:
    """Returns a data sheet, given its fields.

    Args:
        values: the fields, a mapping.
        source: the file or field that error messages name.

    Raises:
        InputError: a field is missing, unknown or not usable.
    """
    if not isinstance(values, Mapping):
        raise InputError(f"{source}: not a mapping of a data sheet's fields")
    pattern = values.get("pattern", "spinning")
    kind = _KINDS.get(pattern) if isinstance(pattern, str) else None
    if kind is None:
        fault = no_such("kind", pattern, _KINDS)
        raise InputError(f"{source}: pattern: {fault}")
    return validated(kind, values, source)


def read_sheet(path: Path) -> LidarSheet:
    """Reads the data sheet of a LiDAR.

    Raises:
        InputError: the file cannot be read, or is no data sheet.
    """
    return make_sheet(read_yaml(path), path)


def _spread(rings: tuple[tuple[float, float, int], ...]) -> np.ndarray:
    """Returns the elevation of each ring [deg]."""
    return np.concatenate([np.linspace(*block) for block in rings])


def _check_descending(elevations_deg: Any) -> None:
    if (np.diff(elevations_deg) > 0.0).any():
        raise ValueError("elevations ascend; give the highest first")


def _check_num_beams(number: float, what: str) -> None:
    if number > MOST_BEAMS:
        raise ValueError(
            f"{what}: {number:.0f} beams in a revolution, more than "
            f"{MOST_BEAMS}"
        )
