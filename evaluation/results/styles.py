"""Colours, line styles and markers, the same in all figures."""

from collections.abc import Sequence
from typing import NamedTuple

from evaluation.methods import METHODS
from evaluation.results.method_names import title


class MethodStyle(NamedTuple):
    """How a method is drawn, in the terms of Matplotlib.

    Attributes:
        colour: the colour, as hexadecimal digits.
        line: the line style; empty in a legend whose chart has no such line.
        marker: the marker.
    """

    colour: str
    line: str
    marker: str


# Styles of methods without a style of their own. All kinds of colour vision can
# distinguish the colours of the standard methods, by Okabe and Ito. Line styles
# and markers are for prints without colour.
_OTHERS = (
    MethodStyle("#D81B60", "-.", "X"),
    MethodStyle("#8C564B", ":", "p"),
    MethodStyle("#882255", "-", "<"),
    MethodStyle("#44AA99", "--", ">"),
    MethodStyle("#999933", "-.", "h"),
    MethodStyle("#6F6F6F", ":", "*"),
)

# Colours of what belongs to no method.
INK = "#1C2430"
PALE = "#7A8594"
# Matplotlib's parameters in which our figures differ from its defaults: open
# panels over a pale grid, and legends without a frame.
FIGURE_STYLE = {
    "axes.axisbelow": True,
    "axes.edgecolor": PALE,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": "medium",
    "figure.labelsize": "medium",
    "figure.titlesize": "large",
    "grid.alpha": 0.4,
    "legend.frameon": False,
    "lines.markersize": 5.0,
}
# Colours (red, green, blue) and what they mean.
Legend = tuple[tuple[tuple[int, int, int], str], ...]


def unit_rgb(rgb: tuple[int, int, int]) -> tuple[float, float, float]:
    """Returns a colour scaled from [0, 255] to [0, 1], for matplotlib."""
    red, green, blue = rgb
    return red / 255.0, green / 255.0, blue / 255.0


def method_styles(labels: Sequence[str]) -> dict[str, MethodStyle]:
    """Returns the style of each method in a figure.

    Args:
        labels: names of all methods of a page, with their settings. Methods
            without a style of their own get theirs by their place among
            `labels`.

    Returns:
        Method as written in the legend (see `title`) -> its style.
    """
    styles = {}
    num_others = 0
    for name in labels:
        style = method_style(name)
        if style is None:
            style = _other_style(num_others)
            num_others += 1
        styles[title(name)] = style
    return styles


def method_style(name: str) -> MethodStyle | None:
    """Returns a method's own style; None if it has none."""
    known = METHODS.get(name)
    return MethodStyle(*known.style) if known and known.style else None


def _other_style(number: int) -> MethodStyle:
    """Returns one of several styles, which differ as long as possible."""
    size = len(_OTHERS)
    colour = _OTHERS[number % size].colour
    # In the next round, each colour has another line and marker.
    _, line, marker = _OTHERS[(number + number // size) % size]
    return MethodStyle(colour, line, marker)
