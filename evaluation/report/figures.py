"""Pictures of the maps: the routes, and the change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
import numpy as np
from scipy.spatial import cKDTree

from evaluation.change.tcr import TAU, TemporalChange
from evaluation.geometry.hull import in_convex_hull
from evaluation.geometry.nearest import NearestPoints
from evaluation.maps.voxel_maps import VoxelMap
from evaluation.report.drawing import PIXELS, Legend, plain, save, unit
from evaluation.report.point_rendering import (
    Picture,
    View,
    colour_by_height,
    render,
    shade_by_height,
)

_UNCHANGED = (214, 214, 214)
_CHANGED = (196, 18, 24)
_ABSENT_OUTSIDE = (240, 170, 160)
# Sets O and H: blue and vermilion differ for all kinds of colour vision.
_IN_O = (120, 170, 215)
_ONLY_IN_H = (213, 94, 0)
_OUTSIDE_H = (228, 228, 228)
CHANGE_LEGEND: Legend = (
    (_CHANGED, "absent from the other"),
    (_ABSENT_OUTSIDE, "absent, outside the other's hull: not counted"),
    (_UNCHANGED, "unchanged"),
)
SETS_LEGEND: Legend = (
    (_IN_O, "O: in H and unchanged"),
    (_ONLY_IN_H, "in H, changed"),
    (_OUTSIDE_H, "outside H"),
)
# The view from above is coloured like a plan: streets pale, walls dark.
_GROUND = (226, 229, 232)
_HIGHEST = (72, 88, 112)

_OBLIQUE = View(azimuth_deg=-55.0, elevation_deg=38.0, pixels_per_metre=3.0)
_SMALL_OBLIQUE = View(
    azimuth_deg=-55.0, elevation_deg=38.0, pixels_per_metre=1.8
)
_FROM_ABOVE = View(azimuth_deg=-90.0, elevation_deg=90.0, pixels_per_metre=2.5)
# Red at the start and blue at the end, as in the paper.
ROUTE_COLOURS = "turbo_r"
# Margin of a view from above around the route [m].
_MARGIN = 60.0
_SCALE_BAR = 50.0
_ROUTE_POINTS = 400
_PANEL_INCHES = 4.2


@dataclass(frozen=True)
class Stage:
    """The drawn data of one drive.

    Attributes:
        name: of the stage, e.g. `04`.
        fine: (K, 3) cloud for pictures, in W [m].
        coarse: map on the grid of the TCR.
        positions: (N, 3) of the sensor [m].
    """

    name: str
    fine: np.ndarray
    coarse: VoxelMap
    positions: np.ndarray


@dataclass(frozen=True)
class SeenRoute:
    """A route in its surroundings.

    Attributes:
        name: of the stage, e.g. `04`.
        view: of its surroundings from above.
        positions: (N, 3) of the sensor [m].
    """

    name: str
    view: Picture
    positions: np.ndarray


def judge_points(
    points: np.ndarray, other: np.ndarray, tau: float = TAU
) -> tuple[np.ndarray, np.ndarray]:
    """Applies the two tests of the TCR to the points of a finer map.

    Args:
        points: (N, 3) of one map, on any grid [m].
        other: (M, 3) voxel centroids of the other map, M > 0 [m].
        tau: distance up to which a point has a counterpart [m].

    Returns:
        (N,) bool, whether there is no counterpart in the other map;
        (N,) bool, whether the point lies in the other map's hull, so that
        this counts.
    """
    # A distance beyond the bound only counts as far away, so the search stops
    # there.
    _, distances = NearestPoints(other).find(points, 2.0 * tau)
    return distances > tau, in_convex_hull(points, other)


def top_view(points: np.ndarray, positions: np.ndarray) -> Picture:
    """Returns the surroundings of a route from above, x to the right.

    Args:
        points: (K, 3) cloud for pictures, in W [m].
        positions: (N, 3) of the sensor along the route [m].
    """
    low, high = positions[:, :2].min(axis=0), positions[:, :2].max(axis=0)
    near = (
        (points[:, :2] >= low - _MARGIN) & (points[:, :2] <= high + _MARGIN)
    ).all(axis=1)
    if not near.any():
        near[:] = True
    shown = points[near]
    rgb = colour_by_height(shown[:, 2], _GROUND, _HIGHEST)
    return render(shown, rgb, _FROM_ABOVE)


def draw_routes(map_name: str, routes: Sequence[SeenRoute], stem: Path) -> None:
    """Draws the routes of a city over their maps, red to blue, from above.

    Args:
        map_name: of the city.
        routes: one for each of its stages.
        stem: path to write, without ending.
    """
    figure, grid = _picture_grid([route.view for route in routes])
    for axes, route in zip(grid, routes, strict=True):
        _show(axes, route.view)
        _draw_route(axes, route.view.project(route.positions))
        axes.set_title(plain(f"{map_name} {route.name}"), fontsize=9)
    save(figure, stem, PIXELS)


def draw_change(
    map_name: str,
    earlier: Stage,
    later: Stage,
    change: TemporalChange,
    stems: tuple[Path, Path],
) -> None:
    """Draws what changed between two stages, and the sets behind the TCR.

    The metric alone decides on a colour. In the first figure, red is a point
    without a counterpart in the other map. It is pale where the point lies
    outside the other map's hull: the other drive may not have passed there, and
    the TCR does not count the point. The second shows the sets H and O in both
    orders and united; a point has the colour of its voxel.

    Args:
        map_name: of the city.
        earlier: stage A.
        later: stage B.
        change: from A to B.
        stems: paths to write, without endings.
    """
    stages = (earlier, later)
    _draw_absent(map_name, stages, stems[0])
    _draw_sets(map_name, stages, change, stems[1])


def voxel_of_each(points: np.ndarray, coarse: VoxelMap) -> np.ndarray:
    """Returns the voxel of their map in which each point lies.

    By a rounding error a point on a border may have been counted on its other
    side. The occupied voxel with the nearest centre is taken therefore.

    Args:
        points: (N, 3) of the points that made the map [m].
        coarse: their map.

    Returns:
        (N,) index into the coarse map.
    """
    owners = coarse.find(points)
    elsewhere = np.flatnonzero(owners < 0)
    if len(elsewhere):
        _, nearest = cKDTree(coarse.centres_W).query(points[elsewhere])
        owners[elsewhere] = nearest
    return owners


def _draw_absent(
    map_name: str, stages: tuple[Stage, Stage], stem: Path
) -> None:
    pictures = []
    for stage, other in zip(stages, stages[::-1], strict=True):
        absent, in_hull = judge_points(stage.fine, other.coarse.centroids_W)
        rgb = np.full((len(absent), 3), _UNCHANGED, dtype=np.uint8)
        rgb[absent] = _ABSENT_OUTSIDE
        rgb[absent & in_hull] = _CHANGED
        pictures.append(_render_shaded(stage.fine, rgb, _OBLIQUE))
    figure, grid = _picture_grid(pictures)
    names = [stage.name for stage in stages]
    titles = (
        f"{map_name} {names[0]}: what {names[1]} lacks",
        f"{map_name} {names[1]}: what {names[0]} lacks",
    )
    for axes, picture, text in zip(grid, pictures, titles, strict=True):
        _show(axes, picture)
        axes.set_title(plain(text), fontsize=9)
    _show_legend(figure, CHANGE_LEGEND)
    save(figure, stem, PIXELS)


def _draw_sets(
    map_name: str,
    stages: tuple[Stage, Stage],
    change: TemporalChange,
    stem: Path,
) -> None:
    clouds, colours = [], []
    sides = (change.source_to_target, change.target_to_source)
    for stage, side in zip(stages, sides, strict=True):
        rgb = np.full((len(stage.coarse), 3), _OUTSIDE_H, dtype=np.uint8)
        rgb[side.in_hull] = _ONLY_IN_H
        rgb[side.unchanged] = _IN_O
        rgb = rgb[voxel_of_each(stage.fine, stage.coarse)]
        clouds.append(stage.fine)
        colours.append(rgb)
    clouds.append(np.concatenate(clouds))
    colours.append(np.concatenate(colours))
    pictures = [
        _render_shaded(cloud, rgb, _SMALL_OBLIQUE)
        for cloud, rgb in zip(clouds, colours, strict=True)
    ]
    figure, grid = _picture_grid(pictures)
    first, last = (stage.name for stage in stages)
    titles = (
        f"H({first}, {last}): TCR {change.source_to_target.ratio:.4f}",
        f"H({last}, {first}): TCR {change.target_to_source.ratio:.4f}",
        f"union: TCR_sym {change.symmetric:.4f}",
    )
    for axes, picture, text in zip(grid, pictures, titles, strict=True):
        _show(axes, picture)
        axes.set_title(plain(f"{map_name} {text}"), fontsize=9)
    _show_legend(figure, SETS_LEGEND)
    save(figure, stem, PIXELS)


def _render_shaded(points: np.ndarray, rgb: np.ndarray, view: View) -> Picture:
    return render(
        points, shade_by_height(rgb, points[:, 2], darkest=0.85), view
    )


def _picture_grid(pictures: Sequence[Picture]) -> tuple[Figure, np.ndarray]:
    """Returns a figure with a column of equal height for each picture."""
    shapes = [(e[1] - e[0], e[3] - e[2]) for e in (p.extent for p in pictures)]
    tallest = max(height / width for width, height in shapes)
    figure = Figure(
        figsize=(
            _PANEL_INCHES * len(pictures),
            _PANEL_INCHES * min(tallest, 1.6) + 0.4,
        ),
        layout="constrained",
    )
    grid = figure.subplots(1, len(pictures), squeeze=False)[0]
    return figure, grid


def _show(axes: Axes, picture: Picture) -> None:
    """Shows a picture, axes in metres, with a scale bar."""
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


def _draw_route(axes: Axes, line: np.ndarray) -> None:
    """Draws a route (N, 2) with a triangle at its start, a square at end."""
    # A picture has too few pixels for more points. Each piece is drawn by
    # itself.
    number = min(len(line), _ROUTE_POINTS)
    line = line[np.linspace(0, len(line) - 1, number).round().astype(int)]
    segments = LineCollection(
        list(np.stack([line[:-1], line[1:]], axis=1)),
        cmap=ROUTE_COLOURS,
        array=np.linspace(0.0, 1.0, max(len(line) - 1, 1)),
        linewidths=2.0,
        capstyle="round",
    )
    axes.add_collection(segments)
    for point, marker, label in (
        (line[0], "^", "start"),
        (line[-1], "s", "end"),
    ):
        axes.plot(*point, marker, color="black", markersize=6, label=label)
    axes.legend(fontsize=7, loc="upper right", framealpha=0.8)


def _show_legend(figure: Figure, entries: Legend) -> None:
    figure.legend(
        handles=[
            Patch(color=unit(colour), label=label) for colour, label in entries
        ],
        loc="outside lower center",
        ncols=len(entries),
        frameon=False,
        fontsize=8,
    )
