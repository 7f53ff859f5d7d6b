"""A picture of an imported map from above, with its drives."""

from collections.abc import Sequence
import math
from pathlib import Path
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
import numpy as np

from evaluation.base import figure_style, save_figure
from worlds.imports.colours import WATER, Rgb
from worlds.imports.drives.free_space import CELL, FreeSpace
from worlds.imports.drives.steerable_drives import WaypointRoute
from worlds.imports.faces import joined_triangles
from worlds.imports.imported_objects import ImportedObject
from worlds.shapes import CLASS_RGB

_DPI = 130
# Length of the longer side of the map in the picture [in].
_LONGER_SIDE_INCHES = 9.0
# Least width of the picture, so that the legend fits in [in].
_LEAST_WIDTH_INCHES = 4.0
# Size of tick marks and labels beside the map [in].
_LABELS_INCHES = 0.8
# Width of a column, and height of a row of the legend [in].
_COLUMN_INCHES = 2.0
_ROW_INCHES = 0.2
_ROUTE_COLOURS = ("#d7191c", "#2c7bb6")
_ROUTE_WIDTHS = (5.0, 2.0)  # [pt]
_ROOM_COLOUR = "#ffd92f"
_ROOM_ALPHA = 0.6


@figure_style()
def draw_overview(
    path: Path,
    objects: Sequence[ImportedObject],
    space: FreeSpace | None,
    drives: Sequence[WaypointRoute],
) -> None:
    """Draws a city's objects, the free space for a car and the drives.

    Where two drives share a street, the second drive is a thinner line on top
    of the first, so that both can be seen.

    Args:
        path: image file to write.
        objects: the objects.
        space: the free space; None to draw none.
        drives: the drives, at most two; any further drive is left out.
    """
    corners = joined_triangles(imported.triangles for imported in objects)
    xy = corners.reshape(-1, 3)[:, :2]
    low, high = xy.min(axis=0), xy.max(axis=0)
    if space is not None:
        low = space.low
        high = low + CELL * np.array(space.clearance.shape[::-1])
    figure = Figure(layout="constrained")
    axes = figure.subplots()
    classes = _draw_objects(axes, objects)
    if space is not None:
        classes |= _draw_room(axes, space, low, high)
    legend = _draw_drives(axes, drives) | classes
    axes.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        xlabel="x [m]",
        ylabel="y [m]",
    )
    axes.set_aspect("equal")
    axes.grid(alpha=0.3)
    size = _LONGER_SIDE_INCHES * (high - low) / (high - low).max()
    width = max(size[0] + _LABELS_INCHES, _LEAST_WIDTH_INCHES)
    columns = int(width / _COLUMN_INCHES)
    rows = math.ceil(len(legend) / columns)
    height = size[1] + _LABELS_INCHES + _ROW_INCHES * rows
    figure.set_size_inches(width, height)
    figure.legend(
        legend.values(),
        legend.keys(),
        loc="outside lower center",
        ncols=columns,
    )
    save_figure(figure, path, _DPI, metadata={"Software": None})


def _draw_objects(
    axes: Axes, objects: Sequence[ImportedObject]
) -> dict[str, Artist]:
    """Draws objects except terrain, the ground first; returns the legend."""
    legend: dict[str, Artist] = {}
    for is_ground in (True, False):
        by_colour: dict[Rgb, list[np.ndarray]] = {}
        for imported in objects:
            if (
                imported.is_ground == is_ground
                and imported.object_type != "TINRelief"
            ):
                colour = _colour_of(imported)
                by_colour.setdefault(colour, []).append(imported.triangles)
                name = imported.structure.semantic_class
                if name == "building":
                    name = "building, any colour"
                elif colour == WATER:
                    name = "water"
                legend.setdefault(name, Patch(facecolor=colour))
        for colour, triangles in by_colour.items():
            # The library takes an array faster than a list, but its type hints
            # do not allow it.
            corners_xy: Any = np.concatenate(triangles)[:, :, :2]
            axes.add_collection(
                PolyCollection(
                    corners_xy,
                    facecolors=[colour],
                    # Otherwise fine lines show between triangles.
                    edgecolors="face",
                    linewidths=0.3,
                )
            )
    return legend


def _draw_room(
    axes: Axes, space: FreeSpace, low: np.ndarray, high: np.ndarray
) -> dict[str, Artist]:
    """Draws the free space for a car; returns the legend.

    `low` (2,) contains the least x and y of the free space, and `high` (2,) the
    greatest x and y [m].
    """
    room = np.where(space.clearance >= space.least, 1.0, np.nan)
    axes.imshow(
        room,
        origin="lower",
        extent=(low[0], high[0], low[1], high[1]),
        cmap=ListedColormap([_ROOM_COLOUR]),
        alpha=_ROOM_ALPHA,
        # Above the objects and below the lines.
        zorder=1.5,
    )
    return {"room for a car": Patch(facecolor=_ROOM_COLOUR, alpha=_ROOM_ALPHA)}


def _draw_drives(
    axes: Axes, drives: Sequence[WaypointRoute]
) -> dict[str, Artist]:
    """Draws at most two drives with their starts and ends; returns the legend.

    The names `a` and `b` and the two line styles leave out any further drive.
    """
    legend: dict[str, Artist] = {}
    for letter, drive, rgb, width in zip(
        "ab", drives, _ROUTE_COLOURS, _ROUTE_WIDTHS, strict=False
    ):
        (line,) = axes.plot(*drive.path.T, color=rgb, linewidth=width)
        legend[f"drive {letter}, {drive.length:.0f} m"] = line
        for end, marker, name in ((0, "o", "start"), (-1, "s", "end")):
            axes.plot(
                *drive.path[end],
                marker,
                color=rgb,
                markersize=2 * width + 3,
                markeredgecolor="white",
            )
            legend[name] = Line2D(
                [], [], linestyle="", marker=marker, color="black"
            )
    return legend


def _colour_of(imported: ImportedObject) -> Rgb:
    """Returns the colour of a structure in the picture.

    Plants have the colour of their class, all others that of their first part.
    """
    part = imported.structure.model.parts[0]
    if imported.structure.semantic_class == "vegetation":
        return CLASS_RGB["vegetation"]
    return part.rgb or CLASS_RGB[imported.structure.semantic_class]
