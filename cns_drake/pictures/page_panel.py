"""The panel of a drive's web page: title, switches, legend and plots."""

import base64
from collections.abc import Sequence, Set
from dataclasses import dataclass
from importlib import resources

import numpy as np

from cns_drake.base.polylines import length_of
from cns_drake.pictures import meshcat_drawing as drawing
from cns_drake.pictures.drive_record import DriveRecord
from cns_drake.pictures.motion_plots import motion_plots, time_scale
from cns_drake.scene.world import World

Rgb = tuple[float, float, float]

# Kind of change -> its colour.
CHANGE_RGB: dict[str, Rgb] = {
    "absent": (0.86, 0.08, 0.20),
    "lower": (0.96, 0.50, 0.05),
    "additional": (0.60, 0.42, 0.92),
}
# Kind of change -> its text in the legend.
_CHANGE_TEXTS = {
    "absent": "not here, but in {other}",
    "lower": "higher in {other}",
    "additional": "not in {other}, or lower there",
}


@dataclass(frozen=True)
class ShownStages:
    """The stages that the page of a drive shows.

    Attributes:
        other: a stage with which the stage of the drive is compared; None to
            show no differences.
        other_name: name of this other stage.
        stage: name of the stage of the drive; None if the drive has no map.
        stages: names of all stages of the map, the earliest first.
    """

    other: World | None = None
    other_name: str = "the other stage"
    stage: str | None = None
    stages: Sequence[str] = ()


def make_panel(
    title: str, drive: DriveRecord, changes: Set[str], shown: ShownStages
) -> str:
    """Returns the HTML of the page's title, switches, legend and plots.

    Args:
        title: title of the page.
        drive: record of the drive.
        changes: kinds of change that the page shows, keys of `CHANGE_RGB`.
        shown: the stages of the city that the page shows.
    """
    # Only pages need templates, and the import takes a moment.
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    p_WBset = np.array([X_WB.translation() for X_WB in drive.X_WBs])
    length = length_of(p_WBset)
    duration = (len(p_WBset) - 1) * drive.period
    minutes, seconds = divmod(round(duration), 60)
    took = f"{minutes} min {seconds} s" if minutes else f"{seconds} s"
    metres = round(length)
    way = f"{metres} m" if metres < 1000 else f"{length / 1000.0:.2f} km"
    lowest, highest = drawing.POINT_HEIGHTS
    environment = Environment(
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.from_string(read_template("panel.html")).render(
        style=Markup(read_template("drive.css")),
        title=title,
        facts=f"{way} in {took}",
        points=_gradient(drawing.height_rgb(np.linspace(lowest, highest, 9))),
        heights=f"{lowest:g} to {highest:g} m",
        route=_hex(drawing.ROUTE_RGB),
        colours={name: _hex(rgb) for name, rgb in CHANGE_RGB.items()},
        changes={
            name: words.format(other=shown.other_name)
            for name, words in _CHANGE_TEXTS.items()
            if name in changes
        },
        shown_points=_shown_points(drive),
        plots=motion_plots(drive),
        times=time_scale(duration),
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
    )


def _shown_points(drive: DriveRecord) -> str:
    """Returns a sentence that says which part of the points the page shows."""
    if not drive.num_points:
        return ""
    most = max(len(p_WRset) for _, p_WRset in drive.scans)
    return (
        f"Shown: {len(drive.scans)} of {len(drive.X_WBs)} scans, up to "
        f"{most:,} of {max(drive.num_points):,} points"
    )


def read_template(name: str) -> str:
    """Returns a file of the page, such as `drive.js`."""
    folder = resources.files("cns_drake.pictures") / "page_template"
    return (folder / name).read_text(encoding="utf-8")


def _gradient(colours: Sequence[np.ndarray] | np.ndarray) -> str:
    return f"linear-gradient(90deg, {', '.join(map(_hex, colours))})"


def _hex(rgb: Rgb | np.ndarray) -> str:
    return "#" + "".join(f"{round(255.0 * value):02x}" for value in rgb)
