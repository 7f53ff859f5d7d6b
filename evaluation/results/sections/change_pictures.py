"""The section with the change of each map: its numbers, and pictures."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base import figure_style, file_name
from evaluation.change import TemporalChange, judge_points
from evaluation.maps import VoxelMap
from evaluation.recognition import METRICS
from evaluation.results.figure_files import PIXELS, save_figure
from evaluation.results.figure_text import escape_dollars
from evaluation.results.keys import LAST, STAGE
from evaluation.results.page_frame import PageSection, page_section
from evaluation.results.sections.point_rendering import (
    OrthographicView,
    Picture,
    render,
    shade_by_height,
)
from evaluation.results.styles import Legend, unit_rgb
from evaluation.results.table import Results

_UNCHANGED = (214, 214, 214)
_CHANGED = (196, 18, 24)
_ABSENT_OUTSIDE = (240, 170, 160)
# Sets O and H: blue and vermilion differ for all kinds of colour vision.
_IN_O = (120, 170, 215)
_ONLY_IN_H = (213, 94, 0)
_OUTSIDE_H = (228, 228, 228)
_CHANGE_LEGEND: Legend = (
    (_CHANGED, "only in this map"),
    (
        _ABSENT_OUTSIDE,
        "only in this map, where the maps' hulls do not overlap: not counted",
    ),
    (_UNCHANGED, "in both maps"),
)
_SETS_LEGEND: Legend = (
    (_IN_O, "unchanged (set O)"),
    (_ONLY_IN_H, "changed (in set H, not in O)"),
    (_OUTSIDE_H, "outside the other map's hull H: not counted"),
)
# TCR_sym of the control, where nothing changed.
_CONTROL = "control"
# Metric or control -> head of its column.
_HEADS = {
    "tcr_sym": METRICS["tcr_sym"].title,
    _CONTROL: "without the change",
    **{
        name: METRICS[name].title
        for name in (
            "tcr_sym_masked",
            "tcr_source_to_target",
            "tcr_target_to_source",
        )
    },
}
# Length of the scale bar [m].
_SCALE_BAR = 50.0
# Width of a panel [inches].
_PANEL_INCHES = 4.2

_OBLIQUE = OrthographicView(
    azimuth_deg=-55.0, elevation_deg=38.0, pixels_per_metre=3.0
)
_SMALL_OBLIQUE = replace(_OBLIQUE, pixels_per_metre=1.8)


@dataclass(frozen=True)
class ChangePictures:
    """Two pictures of what changed between two stages of a map.

    The first picture shows both maps. Points without a counterpart in the other
    map are red; they are pale red outside the other map's convex hull, where
    the change ratio (TCR) does not count them, because the other drive may not
    have passed these points. The second picture shows the sets of points from
    which TCR is computed: points in the other map's hull, and unchanged points.

    Attributes:
        map_name: name of the map.
        stages: the earlier and the later stage.
        folder: folder of the files.
    """

    map_name: str
    stages: tuple[str, str]
    folder: Path

    @property
    def stems(self) -> tuple[Path, Path]:
        """Paths of the two pictures, without ending."""
        # Underscores join the parts. They are escaped in all but the first, so
        # that two pairs of stages never share a name.
        earlier, later = (
            one.replace("%", "%p").replace("_", "%u") for one in self.stages
        )
        change, sets = (
            self.folder / file_name(f"{kind}_{self.map_name}_{earlier}_{later}")
            for kind in ("change", "sets")
        )
        return change, sets

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths of all files."""
        return tuple(
            stem.with_name(f"{stem.name}.{kind}")
            for stem in self.stems
            for kind in PIXELS
        )

    def draw(
        self,
        change: TemporalChange,
        clouds: tuple[np.ndarray, np.ndarray],
        maps: tuple[VoxelMap, VoxelMap],
    ) -> None:
        """Draws both pictures.

        Args:
            change: the change between the stages.
            clouds: (K, 3) clouds of the earlier and of the later stage in W
                [m].
            maps: voxel maps of the earlier and of the later stage.
        """
        titles, pictures = [], []
        for one, other in ((0, 1), (1, 0)):
            absent, in_hull = judge_points(clouds[one], maps[other].centroids_W)
            rgb = np.full((len(absent), 3), _UNCHANGED, dtype=np.uint8)
            rgb[absent] = _ABSENT_OUTSIDE
            rgb[absent & in_hull] = _CHANGED
            stage, lacking = self.stages[one], self.stages[other]
            titles.append(f"{self.map_name} {stage}: what {lacking} lacks")
            pictures.append(_render_shaded(clouds[one], rgb, _OBLIQUE))
        _draw_panels(titles, pictures, self.stems[0], _CHANGE_LEGEND)
        self._draw_sets(change, clouds, maps)

    def _draw_sets(
        self,
        change: TemporalChange,
        clouds: tuple[np.ndarray, np.ndarray],
        maps: tuple[VoxelMap, VoxelMap],
    ) -> None:
        sides = (change.source_to_target, change.target_to_source)
        colours = []
        for cloud, coarse, side in zip(clouds, maps, sides, strict=True):
            rgb = np.full((len(coarse), 3), _OUTSIDE_H, dtype=np.uint8)
            rgb[side.in_hull] = _ONLY_IN_H
            rgb[side.unchanged] = _IN_O
            colours.append(rgb[voxel_of_each(cloud, coarse)])
        (first, last), name = self.stages, self.map_name
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
            self.stems[1],
            _SETS_LEGEND,
        )

    def shown(self) -> list[_ShownPicture]:
        """Returns the two pictures as the page shows them."""
        first, last = self.stages
        titles = (
            f"What changed in {self.map_name} between {first} and {last}",
            f"What TCR_sym counts in {self.map_name}: {first} beside {last},"
            f" {last} beside {first}, both together",
        )
        return [
            _ShownPicture(title, _data_address(stem), num_panels, legend)
            for stem, title, num_panels, legend in zip(
                self.stems,
                titles,
                (2, 3),
                (_CHANGE_LEGEND, _SETS_LEGEND),
                strict=True,
            )
        ]


