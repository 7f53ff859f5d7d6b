"""Walkways around objects on sidewalks: the free parts of their widths."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.traffic.lane_graph import Walkway, new_places

# Pedestrians' middles keep this distance from objects, so that their boxes
# clear them in any direction [m].
CLEARANCE = 0.53
# Where objects with this clearance take more than this share of a walkway's
# width, the walkway is narrow.
_NARROW_SHARE = 0.5
# On a narrow walkway, pedestrians keep this distance, as far as their sides
# need [m].
_SIDE_CLEARANCE = 0.36
# Pedestrians begin a walkway at most this many points before its first one.
_BEFORE = 4
# Number of places across a walkway.
_ACROSS = 21
# Least number of points along a walkway.
_LEAST_POINTS = 4
# Pedestrians move aside by at most this many places from one point to the next.
_ASIDE = 2


def kept_clear(
    walkways: Sequence[Walkway], things: Sequence[BaseGeometry]
) -> list[Walkway]:
    """Leads walkways around objects, or ends them in front of objects.

    Args:
        walkways: the walkways.
        things: outlines of the objects as seen from above [m].

    Returns:
        The walkways, each with the free part of its width (`Walkway.free`), and
        cut where nobody can pass. Crossings without a walkway at each end are
        left out.
    """
    tree = shapely.STRtree(things)
    places = new_places(walkways)
    found = [
        part
        for way in walkways
        for part in _passable_parts(way, *_barred_places(way, tree), places)
    ]
    # No crossing leads to a place without a walkway.
    reached = {n for w in found if w.crossing < 0 for n in (w.start, w.end)}
    return [w for w in found if w.crossing < 0 or {w.start, w.end} <= reached]


def _barred_places(
    way: Walkway, tree: shapely.STRtree
) -> tuple[np.ndarray, np.ndarray]:
    """Returns where no pedestrian can be, and where a walkway is narrow.

    Args:
        way: the walkway, with N points.
        tree: outlines of objects.

    Returns:
        For each point, (N, _ACROSS) places across the walkway from left to
        right: 1 if barred, 0 if free. For each point, (N,) bool: whether the
        walkway is narrow.
    """
    points = _lengthened(way.points[:, :2], _BEFORE)
    right = np.gradient(points, axis=0)[:, ::-1] * (1.0, -1.0)
    right /= np.linalg.norm(right, axis=1)[:, None]
    places = points[:, None] + _offsets(way)[:, None] * right[:, None]
    seen = shapely.points(places).ravel()
    barred, around = np.zeros((2, *places.shape[:2]), int)
    for each, reach in ((barred, _SIDE_CLEARANCE), (around, CLEARANCE)):
        each.flat[tree.query(seen, "dwithin", reach)[0]] = 1
    narrow = around.mean(axis=1) > _NARROW_SHARE
    barred[~narrow] = around[~narrow]
    # What blocks the whole width also stands in the way of pedestrians who
    # begin there.
    for line in (barred, barred[::-1]):
        for row in line[:_BEFORE][::-1]:
            if not (line[_BEFORE] | row).all():
                line[_BEFORE] |= row
    barred = barred[_BEFORE:-_BEFORE]
    narrow = maximum_filter1d(narrow, 3)[_BEFORE:-_BEFORE]
    # A pedestrian is longer than wide, and needs some distance to move aside.
    barred = maximum_filter1d(barred, 3, axis=0)
    for step in (1, -1):
        line = barred[::step]
        for row, before in zip(line[1:], line, strict=False):
            if before.all():
                continue
            row |= minimum_filter1d(
                before, 2 * _ASIDE + 1, mode="constant", cval=1
            )
    return barred, narrow


def _offsets(way: Walkway) -> np.ndarray:
    """Returns the offsets of the places across a walkway, to its right [m]."""
    return np.linspace(-way.half_width, way.half_width, _ACROSS)


def _free_widths(barred: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Returns, at each point, the widest gap reachable from the gap before.

    Args:
        barred: (N, M) places across a walkway: 1 if barred, 0 if free.
        offsets: (M,) offsets of the places to the right of the middle [m].

    Returns:
        (N, 2) offsets of the gaps' left and right ends [m], NaN where nobody
        can pass.
    """
    limits = np.full((len(barred), 2), np.nan)
    whole = np.array([0, len(offsets)])
    last = whole
    free = np.pad(1 - barred, ((0, 0), (1, 1)))
    for row, edges in enumerate(np.diff(free)):
        gaps = np.flatnonzero(edges).reshape(-1, 2)
        shared = np.minimum(gaps, last)[:, 1] - np.maximum(gaps, last)[:, 0]
        gaps = gaps[shared > 1]
        if len(gaps):
            last = max(gaps, key=np.ptp)
            limits[row] = offsets[last - (0, 1)]
        else:
            last = whole
    return limits


def _passable_parts(
    way: Walkway,
    barred: np.ndarray,
    narrow: np.ndarray,
    places: Iterator[int],
) -> Iterator[Walkway]:
    """Yields the parts of a walkway between points where nobody can pass.

    A crossing is not cut: if nobody can pass somewhere, it has no parts.

    Args:
        way: the walkway, with N points.
        barred: (N, M) places across the walkway: 1 if barred, 0 if free.
        narrow: (N,) where the walkway is narrow.
        places: numbers for the new ends of walkways.
    """
    limits = _free_widths(barred, _offsets(way))
    bars = np.flatnonzero(np.isnan(limits[:, 0])).tolist()
    if way.crossing >= 0 and bars:
        return
    for before, after in pairwise([-1, *bars, len(limits)]):
        if after - before <= _LEAST_POINTS:
            continue
        rows = slice(before + 1, after)
        yield replace(
            way,
            points=way.points[rows],
            start=next(places) if before >= 0 else way.start,
            end=next(places) if after < len(limits) else way.end,
            free=limits[rows],
            narrow=narrow[rows],
        )


def _lengthened(points: np.ndarray, count: int) -> np.ndarray:
    """Returns points (N, 2), continued straight by `count` at both ends."""
    more = np.arange(1, count + 1)[:, None]
    before = points[0] - more[::-1] * (points[1] - points[0])
    return np.concatenate(
        [before, points, points[-1] + more * (points[-1] - points[-2])]
    )
