"""Colours, line styles and markers, the same in all figures."""

from collections.abc import Sequence
from typing import NamedTuple

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


# Style of each method. All kinds of colour vision can distinguish these colours
# by Okabe and Ito. Line styles and markers are for prints without colour.
METHOD_STYLES = {
    "ring++": MethodStyle("#0072B2", "-", "o"),
    "btc": MethodStyle("#D55E00", "--", "s"),
    "scan-context++": MethodStyle("#009E73", "-.", "^"),
    "solid": MethodStyle("#CC79A7", ":", "D"),
    "layered-overlap": MethodStyle("#E69F00", "-", "v"),
    "learned": MethodStyle("#56B4E9", "--", "P"),
}
# Styles of methods that are not shipped.
_OTHERS = (
    MethodStyle("#000000", "-.", "X"),
    MethodStyle("#8C564B", ":", "p"),
    MethodStyle("#882255", "-", "<"),
    MethodStyle("#44AA99", "--", ">"),
    MethodStyle("#999933", "-.", "h"),
    MethodStyle("#6F6F6F", ":", "*"),
)

# Colours of what belongs to no method.
INK = "#1C2430"
PALE = "#7A8594"
# Colour of points that are in the older of two maps alone.
GONE = (214, 48, 49)
# Colour of points that are in the newer of two maps alone.
NEW = (38, 96, 214)
# Colours (red, green, blue) and what they mean.
Legend = tuple[tuple[tuple[int, int, int], str], ...]


def unit_rgb(rgb: tuple[int, int, int]) -> tuple[float, float, float]:
    """Returns a colour scaled from [0, 255] to [0, 1], for matplotlib."""
    red, green, blue = rgb
    return red / 255.0, green / 255.0, blue / 255.0


def method_styles(labels: Sequence[str]) -> dict[str, MethodStyle]:
    """Returns the style of each method in a figure.

    Args:
        labels: names of the methods, with their settings.

    Returns:
        Method as written in the legend (see `title`) -> its style.
    """
    others = [name for name in labels if name not in METHOD_STYLES]
    return {
        title(name): METHOD_STYLES.get(name)
        or _OTHERS[others.index(name) % len(_OTHERS)]
        for name in labels
    }
