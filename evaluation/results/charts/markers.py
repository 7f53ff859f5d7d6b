"""Markers of charts as polygons, for legends that a page writes itself."""

from matplotlib.markers import MarkerStyle
import numpy as np


def marker_corners(marker: str) -> str:
    """Returns the points of an SVG polygon that shows a marker of a chart.

    The polygon is 8 px wide around (18, 6), the middle of a line in a legend.

    Args:
        marker: the marker, in the terms of Matplotlib.
    """
    style = MarkerStyle(marker)
    path = style.get_path().transformed(style.get_transform())
    # SVG's y points down.
    corners = np.array(path.to_polygons()[0]) * (8, -8) + (18, 6)
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
