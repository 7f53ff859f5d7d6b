"""Roofs and decks over open ground, which keep snow off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.transient.ground_surface import (
    GroundSurface,
    from_above,
    triangle_corners,
    upwardness,
)
from cns_drake.transient.standing import GROUND_CLASSES, Standing

# What snow falls through, or what is too thin to hold it off.
_OPEN = frozenset(
    {"vegetation", "trunk", "pole", "traffic-sign", "fence", "bicycle"}
)
# A roof or deck leaves this much room below it at least [m].
_HEADROOM = 2.2
# Steeper surfaces hold nothing off: cosine of the slope.
_LEAST_FLAT = 0.3
# Above its lowest point a building is cut to find its walls [m].
_CUT = 1.0
# Ledges and eaves up to twice this wide hold nothing off [m].
_LEDGE = 0.25
# Walls that are less apart than this meet [m].
_GRID = 0.001


class SkyCover:
    """What keeps snow off the ground below it.

    Ground within closed walls does not count, since no beam gets there.

    Attributes:
        area: below roofs and decks, seen from above [m].
    """

    def __init__(self, things: Mapping[str, Standing], ground: GroundSurface):
        """Collects it.

        Args:
            things: all that stands.
            ground: near the drive.
        """
        found = [np.zeros((0, 3, 3))]
        for thing in things.values():
            if thing.semantic_class in _OPEN:
                continue
            if not thing.outline.intersects(ground.near):
                continue
            corners = np.concatenate(
                [np.zeros((0, 3, 3)), *map(triangle_corners, thing.parts)]
            )
            if thing.semantic_class in GROUND_CLASSES:
                found.append(_decks(corners, ground))
            else:
                found.append(_open_roofs(corners, thing.bottom))
        corners = np.concatenate(found)
        areas = from_above(corners)
        joined = shapely.unary_union(areas, grid_size=_GRID)
        self.area: BaseGeometry = joined.buffer(-_LEDGE).buffer(_LEDGE)
        shapely.prepare(self.area)
        self._tree = shapely.STRtree(areas)
        self._heights = corners[:, :, 2].mean(axis=1)

    def lies_over(self, corners: np.ndarray) -> np.ndarray:
        """Returns which triangles (M, 3, 3) have their middles below it."""
        middles = corners.mean(axis=1)
        covered = np.zeros(len(corners), bool)
        row, index = self._tree.query(
            shapely.points(middles[:, :2]), "intersects"
        )
        is_above = self._heights[index] > middles[row, 2] + _HEADROOM / 2
        covered[row[is_above]] = True
        return covered & shapely.intersects_xy(self.area, middles[:, :2])

    def meets(self, corners: np.ndarray) -> np.ndarray:
        """Returns which triangles (M, 3, 3) may lie below it in part."""
        areas = from_above(corners)
        met = np.zeros(len(corners), bool)
        row, index = self._tree.query(areas, "intersects")
        lowest = corners[:, :, 2].min(axis=1)
        is_above = self._heights[index] > lowest[row] + _HEADROOM / 2
        met[row[is_above]] = True
        return met & shapely.intersects(self.area, areas)


def _flat(corners: np.ndarray) -> np.ndarray:
    return corners[np.abs(upwardness(corners)) > _LEAST_FLAT]


def _decks(corners: np.ndarray, ground: GroundSurface) -> np.ndarray:
    """Returns triangles of ground that have other ground far below them."""
    corners = _flat(corners)
    middles = corners.mean(axis=1)
    below = ground.lowest(middles[:, :2])
    return corners[middles[:, 2] > below + _HEADROOM]


def _open_roofs(corners: np.ndarray, bottom: float) -> np.ndarray:
    """Returns what is high and flat, but for what closed walls bear."""
    flat = _flat(corners)
    flat = flat[flat[:, :, 2].min(axis=1) > bottom + _HEADROOM]
    if len(flat) == 0:
        return flat
    inside = _within_walls(corners, bottom + _CUT)
    middles = flat[:, :, :2].mean(axis=1)
    return flat[~shapely.contains_xy(inside, middles)]


def _within_walls(corners: np.ndarray, height: float) -> BaseGeometry:
    """Returns the area that triangles enclose at a height [m]."""
    is_high = corners[:, :, 2] > height
    crossing = corners[is_high.any(axis=1) & ~is_high.all(axis=1)]
    ends = []
    for k in range(3):
        a, b = crossing[:, k], crossing[:, (k + 1) % 3]
        rise = b[:, 2] - a[:, 2]
        safe = np.where(rise == 0.0, 1.0, rise)
        part = (height - a[:, 2]) / safe
        xy = a[:, :2] + part[:, None] * (b[:, :2] - a[:, :2])
        crosses = (a[:, 2] > height) != (b[:, 2] > height)
        ends.append(np.where(crosses[:, None], xy, np.nan))
    # Two of the three sides of each cross the height.
    pairs = np.stack(ends, axis=1)
    order = np.argsort(np.isnan(pairs[:, :, 0]), axis=1, kind="stable")[:, :2]
    lines = shapely.linestrings(np.take_along_axis(pairs, order[:, :, None], 1))
    joined = shapely.unary_union(lines, grid_size=_GRID)
    rings = shapely.polygonize([joined])
    closed = shapely.unary_union(rings).buffer(_LEDGE)
    shapely.prepare(closed)
    return closed
