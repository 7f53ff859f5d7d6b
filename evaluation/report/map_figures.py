"""Pictures of the maps: the routes, and the change."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
import numpy as np
from scipy.spatial import cKDTree

from evaluation.change.drive_change import ChangeResult
from evaluation.change.tcr import judge_points
from evaluation.maps.voxel_maps import VoxelMap
from evaluation.report.point_rendering import (
    OrthographicView,
    Picture,
    colour_by_height,
    render,
    shade_by_height,
)
from evaluation.results.figure_files import PIXELS, save_figure
from evaluation.results.figure_text import escape_dollars
from evaluation.results.styles import Legend, unit_rgb

_UNCHANGED = (214, 214, 214)
_CHANGED = (196, 18, 24)
_ABSENT_OUTSIDE = (240, 170, 160)
# Sets O and H: blue and vermilion differ for all kinds of colour vision.
_IN_O = (120, 170, 215)
_ONLY_IN_H = (213, 94, 0)
_OUTSIDE_H = (228, 228, 228)
CHANGE_LEGEND: Legend = (
    (_CHANGED, "only in this map"),
    (
        _ABSENT_OUTSIDE,
        "only in this map, where the maps' hulls do not overlap: not counted",
    ),
    (_UNCHANGED, "in both maps"),
)
SETS_LEGEND: Legend = (
    (_IN_O, "unchanged (set O)"),
    (_ONLY_IN_H, "changed (in set H, not in O)"),
    (_OUTSIDE_H, "outside the other map's hull H: not counted"),
)
# The view from above is coloured like a plan: streets pale, walls dark.
_GROUND = (226, 229, 232)
_HIGHEST = (72, 88, 112)

# Red at the start and blue at the end, as in the paper.
ROUTE_COLOURS = "turbo_r"
# Margin of a view from above around the route [m].
_MARGIN = 60.0
# Length of the scale bar [m].
_SCALE_BAR = 50.0
# Greatest number of points of a drawn route.
_ROUTE_POINTS = 400
# Width of a panel [inches].
_PANEL_INCHES = 4.2

_OBLIQUE = OrthographicView(
    azimuth_deg=-55.0, elevation_deg=38.0, pixels_per_metre=3.0
)
_SMALL_OBLIQUE = replace(_OBLIQUE, pixels_per_metre=1.8)
_FROM_ABOVE = OrthographicView(
    azimuth_deg=-90.0, elevation_deg=90.0, pixels_per_metre=2.5
)


def top_view(points: np.ndarray, positions: np.ndarray) -> Picture:
    """Returns a picture of a route's surroundings from above, x to the right.

    Args:
        points: (K, 3) cloud in W [m].
        positions: (N, 3) positions of the sensor along the route in W [m].
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


def draw_routes(
    map_name: str,
    stages: Sequence[str],
    views: Sequence[Picture],
    routes: Sequence[np.ndarray],
    stem: Path,
) -> None:
    """Draws routes on pictures from above, and saves the figure.

    Each route is red at its start and blue at its end.

    Args:
        map_name: name of the map, for the titles.
        stages: stage of each picture.
        views: picture of each stage from above.
        routes: (M, 3) positions in W along the route through each stage [m].
        stem: path of the files without the ending.
    """
    _draw_panels(
        [f"{map_name} {stage}" for stage in stages],
        views,
        stem,
        routes=[
            view.project(route)
            for view, route in zip(views, routes, strict=True)
        ],
    )


def draw_change(
    result: ChangeResult,
    clouds: tuple[np.ndarray, np.ndarray],
    maps: tuple[VoxelMap, VoxelMap],
    stems: tuple[Path, Path],
) -> None:
    """Draws what changed between two stages, in two figures.

    The first figure shows both maps. Points without a counterpart in the other
    map are red; they are pale red outside the other map's convex hull, where
    the change ratio (TCR) does not count them, because the other drive may not
    have passed these points. The second figure shows the sets of points from
    which TCR is computed: points in the other map's hull, and unchanged points.

    Args:
        result: the change between the stages.
        clouds: (K, 3) clouds of the earlier and of the later stage in W [m].
        maps: voxel maps of the earlier and of the later stage.
        stems: paths of the two figures without the ending.
    """
    titles, pictures = [], []
    for one, other in ((0, 1), (1, 0)):
        absent, in_hull = judge_points(clouds[one], maps[other].centroids_W)
        rgb = np.full((len(absent), 3), _UNCHANGED, dtype=np.uint8)
        rgb[absent] = _ABSENT_OUTSIDE
        rgb[absent & in_hull] = _CHANGED
        stage, lacking = result.stages[one], result.stages[other]
        titles.append(f"{result.map_name} {stage}: what {lacking} lacks")
        pictures.append(_render_shaded(clouds[one], rgb, _OBLIQUE))
    _draw_panels(titles, pictures, stems[0], CHANGE_LEGEND)
    _draw_sets(result, clouds, maps, stems[1])


