"""Values from the data sheets of the presets' units.

If a sheet lacks a value, a similar unit's is used, and `unknown` names the
field.
"""

from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np

from cns_drake.base.elementary import exp, log
from cns_drake.sensors.returns.link_budget import (
    LinkBudget,
    SheetRow,
    fit_link_budget,
)

# Speed of light [m/s].
_LIGHT = 299_792_458.0


@dataclass(frozen=True)
class Response:
    """How a unit makes intensities of energy; no sheet states it.

    Attributes:
        scale, exponent: a diffuse target has the intensity `scale` times the
            energy to the power of `exponent`, of what it has by the sheet.
        fades: whether only what exceeds the threshold of detection counts.
        floor: lower intensities are reported as 0.
        zeros: part of all shots that report 0 without a cause.
        gain: standard deviation of a laser's gain.
        speckle: that of single shots, as a part of the intensity.
    """

    scale: float = 1.0
    exponent: float = 1.0
    fades: bool = False
    floor: float = 0.0
    zeros: float = 0.0
    gain: float = 0.05
    speckle: float = 0.1

    @cached_property
    def table(self) -> np.ndarray:
        """Intensities of diffuse targets, at even steps of the energy's root.

        Logarithms of all points would take half a frame.
        """
        root = np.linspace(0.0, 1.0, 4097)
        power = 2.0 * self.exponent * log(np.maximum(root, 1e-6))
        return self.scale * exp(power)


@dataclass(frozen=True)
class Head:
    """Where the lasers of a unit sit, and how it reports its turn.

    Attributes:
        heights: the lowest elevation of each block of lasers [deg], and its
            height above the origin [m], from the top.
        tick_deg: azimuths are reported in steps of this; 0 for exact ones.
            Then each laser has an azimuth of its own, up to one step aside
            [deg].
    """

    heights: tuple[tuple[float, float], ...] = ((-90.0, 0.0),)
    tick_deg: float = 0.0


@dataclass(frozen=True)
class UnitSheet:
    """The data sheet of a unit.

    Attributes:
        rows: ranges at stated reflectivities, at most two.
        range_noise: standard deviation of a range at an SNR of 1 [m].
        range_floor: the best stated accuracy or precision, as the standard
            deviation of a range at any SNR [m].
        divergence_deg: full angle of the beam at 1 / e^2 of its peak [deg].
        pulse_ns: width of its pulse at half of the peak [ns].
        retro_from: the intensity at which retro-reflectors begin; diffuse
            targets have 0 to this for reflectivities of 0 to 1.
        unknown: fields that the sheet does not state.
        source: where the numbers are from.
        angle_error_deg: standard deviation of a laser's elevation and azimuth
            [deg].
        own_part: the part of the best accuracy that is each laser's own; the
            rest is each shot's: the squares add up to 1.
        response: its intensities.
        head: the places of its lasers.
    """

    rows: tuple[SheetRow, ...]
    range_noise: float
    range_floor: float
    divergence_deg: float
    pulse_ns: float
    retro_from: float
    unknown: tuple[str, ...]
    source: str
    angle_error_deg: float = 0.03
    own_part: float = 0.8
    response: Response = Response()
    head: Head = Head()

    @property
    def budget(self) -> LinkBudget:
        return fit_link_budget(
            self.rows, self.range_noise, self.range_floor, self.range_bias
        )

    @property
    def range_bias(self) -> float:
        """Standard deviation of a laser's own error of range [m]."""
        return self.own_part * self.range_floor

    @property
    def divergence(self) -> float:
        """Half angle of the beam at 1 / e^2 of its peak [rad]."""
        return math.radians(self.divergence_deg) / 2.0

    @property
    def resolution(self) -> float:
        """Distance below which two echoes are one [m]."""
        return _LIGHT * self.pulse_ns * 1e-9 / 2.0


def _rows(
    far: tuple[float, float, float], near: tuple[float, float, float] | None
) -> tuple[SheetRow, ...]:
    rows = [SheetRow(*far)]
    if near is not None:
        rows.append(SheetRow(*near))
    return tuple(rows)


def _ouster(
    far: tuple[float, float, float],
    near: tuple[float, float, float],
    divergence_deg: float,
    source: str,
) -> UnitSheet:
    # Ranges of the first OS1 scatter by 10, 3 and 1.5 cm at an SNR of 12, 100
    # and 250: 0.30 m / sqrt(SNR) in the middle, and nowhere below 1.5 cm.
    return UnitSheet(
        _rows(far, near),
        0.30,
        0.015,
        divergence_deg,
        4.0,
        100.0,
        ("pulse_ns",),
        source,
        0.01,
    )


_OS1 = _ouster(
    (0.8, 120.0, 0.9),
    (0.1, 40.0, 0.9),
    0.18,
    "Ouster OS1 data sheet, first generation: 120 m at 80 %, 40 m at 10 %, "
    "both with 90 % detection at 100 klx; 0.18 deg",
)

