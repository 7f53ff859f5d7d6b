"""Tapers where a carriageway becomes wider or narrower in a step.

The lanes of a junction often lack the shoulders of the roads that lead to it:
in the file the kerb of the road then steps aside. Kerbs that are built swing
over.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from shapely.geometry import LinearRing, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.base.angles import wrapped
from cns_drake.city.geometry.polygons import polygons_of

# Smallest and largest step, and least length of the kerb before it [m].
_STEP = (0.02, 2.0)
_BEFORE = 1.0
# Kerbs on both sides of a step go on in the same direction, up to this; the
# step itself turns aside by more [rad].
_ASTRAY = np.radians(45.0)
# Length of a taper over the width of its step, and its greatest one [m].
_SLENDER, _LONGEST = 10.0, 6.0
# Places where a taper may end are at most this far apart; corners this near to
# a straight edge are none [m].
_SPACING, _SIMPLE = 0.25, 0.005


def kerb_tapers(carriageway: BaseGeometry) -> list[Polygon]:
    """Returns areas that turn steps of a carriageway's edge into tapers [m]."""
    found: list[Polygon] = []
    for polygon in polygons_of(carriageway):
        polygon = shapely.orient_polygons(polygon)
        for ring in (polygon.exterior, *polygon.interiors):
            simple = LinearRing(ring).simplify(_SIMPLE)
            xy = shapely.get_coordinates(simple)[:-1]
            found += map(Polygon, _tapers(xy))
            # Backwards and mirrored, the carriageway is on the left again.
            mirror = np.array([-1.0, 1.0])
            found += (Polygon(a * mirror) for a in _tapers(xy[::-1] * mirror))
    return found


def _tapers(xy: np.ndarray) -> Iterator[np.ndarray]:
    """Yields the corners of areas where an edge steps to the left.

    Args:
        xy: (N, 2) corners of a ring with the carriageway on its left [m].
    """
    steps = np.roll(xy, -1, axis=0) - xy
    lengths = np.hypot(*steps.T)
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    turns = wrapped(heading - np.roll(heading, 1))
    is_step = (
        (lengths > _STEP[0])
        & (lengths < _STEP[1])
        & (turns > _ASTRAY)
        & (np.roll(turns, -1) < -_ASTRAY)
    )
    for k in np.flatnonzero(is_step):
        # The kerb before the step comes first, nearest to the step.
        before = np.roll(xy[::-1], k + 1 - len(xy), axis=0)
        behind = np.roll(xy, -k - 1, axis=0)
        ahead = np.array([np.cos(heading[k - 1]), np.sin(heading[k - 1])])
        aside = float(lengths[k] * np.sin(turns[k]))
        straight = before[: _straight_on(before, -ahead) + 1]
        chain = _kerb(behind, ahead)
        if _reach(straight) < _BEFORE or len(chain) < 2:
            continue
        within = min(_LONGEST, _SLENDER * aside)
        dense = shapely.get_coordinates(
            shapely.segmentize(shapely.linestrings(chain), _SPACING)
        )
        away = dense - xy[k]
        along, left = away @ ahead, away @ [-ahead[1], ahead[0]]
        reached = np.flatnonzero((along > _SPACING) & (along < within + 1e-6))
        if not len(reached):
            continue
        # The taper touches the kerb where it is seen farthest to the right.
        last = int(reached[np.argmin(left[reached] / along[reached])])
        yield np.concatenate([xy[k : k + 1], dense[: last + 1]])


def _straight_on(xy: np.ndarray, ahead: np.ndarray) -> int:
    """Returns how many edges between corners (N, 2) go on in a direction."""
    steps = np.diff(xy, axis=0)
    goes_on = steps @ ahead > np.cos(_ASTRAY) * np.hypot(*steps.T)
    return int(np.argmin(np.append(goes_on, False)))


def _kerb(xy: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Returns the first corners (M, 2) of an edge that goes straight on.

    Where it soon steps back, the corner behind that step is the last one.

    Args:
        xy: (N, 2) corners of a ring, with the carriageway on its left [m].
        ahead: (2,) unit vector.
    """
    last = _straight_on(xy, ahead)
    if 0 < last < len(xy) - 2 and _straight_on(xy[last + 1 :], ahead):
        step = xy[last + 1] - xy[last]
        goes_right = step @ [-ahead[1], ahead[0]] < 0.0
        if goes_right and np.hypot(*step) < _STEP[1]:
            last += 1
    return xy[: last + 1]


def _reach(xy: np.ndarray) -> float:
    return float(np.hypot(*np.diff(xy, axis=0).T).sum())
