"""Small plots of a drive over time: speed, IMU, stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

# More samples would not be visible.
_MAX_SAMPLES = 400
# Size of a plot in units of its own; the page stretches it.
_WIDTH, _HEIGHT = 400.0, 20.0
# Attribute of the current stage.
_NOW = ' class="now"'
# Least range of a plot: a smaller one would magnify noise.
_LEAST_RANGE = {"km/h": 10.0, "m/s²": 2.0, "deg/s": 10.0}


@dataclass(frozen=True)
class Curve:
    """One curve.

    Attributes:
        name: its name in the page.
        unit: a key of `_LEAST_RANGE`.
        values: (F,) one for each frame.
    """

    name: str
    unit: str
    values: np.ndarray


def motion_curves(
    speeds: Sequence[float],
    specific_forces_I: Sequence[np.ndarray],
    angular_velocities_I: Sequence[np.ndarray],
) -> list[Curve]:
    """Returns the curves of a drive.

    Args:
        speeds: forward speed of the vehicle at each frame [m/s].
        specific_forces_I: (3,) at each frame, in the IMU's frame I [m/s^2].
        angular_velocities_I: likewise w_WI_I [rad/s].
    """
    forces = np.reshape(specific_forces_I, (-1, 3))
    turns = np.rad2deg(np.reshape(angular_velocities_I, (-1, 3)))
    return [
        Curve("Speed", "km/h", 3.6 * np.asarray(speeds, dtype=float)),
        Curve("IMU, forward", "m/s²", forces[:, 0]),
        Curve("IMU, left", "m/s²", forces[:, 1]),
        Curve("IMU, turn", "deg/s", turns[:, 2]),
    ]


def make_plots(
    curves: Sequence[Curve], stage: str | None, stages: Sequence[str]
) -> str:
    """Returns the HTML of the plots; without frames there are none.

    Args:
        curves: what to plot, all over the same frames.
        stage: the stage of the drive, if its world has stages.
        stages: all stages of the map, the earliest first.
    """
    rows = [_plot(curve) for curve in curves if len(curve.values) > 1]
    if stage is not None and len(stages) > 1:
        boxes = "".join(
            f"<b{_NOW if one == stage else ''}>{escape(one)}</b>"
            for one in stages
        )
        rows.append(f'<div class="stages"><span>Stage</span>{boxes}</div>')
    return "\n".join(rows)


def _plot(curve: Curve) -> str:
    """Returns one plot: name, value at the time shown, curve."""
    count = min(len(curve.values), _MAX_SAMPLES)
    frames = np.linspace(0, len(curve.values) - 1, count).round().astype(int)
    values = curve.values[frames]
    low, high = min(values.min(), 0.0), max(values.max(), 0.0)
    missing = max(_LEAST_RANGE[curve.unit] - (high - low), 0.0)
    if low < 0.0:  # Zero stays within the plot.
        low -= missing / 2.0
        missing /= 2.0
    high += missing
    x = np.linspace(0.0, _WIDTH, count)
    y = _HEIGHT * (high - values) / (high - low)
    zero = _HEIGHT * high / (high - low)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    texts = ",".join(f"{value:.1f}" for value in values)
    return (
        f'<div class="plot"><span>{escape(curve.name)}</span>'
        f'<output data-unit="{curve.unit}" data-values="{texts}"></output>'
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" preserveAspectRatio="none">'
        f'<line x2="{_WIDTH:g}" y1="{zero:.1f}" y2="{zero:.1f}"></line>'
        f'<polyline points="{points}"></polyline></svg></div>'
    )