UNIT_SHEETS: dict[str, UnitSheet] = {
    "cns": _OS1,
    "os1-32": _OS1,
    "os1-64": _OS1,
    "os1-128": _OS1,
    "os1-64-33": _OS1,
    "os1-128-42": _ouster(
        (0.8, 170.0, 0.9),
        (0.1, 90.0, 0.9),
        0.35,
        "Ouster OS1 data sheet rev. 7: 170 m at 80 %, 90 m at 10 %, 90 % "
        "detection at 100 klx; 0.35 deg",
    ),
    "os0-128": _ouster(
        (0.8, 50.0, 0.9),
        (0.1, 20.0, 0.9),
        0.35,
        "Ouster OS0 data sheet: 50 m at 80 %, 20 m at 10 %, 90 % detection at "
        "100 klx; 0.35 deg",
    ),
    "vlp-16": UnitSheet(
        _rows((0.8, 100.0, 0.9), None),
        0.10,
        0.03,
        0.18,
        6.0,
        100.0,
        ("probability", "range at 10 %"),
        "Velodyne VLP-16 user manual: 100 m, typical accuracy 3 cm, 3 mrad, "
        "pulses of 6 ns, diffuse targets 0 to 100 and retro-reflectors above",
    ),
    "hdl-64e": UnitSheet(
        _rows((0.8, 120.0, 0.9), (0.1, 50.0, 0.9)),
        0.15,
        0.02,
        0.11,
        5.0,
        100.0,
        ("probability",),
        "Velodyne HDL-64E manual: 120 m for cars and foliage (reflectivity "
        "about 0.8), 50 m for pavement (about 0.1), below 2 cm, 2 mrad, 5 ns; "
        "response, errors of lasers and steps of azimuths fitted to the first "
        "eleven scans of KITTI odometry 00; heights of blocks rounded from the "
        "calibration of an S2.1 in ROS's velodyne_pointcloud",
        0.05,
        0.9,
        Response(0.57, 0.3, True, 4.0, 0.05, 0.1, 0.1),
        Head(((-8.5, 0.2), (-90.0, 0.115)), 0.09),
    ),
    "hdl-32e": UnitSheet(
        _rows((0.8, 100.0, 0.9), None),
        0.10,
        0.02,
        0.18,
        6.0,
        100.0,
        ("probability", "range at 10 %", "divergence_deg", "pulse_ns"),
        "Velodyne HDL-32E manual: 100 m, typical accuracy 2 cm",
    ),
    "alpha-prime": UnitSheet(
        _rows((0.1, 220.0, 0.9), None),
        0.10,
        0.03,
        0.18,
        6.0,
        100.0,
        ("probability", "range at 80 %", "divergence_deg", "pulse_ns"),
        "Velodyne Alpha Prime data sheet: 220 m at 10 %, typical accuracy 3 cm",
    ),
    "hesai-pandar64": UnitSheet(
        _rows((0.1, 200.0, 0.9), None),
        0.10,
        0.02,
        0.11,
        5.0,
        100.0,
        ("probability", "range at 80 %", "divergence_deg", "pulse_ns"),
        "Hesai Pandar64 user manual: 200 m at 10 %, 2 cm",
    ),
    "hesai-pandar-xt32": UnitSheet(
        _rows((0.8, 120.0, 0.9), (0.1, 80.0, 0.9)),
        0.03,
        0.005,
        0.09,
        3.0,
        100.0,
        ("probability", "range at 80 %", "divergence_deg", "pulse_ns"),
        "Hesai PandarXT-32 user manual: 80 m at 10 %, 120 m at most, "
        "0.5 cm typical precision",
    ),
    "hokuyo-ust-20lx": UnitSheet(
        _rows((0.9, 20.0, 0.9), (0.1, 8.0, 0.9)),
        0.10,
        0.03,
        0.3,
        4.0,
        100.0,
        ("probability", "divergence_deg", "pulse_ns", "retro_from"),
        "Hokuyo UST-20LX specification: 20 m on white paper (0.9), 8 m at "
        "10 %, repeated accuracy below 3 cm",
    ),
    "mid-70": UnitSheet(
        _rows((0.8, 260.0, 0.9), (0.1, 90.0, 0.9)),
        0.06,
        0.02,
        0.28,
        6.0,
        150.0,
        ("probability", "pulse_ns"),
        "Livox Mid-70 user manual: 260 m at 80 %, 90 m at 10 %, 2 cm, "
        "0.28 x 0.03 deg, diffuse targets 0 to 150",
    ),
    "avia": UnitSheet(
        _rows((0.8, 320.0, 0.9), (0.1, 190.0, 0.9)),
        0.06,
        0.02,
        0.28,
        6.0,
        150.0,
        ("probability", "pulse_ns"),
        "Livox Avia user manual: 320 m at 80 %, 190 m at 10 %, 2 cm, "
        "0.28 x 0.03 deg, diffuse targets 0 to 150",
    ),
    "mid-360": UnitSheet(
        _rows((0.8, 70.0, 0.9), (0.1, 40.0, 0.9)),
        0.06,
        0.02,
        0.9,
        6.0,
        150.0,
        ("probability", "divergence_deg", "pulse_ns"),
        "Livox Mid-360 user manual: 70 m at 80 %, 40 m at 10 %, 2 cm, diffuse "
        "targets 0 to 150",
    ),
}
