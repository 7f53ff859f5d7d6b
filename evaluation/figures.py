"""Figures: what changed, where the routes lead, precision over recall."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
import numpy as np
from scipy.spatial import cKDTree

from evaluation.files import completing
from evaluation.hull import in_convex_hull
from evaluation.maps import VoxelMap
from evaluation.place_recognition import PlaceRecognition
from evaluation.point_rendering import Picture, View, render, shade_by_height
from evaluation.tcr import TAU

_UNCHANGED = (214, 214, 214)
_CHANGED = (196, 18, 24)
_ABSENT_OUTSIDE = (240, 170, 160)

_OBLIQUE = View(azimuth_deg=-55.0, elevation_deg=38.0, pixels_per_metre=4.0)
_FROM_ABOVE = View(azimuth_deg=-90.0, elevation_deg=90.0, pixels_per_metre=4.0)
# Red at the start and blue at the end, as in the paper.
_ROUTE_COLOURS = "turbo_r"
# Okabe and Ito's colours, told apart by all kinds of colour vision; line
# styles for prints without colour.
_CURVE_STYLES = (
    ("#0072B2", "-"),
    ("#D55E00", "--"),
    ("#009E73", "-."),
    ("#CC79A7", ":"),
    ("#E69F00", "-"),
    ("#56B4E9", "--"),
)
_SCALE_BAR = 50.0
_DPI = 200


def judge_points(
    points: np.ndarray, other: np.ndarray, tau: float = TAU
) -> tuple[np.ndarray, np.ndarray]:
    """Asks the two questions of the TCR of the points of a finer map.

    Args:
        points: (N, 3) of one map, on any grid [m].
        other: (M, 3) voxel centroids of the other map, M > 0 [m].
        tau: distance up to which a point has a counterpart [m].

    Returns:
        (N,) bool, whether there is no counterpart in the other map;
        (N,) bool, whether the point lies in the other map's hull, so that
        this counts.
    """
    # Far away is all that matters; the bound saves the search beyond.
    distances, _ = cKDTree(other).query(points, distance_upper_bound=2.0 * tau)
    return distances > tau, in_convex_hull(points, other)


def draw_change(
    points: VoxelMap,
    other: VoxelMap,
    names: tuple[str, str],
    path: Path,
) -> None:
    """Draws a map with what another one lacks in red.

    Nothing but the metric decides on the colour. Red is a point without a
    counterpart in the other map. It is pale where the point lies outside the
    other map's hull: there the other drive may just not have looked, and the
    TCR does not count it.

    Args:
        points: fine map to draw.
        other: the other map, on the grid of the TCR.
        names: of the two.
        path: PNG file to write.
    """
    absent, in_hull = judge_points(points.centroids_W, other.centroids_W)
    rgb = np.empty((len(points), 3), dtype=np.uint8)
    rgb[:] = _UNCHANGED
    rgb[absent] = _ABSENT_OUTSIDE
    rgb[absent & in_hull] = _CHANGED
    picture = render(
        points.centroids_W,
        shade_by_height(rgb, points.centroids_W[:, 2], darkest=0.85),
        _OBLIQUE,
    )
    figure, axes = _picture_axes(picture)
    axes.legend(
        handles=[
            Patch(color=_unit(_CHANGED), label=f"absent from {names[1]}"),
            Patch(
                color=_unit(_ABSENT_OUTSIDE),
                label="absent, outside its hull: not counted",
            ),
            Patch(color=_unit(_UNCHANGED), label=f"{names[0]}, unchanged"),
        ],
        loc="lower left",
        frameon=False,
        fontsize=8,
    )
    _save(figure, path)


def draw_route(
    points: VoxelMap, positions: np.ndarray, name: str, path: Path
) -> None:
    """Draws a route over its map from above, red at its start, blue at end.

    Args:
        points: fine map.
        positions: (N, 3) of the sensor along the drive [m].
        name: of the drive.
        path: PNG file to write.
    """
    rgb = np.empty((len(points), 3), dtype=np.uint8)
    rgb[:] = _UNCHANGED
    picture = render(
        points.centroids_W,
        shade_by_height(rgb, points.centroids_W[:, 2], darkest=0.6),
        _FROM_ABOVE,
    )
    figure, axes = _picture_axes(picture)
    line = picture.project(positions)
    segments = LineCollection(
        np.stack([line[:-1], line[1:]], axis=1),
        cmap=_ROUTE_COLOURS,
        array=np.linspace(0.0, 1.0, max(len(line) - 1, 1)),
        linewidths=2.0,
        capstyle="round",
    )
    axes.add_collection(segments)
    axes.set_title(f"{name}: from red to blue", fontsize=9)
    _save(figure, path)


def draw_pr_curves(
    title: str, results: Sequence[tuple[str, PlaceRecognition]], path: Path
) -> None:
    """Draws the precision-recall curves of some pairs or methods.

    Args:
        title: of the figure.
        results: label of each curve, and what it shows.
        path: file to write; its ending tells the format (PDF, PNG).
    """
    figure = Figure(figsize=(4.5, 3.6), layout="constrained")
    axes = figure.add_subplot()
    for index, (label, result) in enumerate(results):
        curve = result.metrics.curve
        colour, style = _CURVE_STYLES[index % len(_CURVE_STYLES)]
        # From recall 0 on with the precision of the first point: the area
        # that is drawn is the AUC.
        recall = np.concatenate([[0.0], curve.recall])
        precision = np.concatenate([curve.precision[:1], curve.precision])
        axes.plot(
            recall[: len(precision)],
            precision,
            color=colour,
            linestyle=style,
            linewidth=1.6,
            label=f"{label} (AUC {result.metrics.auc:.3f})",
        )
    axes.set(
        xlabel="recall",
        ylabel="precision",
        xlim=(0.0, 1.0),
        ylim=(0.0, 1.02),
    )
    axes.set_title(title, fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
    _save(figure, path)


def _picture_axes(picture: Picture):
    """Returns a figure of the picture's size, axes in metres, a scale bar."""
    height, width = picture.image.shape[:2]
    figure = Figure(figsize=(width / _DPI, height / _DPI + 0.3))
    axes = figure.add_axes((0.0, 0.0, 1.0, height / (height + 0.3 * _DPI)))
    axes.imshow(
        picture.image, extent=picture.extent, interpolation="antialiased"
    )
    axes.set_axis_off()
    left, right, bottom, top = picture.extent
    end = right - 0.03 * (right - left)
    base = bottom + 0.03 * (top - bottom)
    axes.plot([end - _SCALE_BAR, end], [base, base], color="black", linewidth=2)
    axes.annotate(
        f"{_SCALE_BAR:.0f} m",
        (end - 0.5 * _SCALE_BAR, base),
        xytext=(0, 3),
        textcoords="offset points",
        ha="center",
        fontsize=8,
    )
    axes.set(xlim=(left, right), ylim=(bottom, top))
    return figure, axes


def _save(figure: Figure, path: Path) -> None:
    FigureCanvasAgg(figure)
    kind = path.suffix.removeprefix(".")
    # No time of creation: equal input gives equal bytes.
    metadata = {"CreationDate": None} if kind == "pdf" else None
    with completing(path) as part:
        figure.savefig(part, format=kind, dpi=_DPI, metadata=metadata)


def _unit(rgb: tuple[int, int, int]) -> tuple[float, ...]:
    return tuple(value / 255.0 for value in rgb)
