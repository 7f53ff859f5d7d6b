"""The panel of a drive's web page: title, switches, legend and plots."""

from __future__ import annotations

import base64
from collections.abc import Sequence, Set
from dataclasses import dataclass
from importlib import resources
import math
from typing import Any

import numpy as np

from cns_drake.pictures import meshcat_drawing as drawing
from cns_drake.pictures.city_parts import PassedChange
from cns_drake.pictures.drive_record import DriveRecord, ScanRecord
from cns_drake.scene import World
from evaluation.base import GONE_RGB, NEW_RGB, length_of
from worlds.shapes import CLASS_IDS, MOVING_IDS

Rgb = tuple[float, float, float]

# Class -> colour of its points: SemanticKITTI's. They stand out from the city,
# which has its own colours.
_POINT_RGB = {
    "unlabeled": (120, 120, 120),
    "car": (100, 150, 245),
    "bicycle": (100, 230, 245),
    "bus": (100, 80, 250),
    "motorcycle": (30, 60, 150),
    "truck": (80, 30, 180),
    "other-vehicle": (0, 0, 255),
    "person": (255, 30, 30),
    "bicyclist": (255, 40, 200),
    "motorcyclist": (150, 30, 90),
    "road": (255, 0, 255),
    "parking": (255, 150, 255),
    "sidewalk": (75, 0, 75),
    "other-ground": (175, 0, 75),
    "building": (255, 200, 0),
    "fence": (255, 120, 50),
    "other-structure": (255, 150, 0),
    "vegetation": (0, 175, 0),
    "trunk": (135, 60, 0),
    "terrain": (150, 240, 80),
    "pole": (255, 240, 150),
    "traffic-sign": (255, 0, 0),
    "other-object": (50, 255, 255),
}
_POINT_CLASSES = list(_POINT_RGB)
# The kind of a point is the place of its class in this list and, if only the
# drive's own stage has what it lies on, this bit.
_CHANGED_BIT = 128
# Points on what both stages have.
_SAME_RGB = (150, 156, 164)

# Side of the divider -> colour of what only this side has.
_CHANGE_RGB = {"before": GONE_RGB, "after": NEW_RGB}
_OTHER_SIDE = {"before": "after", "after": "before"}
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
class ShownStages:
    """The stages that the page of a drive shows.

    Attributes:
        other: a stage with which the stage of the drive is compared; None to
            show no differences.
        other_name: name of this other stage.
        is_earlier: whether the other stage is the earlier one.
        stage: name of the stage of the drive; None if the drive has no map.
        stages: names of all stages of the map, the earliest first.
        city: name of the map, or of the world's file.
    """

    other: World | None = None
    other_name: str = "the other stage"
    is_earlier: bool = False
    stage: str | None = None
    stages: Sequence[str] = ()
    city: str = ""

    def sides(self) -> tuple[str, str]:
        """Returns the names of the earlier and of the later stage."""
        own = "this drive" if self.stage is None else f"stage {self.stage}"
        names = own, self.other_name
        return names[::-1] if self.is_earlier else names


def point_kinds(labels: np.ndarray, is_changed: np.ndarray) -> np.ndarray:
    """Returns what the page knows of each point, its kind.

    Args:
        labels: (N,) class ids of the points.
        is_changed: (N,) whether only the stage of the drive has the structure.

    Returns:
        (N,) uint8 kinds.
    """
    table = np.zeros(max(CLASS_IDS.values()) + 2**10, np.uint8)
    for name, number in (*CLASS_IDS.items(), *MOVING_IDS.items()):
        if name in _POINT_RGB:
            table[number] = _POINT_CLASSES.index(name)
    return table[labels] + np.uint8(_CHANGED_BIT) * is_changed


