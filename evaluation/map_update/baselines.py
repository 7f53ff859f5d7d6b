"""Baselines that label the points of two maps without knowing the ground truth.

- `distance`: a point is kept if the other map has a point within 0.5 m;
  otherwise the point is gone or new. No point is unobserved.
- `m3c2` (the extra `map-update`; Lague et al., ISPRS J. 82, 2013, in py4dgeo):
  the distance between the two maps along the normal of the surface. A point is
  gone or new if this distance exceeds both the level of detection and 0.1 m,
  otherwise kept. It is unobserved if a map lacks the points to measure.
- `free-space`: cells of 0.2 m are compared with each scan of the other drive.
  The three returns nearest to the direction of a cell define a surface. A scan
  sees past the cell if this surface lies behind the cell, or if there is no
  return although the LiDAR looks in this direction. A scan shows the cell if
  the surface passes through it. The first rule that applies gives the label:
  kept if the other map has a point near the cell; gone or new if a scan sees
  past it; kept if enough scans show it; otherwise unobserved. Where more than a
  fifth of the labelled points in a cube of 1 m are gone or new, the kept points
  there are relabelled as well, except points with a point of the other map
  within 0.12 m.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import importlib
import logging
from typing import Any

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.process import num_cores
from cns_drake.base.progress import track
from evaluation.drives.sampling import sample_frames
from evaluation.map_update.labels import SIDES
from evaluation.map_update.scores import Labels, nearest
from evaluation.map_update.sessions import Pair, Session
from evaluation.recognition.seen_surfaces import SeenSurfaces

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


# The settings of `free-space` below were fitted on two pairs of drives:
# Metropolis 01 and 04, whose paths hardly meet, and Suburbia after five years.

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


def run_baseline(name: str, pair: Pair) -> Labels:
    """Returns the labels of both maps by a shipped change detector.

    Args:
        name: name of the detector, a key of `BASELINES`.
        pair: the two sessions.

    Raises:
        InputError: the sessions lack data that the detector needs, or its
            package is not installed.
    """
    label = BASELINES[name]
    return Labels(
        *(label(mine, theirs) for mine, theirs in (pair, (pair.B, pair.A)))
    )


def by_distance(mine: Session, theirs: Session) -> np.ndarray:
    """Returns the labels (N,) uint8 of a map by the baseline `distance`.

    A point is kept if the other map has a point within 0.5 m. Otherwise it is
    gone (older map) or new (newer map); see
    `evaluation.map_update.labels.Label`.

    Args:
        mine: the map with N points, and its drive.
        theirs: the map of the other drive.
    """
    _, kept, changed = SIDES[mine.side]
    far = np.isinf(nearest(mine.points, theirs.points, _APART))
    return np.where(far, changed, kept).astype(np.uint8)


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
    unobserved, kept, changed = SIDES[mine.side]
    _check_scans(theirs)
    labels = np.full(len(mine.points), kept, np.uint8)
    distances = nearest(mine.points, theirs.points, _KEPT_WITHIN)
    far = np.isinf(distances)
    points = mine.points[far]
    cells = np.floor(points / _CELL).astype(np.int64)
    _, first, cell_of = np.unique(
        cells, axis=0, return_index=True, return_inverse=True
    )
    past, shown, hidden = _count_views(points[first], theirs)
    needed = np.minimum(_SHOWN_SHARE * hidden, _ENOUGH)
    is_shown = (shown > 0) & (shown >= needed)
    found = np.where(is_shown, kept, unobserved)
    found = np.where(past > 0, changed, found)
    labels[far] = found[cell_of.ravel()]
    # A new object may pass near to one that is gone.
    is_changed = labels == changed
    known = is_changed | (labels == kept)
    blocks = np.floor(mine.points[known] / _CUBE).astype(np.int64)
    blocks -= blocks.min(axis=0, initial=0)
    sizes = blocks.max(axis=0, initial=0) + 1
    _, block_of = np.unique(
        np.ravel_multi_index(tuple(blocks.T), tuple(sizes)), return_inverse=True
    )
    part = np.bincount(block_of, is_changed[known]) / np.bincount(block_of)
    is_beside = (part[block_of] > _CHANGED_SHARE) & (
        distances[known] > _STILL_KEPT_WITHIN
    )
    labels[np.flatnonzero(known)[is_beside]] = changed
    return labels


def _count_views(points: np.ndarray, other: Session) -> np.ndarray:
    """Returns how many scans see past each point, show it, or hide it.

    The module's text on `free-space` defines the first two. A scan hides a
    point if a surface lies in front of it.

    Returns:
        (3, N) counts for the points (N, 3).
    """
    counts = np.zeros((3, len(points)), np.int32)
    chosen = sample_frames(other.X_WS[:, :3, 3], _SPACING).tolist()
    # The field of view reaches from the lowest to the highest return, and as
    # far as the farthest, without the strays.
    some = chosen[:: max(len(chosen) // 20, 1)]
    scans = [other.scan(number) for number in some]
    returns = np.concatenate([np.zeros((0, 3)), *scans])
    if len(returns) == 0:
        return counts
    slopes = np.sort(_slopes(returns))
    strays = min(_STRAYS, (len(returns) - 1) // 2)
    low, high = slopes[[strays, -1 - strays]]
    reach = np.sort(np.linalg.norm(returns, axis=1))[-1 - strays]

    def look(number: int) -> list[np.ndarray]:
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

    with ThreadPoolExecutor(num_cores()) as threads:
        found = threads.map(look, chosen)
        what = f"free space of {other.side}"
        for kinds in track(found, what, len(chosen), "views"):
            for count, rows in zip(counts, kinds, strict=True):
                count[rows] += 1
    return counts


def _slopes(p_S: np.ndarray) -> np.ndarray:
    return p_S[:, 2] / np.maximum(np.hypot(p_S[:, 0], p_S[:, 1]), 1e-9)


def by_m3c2(mine: Session, theirs: Session) -> np.ndarray:
    """Returns the labels (N,) uint8 of a map by the baseline `m3c2`.

    A point is gone (older map) or new (newer map) if the M3C2 distance between
    the two maps at this point exceeds the distance's level of detection and 0.1
    m. Otherwise it is kept, or unobserved if a map lacks points to measure this
    distance. See `evaluation.map_update.labels.Label`.

    Args:
        mine: the map with N points, and its drive.
        theirs: the map of the other drive.
    """
    py4dgeo = _py4dgeo()
    unobserved, kept, changed = SIDES[mine.side]
    epochs = [py4dgeo.Epoch(one.points) for one in (mine, theirs)]
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


BASELINES: dict[str, Callable[[Session, Session], np.ndarray]] = {
    "free-space": by_free_space,
    "distance": by_distance,
    "m3c2": by_m3c2,
}


def _check_scans(session: Session) -> None:
    if len(session.X_WS) == 0:
        raise InputError(
            f"{session.folder}: no poses.txt and Scans; this baseline needs "
            "them"
        )


def _py4dgeo() -> Any:
    try:
        py4dgeo = importlib.import_module("py4dgeo")
    except ImportError as error:
        raise InputError(
            f"--baseline: m3c2 needs py4dgeo ({error}); pip install "
            "'cns-drake[map-update]'"
        ) from None
    # Without this, py4dgeo would write to stdout and to a file in the current
    # folder.
    logging.getLogger("py4dgeo").handlers.clear()
    return py4dgeo
