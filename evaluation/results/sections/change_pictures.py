"""The section with the change of each map: its numbers, and pictures."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from dataclasses import dataclass
import itertools
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
import numpy as np

from evaluation.base import (
    GONE_RGB,
    NEW_RGB,
    UNSEEN_RGB,
    distances_along,
    figure_style,
    file_name,
)
from evaluation.change import lacks_counterpart
from evaluation.maps import VoxelMap
from evaluation.recognition import METRICS
from evaluation.results.figure_files import PIXELS, save_figure
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

_UNCHANGED = (200, 203, 208)
# Stripes of the hatching, and their width in the picture [m].
_HATCHED = (UNSEEN_RGB, (96, 104, 116))
_STRIPE = 2.5
_HATCHING = "////"
_LEGEND: Legend = (
    (NEW_RGB, "new"),
    (GONE_RGB, "gone"),
    (UNSEEN_RGB, "hidden from one of the drives"),
    (_UNCHANGED, "unchanged"),
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
# Width of a picture [inches].
_WIDTH_INCHES = 8.0
# Lines of sight: their distance along the route, their greatest length [m].
_SIGHT_SPACING = 15.0
_SIGHT_RANGE = 80.0
# A line of sight may end this much in front of a point [m].
_SIGHT_SLACK = 1.0
# Distance from which points of a map, 0.5 m apart, leave no gap between
# directions so many degrees apart [m]: nearer points hide wider directions.
_SIGHT_DEG = ((0.0, 8), (7.0, 4), (14.0, 2), (28.0, 1), (np.inf, 0))

_OBLIQUE = OrthographicView(
    azimuth_deg=-55.0, elevation_deg=38.0, pixels_per_metre=4.0
)


@dataclass(frozen=True)
class DrivenMap:
    """A map with the route from which it was seen.

    Attributes:
        cloud: (K, 3) points of the map in W, some 0.5 m apart [m].
        voxels: the map in voxels, from which the change ratio is computed.
        positions: (N, 3) positions of the sensor in W [m].
    """

    cloud: np.ndarray
    voxels: VoxelMap
    positions: np.ndarray


@dataclass(frozen=True)
class ChangePicture:
    """A picture of what changed between two stages of a map.

    Both maps are in one picture. Points that only the later map has are new,
    points that only the earlier map has are gone; unless the drive of the other
    map had no free line of sight to the place, such as to the street behind a
    new building. These are hatched: nobody knows what became of them. The
    change ratio (TCR) counts all three.

    Attributes:
        map_name: name of the map.
        stages: the earlier and the later stage.
        folder: folder of the files.
    """

    map_name: str
    stages: tuple[str, str]
    folder: Path

    @property
    def stem(self) -> Path:
        """Path of the picture, without ending."""
        # Underscores join the parts. They are escaped in all but the first, so
        # that two pairs of stages never share a name.
        earlier, later = (
            one.replace("%", "%p").replace("_", "%u") for one in self.stages
        )
        return self.folder / file_name(
            f"change_{self.map_name}_{earlier}_{later}"
        )

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths of all files."""
        stem = self.stem
        return tuple(stem.with_name(f"{stem.name}.{kind}") for kind in PIXELS)

    @property
    def title(self) -> str:
        """What the picture shows."""
        first, last = self.stages
        return f"What changed in {self.map_name} from {first} to {last}"

    def draw(self, earlier: DrivenMap, later: DrivenMap) -> None:
        """Draws the picture of two maps in one world frame."""
        points, colours = [], []
        for one, other, changed in (
            (earlier, later, GONE_RGB),
            (later, earlier, NEW_RGB),
        ):
            lacks = lacks_counterpart(one.cloud, other.voxels.centroids_W)
            rgb = np.full((len(lacks), 3), _UNCHANGED, dtype=np.uint8)
            rows = np.flatnonzero(lacks)
            seen = is_in_sight(one.cloud[rows], other)
            rgb[rows[seen]] = changed
            rgb[rows[~seen]] = _hatched(one.cloud[rows[~seen]])
            # What is in both maps is drawn once.
            kept = slice(None) if one is later else rows
            points.append(one.cloud[kept])
            colours.append(rgb[kept])
        both = np.concatenate(points)
        shaded = shade_by_height(
            np.concatenate(colours), both[:, 2], darkest=0.85
        )
        _draw(render(both, shaded, _OBLIQUE), self.stem)

    def shown(self) -> _ShownPicture:
        """Returns the picture as the page shows it."""
        return _ShownPicture(self.title, _data_address(self.stem), _LEGEND)


