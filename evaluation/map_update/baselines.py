"""Baselines that label the points of two maps without knowing the ground truth.

- `distance`: a point is kept if the other map has a point within 0.5 m;
  otherwise the point is gone or new. No point is unobserved.
- `m3c2` (the extra `map-update`; Lague et al., ISPRS J. 82, 2013, in py4dgeo):
  the distance between the two maps is measured along the normal of the surface.
  A point is gone or new if this distance exceeds both the level of detection
  and 0.1 m. A point is unobserved if one of the maps has too few points around
  this point to compute the distance. All other points are kept.
- `free-space`: the scans of the other drive decide, see
  `by_free_space`.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import importlib
import logging
from typing import Any, NamedTuple

import numpy as np

from evaluation.base import InputError, num_cores, track
from evaluation.drives import sample_frames
from evaluation.map_update.labels import SIDES, PairLabels
from evaluation.map_update.nearest_points import nearest_distances
from evaluation.map_update.sessions import Session, SessionPair
from evaluation.recognition import SeenSurfaces

# Threshold of the baseline `distance` [m].
_APART = 0.5
# M3C2: radius of the neighbourhood to which a normal is fitted [m].
_NORMAL_RADIUS = 1.0
# M3C2: radius of the cylinder [m].
_CYLINDER_RADIUS = 0.5
# M3C2: greatest distance [m].
_MOST_DISTANCE = 3.0
# M3C2: least distance that counts as a change [m].
_LEAST_CHANGE = 0.1
# Number of points per step of progress.
_CHUNK = 50_000


def run_baseline(name: str, pair: SessionPair) -> PairLabels:
    """Returns the labels of both maps by a shipped change detector.

    Args:
        name: name of the detector, a key of `BASELINES`.
        pair: the two sessions.

    Raises:
        InputError: the sessions lack data that the detector needs, or its
            package is not installed.
    """
    find_labels = BASELINES[name]
    return PairLabels(find_labels(pair.A, pair.B), find_labels(pair.B, pair.A))


def by_distance(mine: Session, theirs: Session) -> np.ndarray:
    """Returns the labels (N,) uint8 of a map by the baseline `distance`.

    A point is kept if the other map has a point within 0.5 m. Otherwise the
    point is gone (older map) or new (newer map); see
    `evaluation.map_update.labels.Label`.

    Args:
        mine: the map with N points, and its drive.
        theirs: the map of the other drive.
    """
    _, kept, changed = SIDES[mine.side]
    far = np.isinf(nearest_distances(mine.points, theirs.points, _APART))
    return np.where(far, changed, kept).astype(np.uint8)


def by_m3c2(mine: Session, theirs: Session) -> np.ndarray:
    """Returns the labels (N,) uint8 of a map by the baseline `m3c2`.

    A point is gone (older map) or new (newer map) if the M3C2 distance between
    the two maps at this point exceeds both its level of detection and 0.1 m. A
    point is unobserved if a map lacks points to measure this distance. All
    other points are kept. See `evaluation.map_update.labels.Label`.

    Args:
        mine: the map with N points, and its drive.
        theirs: the map of the other drive.
    """
    py4dgeo = _py4dgeo()
    unobserved, kept, changed = SIDES[mine.side]
    epochs = [py4dgeo.Epoch(session.points) for session in (mine, theirs)]
    chunks = np.array_split(mine.points, len(mine.points) // _CHUNK + 1)
    found = [
        py4dgeo.M3C2(
            epochs=tuple(epochs),
            corepoints=chunk,
            normal_radii=[_NORMAL_RADIUS],
            cyl_radius=_CYLINDER_RADIUS,
            max_distance=_MOST_DISTANCE,
        ).run()
        for chunk in track(chunks, f"m3c2 of {mine.side}", len(chunks), "parts")
    ]
    distances = np.concatenate([each[0] for each in found])
    detectable = np.concatenate([each[1]["lodetection"] for each in found])
    least = np.maximum(np.nan_to_num(detectable), _LEAST_CHANGE)
    labels = np.where(np.abs(distances) > least, changed, kept)
    labels[np.isnan(distances)] = unobserved
    return labels.astype(np.uint8)


# Side of a cell [m].
_CELL = 0.2
# A cell is kept if a point of the other map is within this distance [m].
_KEPT_WITHIN = 0.2
# A scan sees past a cell if the surface lies at least this far behind it [m].
_PAST = 0.5
# A scan shows a cell if the surface is within this distance [m].
_SHOWN_WITHIN = 0.2
# Distance driven between two scans [m].
_SPACING = 2.0
# At least this many scans, spread over the drive, show the field of view.
_FIELD_SCANS = 20
# Number of the lowest, highest and farthest returns that do not count for the
# field of view, since a few may come from a bird or a reflection. A ring of
# beams has many more returns.
_STRAYS = 10
# A kept cell must be shown by at least this number of scans, as a share of the
# scans from which it is hidden.
_SHOWN_SHARE = 0.05
# This number of scans is always enough.
_ENOUGH = 2
# Side of a cube in which changes are counted [m].
_CUBE = 1.0
# Share of changed points above which the whole cube counts as changed.
_CHANGED_SHARE = 0.2
# A point of such a cube is still kept if a point of the other map is within
# this distance [m].
_STILL_KEPT_WITHIN = 0.12
# Least horizontal distance from which a slope is computed [m].
_TINY = 1e-9


class _Views(NamedTuple):
    """How many scans see past N points, show them, or hide them.

    The module's docstring says when a scan sees past a point, and when it shows
    a point. A scan hides a point if a surface lies in front of it.

    Attributes:
        past: (N,) number of scans that see past each point.
        shown: (N,) number of scans that show it.
        hidden: (N,) number of scans that hide it.
    """

    past: np.ndarray
    shown: np.ndarray
    hidden: np.ndarray


def by_free_space(mine: Session, theirs: Session) -> np.ndarray:
    """Returns a label for each point of a map, by the baseline `free-space`.

    The labels state whether the other drive finds the point unchanged or
    changed, or does not observe it.

    Args:
        mine: the drive whose map of N points is labelled.
        theirs: the other drive, with its map and scans.

    Returns:
        (N,) uint8, values of `evaluation.map_update.labels.Label`.
    """
    _, kept, changed = SIDES[mine.side]
    _check_scans(theirs)
    labels = np.full(len(mine.points), kept, np.uint8)
    distances = nearest_distances(mine.points, theirs.points, _KEPT_WITHIN)
    far = np.isinf(distances)
    labels[far] = _label_by_scans(mine.points[far], mine.side, theirs)
    # A new object may pass near to one that is gone.
    known = np.flatnonzero((labels == changed) | (labels == kept))
    shares = _changed_shares(mine.points[known], labels[known] == changed)
    is_beside = (shares > _CHANGED_SHARE) & (
        distances[known] > _STILL_KEPT_WITHIN
    )
    labels[known[is_beside]] = changed
    return labels


def _label_by_scans(
    points: np.ndarray, side: str, theirs: Session
) -> np.ndarray:
    """Returns the labels of points by the scans of the other drive, (N,).

    All points of a cell have the label of the cell's first point.

    Args:
        points: (N, 3) points of a map in W [m].
        side: side of this map, `A` or `B`.
    """
    unobserved, kept, changed = SIDES[side]
    cells = np.floor(points / _CELL).astype(np.int64)
    _, first, cell_of = np.unique(
        cells, axis=0, return_index=True, return_inverse=True
    )
    views = _count_views(points[first], theirs)
    needed = np.minimum(_SHOWN_SHARE * views.hidden, _ENOUGH)
    is_shown = (views.shown > 0) & (views.shown >= needed)
    found = np.where(is_shown, kept, unobserved)
    found = np.where(views.past > 0, changed, found)
    return found[cell_of.ravel()]


def _changed_shares(points: np.ndarray, is_changed: np.ndarray) -> np.ndarray:
    """Returns the share of changed points in each point's cube, (N,).

    Args:
        points: (N, 3) points [m].
        is_changed: (N,) bool, which points have changed.
    """
    cubes = np.floor(points / _CUBE).astype(np.int64)
    cubes -= cubes.min(axis=0, initial=0)
    sizes = cubes.max(axis=0, initial=0) + 1
    _, cube_of = np.unique(
        np.ravel_multi_index(tuple(cubes.T), tuple(sizes)), return_inverse=True
    )
    return (np.bincount(cube_of, is_changed) / np.bincount(cube_of))[cube_of]


def _count_views(points: np.ndarray, other: Session) -> _Views:
    """Returns how many scans see past each point, show it, or hide it.

    Args:
        points: (N, 3) points in W [m].
        other: the drive with the scans.
    """
    counts = np.zeros((3, len(points)), np.int32)
    chosen = sample_frames(other.X_WS[:, :3, 3], _SPACING).tolist()
    sampled = chosen[:: max(len(chosen) // _FIELD_SCANS, 1)]
    scans = [other.scan(number) for number in sampled]
    returns = np.concatenate([np.zeros((0, 3)), *scans])
    if len(returns) == 0:
        return _Views(*counts)
    low, high, reach = _field_of_view(returns)

    def look(number: int) -> list[np.ndarray]:
        """Returns which points a scan sees past, shows and hides."""
        X_WS = other.X_WS[number]
        offsets = points - X_WS[:3, 3]
        squares = np.einsum("ij,ij->i", offsets, offsets)
        rows = np.flatnonzero(squares <= reach**2)
        p_S = offsets[rows] @ X_WS[:3, :3]
        slopes = _slopes(p_S)
        inside = (slopes >= low) & (slopes <= high)
        rows, p_S = rows[inside], p_S[inside]
        found = SeenSurfaces.of(other.scan(number)).clearances(p_S)
        return [
            rows[found > _PAST],
            rows[np.abs(found) <= _SHOWN_WITHIN],
            rows[found < -_SHOWN_WITHIN],
        ]

    threads = ThreadPoolExecutor(num_cores())
    try:
        found = threads.map(look, chosen)
        what = f"free space of {other.side}"
        for kinds in track(found, what, len(chosen), "views"):
            for count, rows in zip(counts, kinds, strict=True):
                count[rows] += 1
    finally:
        # An interrupt does not wait for the views that have not begun.
        threads.shutdown(cancel_futures=True)
    return _Views(*counts)


def _field_of_view(p_S: np.ndarray) -> tuple[float, float, float]:
    """Returns the limits of a field of view, from its returns (N, 3) [m].

    The field of view reaches from the lowest to the highest return, and as far
    as the farthest return. On each side, the `_STRAYS` outermost returns do not
    count.

    Returns:
        Least and greatest slope; greatest distance [m].
    """
    slopes = np.sort(_slopes(p_S))
    strays = min(_STRAYS, (len(p_S) - 1) // 2)
    low, high = slopes[[strays, -1 - strays]]
    return low, high, np.sort(np.linalg.norm(p_S, axis=1))[-1 - strays]


def _slopes(p_S: np.ndarray) -> np.ndarray:
    """Returns height over horizontal distance of points (N, 3), (N,)."""
    return p_S[:, 2] / np.maximum(np.hypot(p_S[:, 0], p_S[:, 1]), _TINY)


def _check_scans(session: Session) -> None:
    """Checks that a session has scans with poses."""
    if len(session.X_WS) == 0:
        raise InputError(
            f"{session.folder}: no poses.txt and Scans; this baseline needs "
            "them"
        )


# Name of a detector -> function that labels the first map by the second.
BASELINES: dict[str, Callable[[Session, Session], np.ndarray]] = {
    "free-space": by_free_space,
    "distance": by_distance,
    "m3c2": by_m3c2,
}


def _py4dgeo() -> Any:
    try:
        py4dgeo = importlib.import_module("py4dgeo")
    except ImportError as error:
        raise InputError(
            f"--baseline: m3c2 needs py4dgeo ({error}); pip install "
            "'cns-eval[map-update]'"
        ) from None
    # Without this, py4dgeo would write to stdout and to a file in the current
    # folder.
    logging.getLogger("py4dgeo").handlers.clear()
    return py4dgeo