def make_panel(
    title: str,
    drive: DriveRecord,
    sides: Set[str],
    changes: Sequence[PassedChange],
    shown: ShownStages,
) -> str:
    """Returns the HTML of the page's title, switches, legend and plots.

    Args:
        title: title of the page.
        drive: record of the drive.
        sides: what the page shows of a change, `before` and `after`.
        changes: the greatest changes.
        shown: the stages of the city that the page shows.
    """
    # Only pages need templates, and the import takes a moment.
    from markupsafe import Markup

    p_WBset = np.array([X_WB.translation() for X_WB in drive.X_WBs])
    length = length_of(p_WBset)
    duration = (len(p_WBset) - 1) * drive.period
    minutes, seconds = divmod(round(duration), 60)
    took = f"{minutes} min {seconds} s" if minutes else f"{seconds} s"
    metres = round(length)
    way = f"{metres} m" if metres < 1000 else f"{length / 1000.0:.2f} km"
    lowest, highest = drawing.POINT_HEIGHTS
    weakest, strongest = drive.scans.intensities or (0.0, 1.0)
    own = "after" if shown.is_earlier else "before"
    colours = {
        name: _hex(np.array(rgb) / 255.0) for name, rgb in _CHANGE_RGB.items()
    }
    names = shown.sides()
    told = {"before": f"gone after {names[0]}", "after": f"new in {names[1]}"}
    return fill_template(
        "panel.html",
        style=Markup(read_template("drive.css")),
        title=title,
        facts=f"{way} in {took}",
        heights=(f"{lowest:g}", f"{highest:g}"),
        intensities=(f"{weakest:.2g}", f"{strongest:.2g}"),
        scale=[_hex(rgb) for rgb in drawing.scale_rgb(np.linspace(0, 1, 9))],
        classes=[
            (name, _hex(np.array(rgb) / 255.0))
            for name, rgb in _POINT_RGB.items()
        ],
        same=_hex(np.array(_SAME_RGB) / 255.0),
        route=_hex(drawing.ROUTE_RGB),
        colours=colours,
        own=own,
        told=told,
        drawn=sides,
        sides=names,
        places=[
            (
                f"{change.frame * drive.period:.2f}",
                f"{change.kind.capitalize()}, {change.height:.0f} m high, "
                + told[own if change.is_own else _OTHER_SIDE[own]],
                ",".join(f"{x:.1f}" for x in change.place),
                own if change.is_own else _OTHER_SIDE[own],
            )
            for change in changes
        ],
        scans=_scans_text(drive.scans),
        sensors=drive.sensors,
        plots=motion_plots(drive),
        times=_time_scale(duration),
        traffic=bool(drive.names),
        cameras={
            name: [
                (f"{k * drive.period:.2f}", base64.b64encode(jpeg).decode())
                for k, jpeg in images
            ]
            for name, images in drive.images.items()
        },
        stage=shown.stage,
        stages=shown.stages,
        city=shown.city,
    )


def fill_template(name: str, **values: Any) -> str:
    """Returns a template of the page, filled in."""
    # Only pages need templates, and the import takes a moment.
    from jinja2 import Environment, StrictUndefined

    environment = Environment(
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.from_string(read_template(name)).render(**values)


def _scans_text(record: ScanRecord) -> str:
    """Returns a sentence that says which scans the page shows."""
    if not record.scans:
        return ""
    most = max(scan.num_points for scan in record.scans)
    part = (
        "every scan" if record.stride == 1 else f"one scan in {record.stride}"
    )
    return f"LiDAR: the last 3 s, {part}, up to {most:,} points a scan"


def read_template(name: str) -> str:
    """Returns a file of the page, such as `drive.js`."""
    folder = resources.files("cns_drake.pictures") / "page_template"
    return (folder / name).read_text(encoding="utf-8")


def _hex(rgb: Rgb | np.ndarray) -> str:
    return "#" + "".join(f"{round(255.0 * value):02x}" for value in rgb)


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


def _time_scale(duration: float) -> list[tuple[str, float]]:
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