class _ShownPicture(NamedTuple):
    """A picture on the page: panels side by side, and colours below them."""

    title: str
    address: str
    num_panels: int
    legend: Legend


def change_section(
    results: Results, pictures: Iterable[ChangePictures]
) -> PageSection:
    """Returns the section with the change of each map.

    Args:
        results: the table of results.
        pictures: pictures of changes, already drawn.
    """
    numbers: dict[tuple[str, frozenset[str]], dict[str, float]] = {}
    names: dict[tuple[str, frozenset[str]], str] = {}
    # TCR_sym of two drives does not depend on which of them is the query.
    for row in results.where(task="change").rows:
        key = row.map, frozenset((row.database, row.query))
        names.setdefault(key, f"{row.database} ↔ {row.query}")
        metric = row.metric
        if row[STAGE] == LAST:
            if metric != "tcr_sym":
                continue
            metric = _CONTROL
        numbers.setdefault(key, {}).setdefault(metric, row.value)
    return page_section(
        "change",
        "Change",
        "results.csv: the rows of the task change; the maps of the drives",
        heads=_HEADS.values(),
        rows=[
            {
                "map": map_name,
                "drives": names[map_name, drives],
                "cells": [found.get(name) for name in _HEADS],
            }
            for (map_name, drives), found in numbers.items()
        ],
        pictures=[shown for one in pictures for shown in one.shown()],
    )


def _data_address(stem: Path) -> str:
    """Returns a data URL that contains a picture."""
    kind = PIXELS[-1]
    content = stem.with_name(f"{stem.name}.{kind}").read_bytes()
    data = base64.b64encode(content).decode("ascii")
    return f"data:image/{kind};base64,{data}"


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


def _render_shaded(
    points: np.ndarray, rgb: np.ndarray, view: OrthographicView
) -> Picture:
    return render(
        points, shade_by_height(rgb, points[:, 2], darkest=0.85), view
    )


@figure_style()
def _draw_panels(
    titles: Sequence[str],
    pictures: Sequence[Picture],
    stem: Path,
    legend: Legend,
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
