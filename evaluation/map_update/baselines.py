"""Baselines that label the points of two maps without knowing the ground truth.

- `distance`: a point is kept if the other map has a point within 0.5 m;
  otherwise the point is gone or new. No point is unobserved.
- `m3c2` (the extra `map-update`; Lague et al., ISPRS J. 82, 2013, in py4dgeo):
  the distance between the two maps is measured along the normal of the surface.
  A point is gone or new if this distance exceeds both the level of detection
  and 0.1 m. A point is unobserved if one of the maps has too few points around
  this point to compute the distance. All other points are kept.
- `free-space`: the scans of the other drive decide, see
  `evaluation.map_update.free_space`.
"""

from collections.abc import Callable
import importlib
import logging
from typing import Any

import numpy as np

from cns_drake.base import InputError, track
from evaluation.map_update.free_space import by_free_space
from evaluation.map_update.labels import SIDES, PairLabels
from evaluation.map_update.nearest_points import nearest_distances
from evaluation.map_update.sessions import Session, SessionPair

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
            "'cns-drake[map-update]'"
        ) from None
    # Without this, py4dgeo would write to stdout and to a file in the current
    # folder.
    logging.getLogger("py4dgeo").handlers.clear()
    return py4dgeo