def voxel_of_each(points: np.ndarray, coarse: VoxelMap) -> np.ndarray:
    """Returns the number (N,) of the voxel to which each point belongs.

    This is the voxel that contains the point or, if rounding has put the point
    across a border, the occupied voxel with the nearest centre.

    Args:
        points: (N, 3) points from which the map was made [m].
        coarse: the voxel map.
    """
    owners = coarse.find(points)
    elsewhere = np.flatnonzero(owners < 0)
    if len(elsewhere):
        _, nearest = cKDTree(coarse.centres_W).query(points[elsewhere])
        owners[elsewhere] = nearest
    return owners


def _draw_sets(
    result: ChangeResult,
    clouds: tuple[np.ndarray, np.ndarray],
    maps: tuple[VoxelMap, VoxelMap],
    stem: Path,
) -> None:
    change = result.report.change
    sides = (change.source_to_target, change.target_to_source)
    colours = []
    for cloud, coarse, side in zip(clouds, maps, sides, strict=True):
        rgb = np.full((len(coarse), 3), _OUTSIDE_H, dtype=np.uint8)
        rgb[side.in_hull] = _ONLY_IN_H
        rgb[side.unchanged] = _IN_O
        colours.append(rgb[voxel_of_each(cloud, coarse)])
    (first, last), name = result.stages, result.map_name
    _draw_panels(
        [
            f"{name} {first} beside {last}: TCR {sides[0].ratio:.4f}",
            f"{name} {last} beside {first}: TCR {sides[1].ratio:.4f}",
            f"{name}, both together: TCR_sym {change.symmetric:.4f}",
        ],
        [
            _render_shaded(cloud, rgb, _SMALL_OBLIQUE)
            for cloud, rgb in (
                *zip(clouds, colours, strict=True),
                (np.concatenate(clouds), np.concatenate(colours)),
            )
        ],
        stem,
        SETS_LEGEND,
    )


def _render_shaded(
    points: np.ndarray, rgb: np.ndarray, view: OrthographicView
) -> Picture:
    return render(
        points, shade_by_height(rgb, points[:, 2], darkest=0.85), view
    )


def _draw_panels(
    titles: Sequence[str],
    pictures: Sequence[Picture],
    stem: Path,
    legend: Legend = (),
    routes: Sequence[np.ndarray] = (),
) -> None:
    """Draws pictures side by side; the legend stands below.

    All panels show the same part of the picture plane, at one scale.
    """
    extents = np.array([picture.extent for picture in pictures])
    left, bottom = extents[:, [0, 2]].min(axis=0)
    right, top = extents[:, [1, 3]].max(axis=0)
    shape = (top - bottom) / (right - left)
    figure = Figure(
        figsize=(
            _PANEL_INCHES * len(pictures),
            _PANEL_INCHES * min(shape, 1.6) + 0.4,
        ),
        layout="constrained",
    )
    panels = figure.subplots(1, len(pictures), squeeze=False)[0]
    for axes, title, picture in zip(panels, titles, pictures, strict=True):
        _show(axes, picture, (left, right, bottom, top))
        axes.set_title(escape_dollars(title), fontsize=9)
    for axes, route in zip(panels, routes, strict=False):
        _draw_route(axes, route)
    if legend:
        figure.legend(
            handles=[
                Patch(color=unit_rgb(rgb), label=text) for rgb, text in legend
            ],
            loc="outside lower center",
            ncols=len(legend),
            frameon=False,
            fontsize=8,
        )
    save_figure(figure, stem, PIXELS)


def _show(
    axes: Axes, picture: Picture, limits: tuple[float, float, float, float]
) -> None:
    """Shows a picture, axes in metres, with a scale bar.

    Args:
        axes: panel to draw in.
        picture: the picture.
        limits: left, right, bottom and top of the panel [m].
    """
    axes.imshow(
        picture.image, extent=picture.extent, interpolation="antialiased"
    )
    axes.set_axis_off()
    left, right, bottom, top = limits
    end = right - 0.03 * (right - left)
    base = bottom + 0.03 * (top - bottom)
    bar = [end - _SCALE_BAR, end]
    # White rims keep the bar and its length legible on dark walls.
    (line,) = axes.plot(bar, [base, base], color="black", linewidth=2)
    line.set_path_effects([withStroke(linewidth=5, foreground="white")])
    axes.annotate(
        f"{_SCALE_BAR:.0f} m",
        (end - 0.5 * _SCALE_BAR, base),
        xytext=(0, 3),
        textcoords="offset points",
        ha="center",
        fontsize=8,
        path_effects=[withStroke(linewidth=3, foreground="white")],
    )
    axes.set(xlim=(left, right), ylim=(bottom, top))


def _draw_route(axes: Axes, line: np.ndarray) -> None:
    """Draws a route (N, 2), a triangle at its start, a square at its end."""
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
    colours = colormaps[ROUTE_COLOURS]
    ends = ((0, "^", "start"), (-1, "s", "end"))
    for end, marker, _ in ends:
        axes.plot(*line[end], marker, color="black", markersize=6)
    key = [
        Line2D(
            [], [], color=colours(float(end != 0)), lw=2, label=label,
            marker=marker, ms=6, mfc="black", mec="black",
        )
        for end, marker, label in ends
    ]  # fmt: skip
    axes.legend(handles=key, fontsize=7, loc="upper right", framealpha=0.8)
