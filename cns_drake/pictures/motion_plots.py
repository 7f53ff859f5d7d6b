"""Plots of the speed and the IMU over the time of a drive, for its page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from cns_drake.pictures.drive_record import DriveRecord

# Greatest number of samples in a plot; more would not be visible.
_MAX_SAMPLES = 400
# Size of a plot in units of its own, which the page stretches.
_PLOT_WIDTH = 400.0
_PLOT_HEIGHT = 20.0
# Unit -> least range of a plot. A smaller one would magnify noise.
_LEAST_RANGE = {"km/h": 10.0, "m/s²": 2.0, "deg/s": 10.0}
# Least distance of three labels of a scale, as a share of the plot's height,
# which is 22 pixels on a phone. The digits are 8 pixels high.
_LABEL_SHARE = 0.45
# Possible round values on a scale, for reaches from 1 to 10. They are so near
# to each other that two labels always have space, 9 pixels on a phone.
_ROUND = (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8)
# Possible distances of the times on the scale [s].
_TIME_STEPS = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800)


@dataclass(frozen=True)
class TimePlot:
    """A curve over the time of the drive, as the page's template draws it.

    Attributes:
        name: title of the plot.
        unit: unit of the values: `km/h`, `m/s²` or `deg/s`.
        values: values to display as text, at evenly spaced times of the drive.
        points: the points of the curve, in the format of SVG.
        ticks: labels of the scale, and their positions from the top, as shares
            of the height. Where there is no space for a label, it is empty.
    """

    name: str
    unit: str
    values: str
    points: str
    ticks: Sequence[tuple[str, float]]

    @classmethod
    def of(cls, name: str, unit: str, values: np.ndarray) -> TimePlot:
        """Returns the plot of values over the time of a drive.

        Args:
            name: title of the plot.
            unit: unit of the values: `km/h`, `m/s²` or `deg/s`.
            values: (F,) values, one for each of the drive's F frames, which are
                evenly spaced in time.
        """
        count = min(len(values), _MAX_SAMPLES)
        frames = np.linspace(0, len(values) - 1, count).round().astype(int)
        values = values[frames]
        low, high = min(values.min(), 0.0), max(values.max(), 0.0)
        missing = max(_LEAST_RANGE[unit] - (high - low), 0.0)
        if low < 0.0:  # Zero stays within the plot.
            low -= missing / 2.0
            missing /= 2.0
        high += missing
        x = np.linspace(0.0, _PLOT_WIDTH, count)
        y = _PLOT_HEIGHT * (high - values) / (high - low)
        return cls(
            name,
            unit,
            # Adding 0.0 removes the sign of a negative zero.
            ",".join(f"{value:.1f}" for value in values.round(1) + 0.0),
            " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True)),
            _ticks(low, high),
        )


def _ticks(low: float, high: float) -> list[tuple[str, float]]:
    """Returns ticks for zero, a round value above it, and its negative.

    Values outside of the range from `low` to `high` are left out. A tick is a
    label, and its distance from the top as a share of the height. The label of
    zero is empty if it would touch those above and below it.
    """
    reach = max(-low, high)
    power = 10.0 ** math.floor(math.log10(reach))
    step = max(k * power for k in _ROUND if k * power <= reach)
    values = [value for value in (-step, 0.0, step) if low <= value <= high]
    is_tight = len(values) == 3 and step < _LABEL_SHARE * (high - low)
    return [
        (
            f"{value:g}" if value or not is_tight else "",
            (high - value) / (high - low),
        )
        for value in values
    ]


def time_scale(duration: float) -> list[tuple[str, float]]:
    """Returns up to seven round times, each with its share of the duration."""
    step = next((s for s in _TIME_STEPS if duration <= 6 * s), 3600)
    return [
        (f"{t // 60}:{t % 60:02d}", t / max(duration, 1.0))
        for t in range(0, int(duration) + 1, step)
    ]


def motion_plots(drive: DriveRecord) -> list[TimePlot]:
    """Returns the plots of the speed and the IMU.

    A drive with fewer than two frames has no plots.
    """
    if len(drive.speeds) < 2:
        return []
    forces = np.array(drive.specific_forces_I)
    turns = np.rad2deg(drive.angular_velocities_I)
    return [
        TimePlot.of("Speed", "km/h", 3.6 * np.array(drive.speeds)),
        TimePlot.of("IMU, forward", "m/s²", forces[:, 0]),
        TimePlot.of("IMU, left", "m/s²", forces[:, 1]),
        TimePlot.of("IMU, turn", "deg/s", turns[:, 2]),
    ]
