"""Tapers in place of steps in the edge of a carriageway.

In an OpenDRIVE junction, lanes often lack the shoulders of the roads that lead
to the junction, so that the kerb has a step where the road meets the junction.
Real kerbs have tapers instead, and this module adds such tapers.
"""

from collections.abc import Iterator

import numpy as np
import shapely
from shapely.geometry import LinearRing, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.base import length_of, wrapped
from cns_drake.city import polygons_of

# Least and greatest width of a step [m].
_STEP = (0.02, 2.0)
# Least length of the kerb before a step [m].
_KERB_BEFORE = 1.0
# The kerbs on both sides of a step have the same direction within this angle;
# the step itself turns by more [rad].
_ASTRAY = np.radians(45.0)
# Greatest length of a taper relative to the width of its step.
_TAPER_RATIO = 10.0
# Greatest length of a taper [m].
_LONGEST_TAPER = 6.0
# Places where a taper may end are at most this far apart [m].
_SPACING = 0.25
# Corners this close to a straight edge are dropped [m].
_CORNER_TOLERANCE = 0.005
# A taper may be longer than allowed by a rounding error [m].
_ROUNDING = 1e-6


def kerb_tapers(carriageway: BaseGeometry) -> list[Polygon]:
    """Returns areas that turn steps in a carriageway's edge into tapers [m].

    `carriageway` is the area of the carriageway in W. The tapers lie outside of
    the carriageway.
    """
    mirror = np.array([-1.0, 1.0])
    tapers: list[Polygon] = []
    for polygon in polygons_of(carriageway):
        polygon = shapely.orient_polygons(polygon)
        for ring in (polygon.exterior, *polygon.interiors):
            simple = LinearRing(ring).simplify(_CORNER_TOLERANCE)
            xy = shapely.get_coordinates(simple)[:-1]
            tapers += map(Polygon, _tapers(xy))
            # Reversed and mirrored, the ring has the carriageway on its left
            # again, and its steps to the right are steps to the left.
            mirrored = _tapers(xy[::-1] * mirror)
            tapers += (Polygon(corners * mirror) for corners in mirrored)
    return tapers


def _tapers(xy: np.ndarray) -> Iterator[np.ndarray]:
    """Yields the corners of tapers, where an edge steps to the left.

    The edge is a ring of corners (N, 2) with the carriageway on its left [m].
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
        # The corners of the kerb before the step, the one nearest to the step
        # first.
        before = np.roll(xy[::-1], k + 1 - len(xy), axis=0)
        behind = np.roll(xy, -k - 1, axis=0)
        ahead = np.array([np.cos(heading[k - 1]), np.sin(heading[k - 1])])
        aside = float(lengths[k] * np.sin(turns[k]))
        straight = before[: _num_straight_edges(before, -ahead) + 1]
        chain = _kerb_line(behind, ahead)
        reach = length_of(straight)
        if reach < _KERB_BEFORE or len(chain) < 2:
            continue
        longest = min(_LONGEST_TAPER, _TAPER_RATIO * aside)
        dense = shapely.get_coordinates(
            shapely.segmentize(shapely.linestrings(chain), _SPACING)
        )
        away = dense - xy[k]
        along, left = away @ ahead, away @ [-ahead[1], ahead[0]]
        reached = np.flatnonzero(
            (along > _SPACING) & (along < longest + _ROUNDING)
        )
        if not len(reached):
            continue
        # The taper touches the kerb at the place that is farthest to the right
        # in its view.
        last = int(reached[np.argmin(left[reached] / along[reached])])
        yield np.concatenate([xy[k : k + 1], dense[: last + 1]])


def _num_straight_edges(xy: np.ndarray, ahead: np.ndarray) -> int:
    """Returns how many of the first edges continue in a direction.

    The edges lie between corners (N, 2), and `ahead` (2,) is the direction.
    """
    steps = np.diff(xy, axis=0)
    goes_on = steps @ ahead > np.cos(_ASTRAY) * np.hypot(*steps.T)
    return int(np.argmin(np.append(goes_on, False)))


def _kerb_line(xy: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Returns the first corners (M, 2) of a kerb, as far as it runs straight.

    If the kerb soon steps back, the corner behind that step is the last corner.

    Args:
        xy: (N, 2) corners of the kerb, a ring with the carriageway on its left
            [m].
        ahead: (2,) direction in which the kerb begins, of length 1.
    """
    last = _num_straight_edges(xy, ahead)
    if 0 < last < len(xy) - 2 and _num_straight_edges(xy[last + 1 :], ahead):
        step = xy[last + 1] - xy[last]
        goes_right = step @ [-ahead[1], ahead[0]] < 0.0
        if goes_right and np.hypot(*step) < _STEP[1]:
            last += 1
    return xy[: last + 1]