def is_in_sight(points: np.ndarray, other: DrivenMap) -> np.ndarray:
    """Returns whether a drive had a free line of sight to points, (N,) bool.

    A line of sight is free if no point of the drive's map lies in its direction
    and nearer. It is at most 80 m long, and begins at the sensor, every 15 m of
    the route.

    Args:
        points: (N, 3) points in W [m].
        other: the map of the drive.
    """
    found = np.zeros(len(points), dtype=bool)
    along = np.floor(distances_along(other.positions) / _SIGHT_SPACING)
    _, chosen = np.unique(along, return_index=True)
    for place in other.positions[chosen]:
        rows = np.flatnonzero(~found)
        rows = rows[_is_near(points[rows], place)]
        ranges, asked = _directions(points[rows] - place)
        near = ranges < _SIGHT_RANGE
        rows, ranges, asked = rows[near], ranges[near], asked[near]
        hidden_by = other.cloud[_is_near(other.cloud, place)]
        depths, angles = _directions(hidden_by - place)
        is_free = np.ones(len(rows), dtype=bool)
        for (low, degrees), (high, _) in itertools.pairwise(_SIGHT_DEG):
            here = (depths >= low) & (depths < min(high, _SIGHT_RANGE))
            nearest = np.full((181, 360), np.inf)
            np.minimum.at(
                nearest, tuple(angles[here].T // degrees), depths[here]
            )
            is_free &= (
                nearest[tuple(asked.T // degrees)] > ranges - _SIGHT_SLACK
            )
        found[rows] = is_free
    return found


def _is_near(points: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Returns whether points can be within the range of sight, (N,) bool."""
    x, y = np.abs(points[:, :2] - place[:2]).T
    return (x < _SIGHT_RANGE) & (y < _SIGHT_RANGE)


def _directions(offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns lengths (N,) [m] of vectors, and directions (N, 2) [whole deg].

    These are the angle from straight down, and the one around the vertical.
    """
    x, y, z = offsets.T
    across = np.hypot(x, y)
    up = np.rad2deg(np.arctan2(z, across)) + 90.0
    around = np.rad2deg(np.arctan2(y, x)) % 360.0
    angles = np.stack([up, np.minimum(around, 359.5)], axis=1)
    return np.hypot(across, z), angles.astype(int)


def _hatched(points: np.ndarray) -> np.ndarray:
    """Returns colours (N, 3) uint8 that form stripes in the picture."""
    right, up = (points @ _OBLIQUE.axes()[:2].T).T
    stripe = np.floor((right + up) / _STRIPE).astype(int) % 2
    return np.array(_HATCHED, dtype=np.uint8)[stripe]


class _ShownPicture(NamedTuple):
    """A picture on the page, with what its colours mean."""

    title: str
    address: str
    legend: Legend


def change_section(
    results: Results, pictures: Iterable[ChangePicture]
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
        pictures=[one.shown() for one in pictures],
    )


def _data_address(stem: Path) -> str:
    """Returns a data URL that contains a picture."""
    kind = PIXELS[-1]
    content = stem.with_name(f"{stem.name}.{kind}").read_bytes()
    data = base64.b64encode(content).decode("ascii")
    return f"data:image/{kind};base64,{data}"


@figure_style()
def _draw(picture: Picture, stem: Path) -> None:
    left, right, bottom, top = picture.extent
    shape = (top - bottom) / (right - left)
    figure = Figure(
        facecolor="none",
        figsize=(_WIDTH_INCHES, _WIDTH_INCHES * min(shape, 1.6) + 0.7),
        layout="constrained",
    )
    axes = figure.subplots()
    _show(axes, picture)
    figure.legend(
        handles=[
            Patch(
                facecolor=unit_rgb(rgb),
                edgecolor=unit_rgb(_HATCHED[1]),
                linewidth=0.0,
                hatch=_HATCHING if rgb == UNSEEN_RGB else None,
                label=text,
            )
            for rgb, text in _LEGEND
        ],
        loc="outside lower center",
        ncols=len(_LEGEND),
        frameon=False,
        fontsize=10,
    )
    save_figure(figure, stem, PIXELS)


def _show(axes: Axes, picture: Picture) -> None:
    """Shows a picture, axes in metres, with a scale bar."""
    # Without paper, so that the picture lies on a dark page, too.
    alpha = (picture.image < 255).any(axis=2) * np.uint8(255)
    axes.imshow(
        np.dstack([picture.image, alpha]),
        extent=picture.extent,
        interpolation="antialiased",
    )
    axes.set_axis_off()
    left, right, bottom, top = picture.extent
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
