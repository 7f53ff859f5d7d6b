"""Title, legend and buttons of a drive's page."""

from __future__ import annotations

from collections.abc import Sequence, Set
from html import escape
from importlib import resources
import re

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.pictures.meshcat_drawing import (
    END_RGB,
    POINT_HEIGHTS,
    START_RGB,
    height_rgb,
)

Rgb = tuple[float, float, float]

# Colours of change, and their legends.
CHANGE_RGB: dict[str, Rgb] = {
    "absent": (0.86, 0.08, 0.20),
    "lower": (0.96, 0.50, 0.05),
    "additional": (0.60, 0.42, 0.92),
}
_CHANGES = {
    "absent": "not here, but in {other}",
    "lower": "higher in {other}",
    "additional": "not in {other}, or lower there",
}
_SLOT = re.compile(r"\{\{(\w+)\}\}")


def make_panel(
    title: str,
    X_WBs: Sequence[RigidTransform],
    period: float,
    changes: Set[str],
    other_name: str,
    plots: str,
) -> str:
    """Returns the HTML of title, legend and buttons.

    Args:
        title: plain text.
        X_WBs: pose of the vehicle at each frame.
        period: time between frames [s].
        changes: the keys of `CHANGE_RGB` that the page has.
        other_name: the name of the other stage.
        plots: HTML below the time line.
    """
    p_WBset = np.array([X_WB.translation() for X_WB in X_WBs])
    length = np.linalg.norm(np.diff(p_WBset, axis=0), axis=1).sum()
    minutes, seconds = divmod(int((len(X_WBs) - 1) * period), 60)
    lowest, highest = POINT_HEIGHTS
    slots = {
        "style": template("drive.css"),
        "title": escape(title),
        "facts": f"{length / 1000.0:.2f} km in {minutes} min {seconds} s",
        "points": _gradient(height_rgb(np.linspace(lowest, highest, 9))),
        "heights": f"{lowest:g} to {highest:g} m",
        "route": _gradient([START_RGB, END_RGB]),
        "changes": "\n".join(
            f'<dt class="change" style="background: {_hex(rgb)}"></dt>'
            f'<dd class="change">'
            f"{escape(_CHANGES[name].format(other=other_name))}</dd>"
            for name, rgb in CHANGE_RGB.items()
            if name in changes
        ),
        "change_button": "",
        "plots": plots,
    }
    if changes:
        slots["change_button"] = (
            '<button id="change" type="button" aria-pressed="false"'
            f' data-additional="{_hex(CHANGE_RGB["additional"])}">'
            "What changed</button>"
        )
    # One pass: inserted text is not searched for slots.
    return _SLOT.sub(lambda m: slots[m[1]], template("panel.html"))


def template(name: str) -> str:
    """Returns a file of the page's template."""
    folder = resources.files("cns_drake.pictures") / "page_template"
    return (folder / name).read_text(encoding="utf-8")


def _gradient(colors: Sequence[np.ndarray] | np.ndarray) -> str:
    stops = ", ".join(_hex(rgb) for rgb in colors)
    return f"linear-gradient(90deg, {stops})"


def _hex(rgb: Rgb | np.ndarray) -> str:
    return "#" + "".join(f"{round(255.0 * value):02x}" for value in rgb)
