"""A map of several drives, which is updated after each drive.

The map A begins as the map of the first drive. After each further drive B, a
change detector labels the points of A and of the map of B (see
`evaluation.map_update.baselines`). Points that are gone are removed from A, and
the points of B are added. `evaluation.map_update.upkept_drive` shows the
updated map in the scans of the drives.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from evaluation.map_update.baselines import BASELINES
from evaluation.map_update.labels import Label, PairLabels
from evaluation.map_update.map_builder import CELL
from evaluation.map_update.sessions import Session, SessionPair, scan_path
from evaluation.maps import cell_keys

# No map is updated: all drives are merged.
NOT_MAINTAINED = "none"
# Exact labels decide what is gone.
TRUTH = "truth"
# What updates a map.
MAINTAINERS = (*BASELINES, TRUTH)
# A point of a scan is gone if most points of the map in its cube are. Scans are
# denser than maps, whose own cells are too small for this [m].
_CUBE = 0.4

# A change detector: labels the points of the map so far and of the next drive's
# map.
Detect = Callable[[SessionPair], PairLabels]


@dataclass(frozen=True)
class Updates:
    """Changes that later drives made to the maps of several drives.

    Attributes:
        corner: (3,) numbers along x, y and z of the cube at the map's corner.
        gone: (G,) int64 numbers of the cubes whose points are gone, ascending.
        added: for each drive, the points (N, 3) in W that the drive added to
            the map, without points that were removed later [m].
    """

    corner: np.ndarray
    gone: np.ndarray
    added: list[np.ndarray]

    def is_gone(self, points_W: np.ndarray) -> np.ndarray:
        """Returns which points (N, 3) in W [m] are gone, (N,) bool."""
        cubes = np.floor(points_W / _CUBE) - self.corner
        keys, inside = cell_keys(cubes)
        found = np.zeros(len(points_W), bool)
        found[inside] = np.isin(keys, self.gone)
        return found


class UpkeptMap:
    """A map that is updated drive by drive."""

    def __init__(self, folder: Path):
        """Starts without a map.

        Args:
            folder: folder for the scans of all drives so far; it must be empty.
        """
        self._folder = folder
        self._map: Session | None = None
        # For each point of the map, the number of the drive that it comes from,
        # and whether the drive added it as new.
        self._drive_of = np.zeros(0, np.int16)
        self._is_added = np.zeros(0, bool)
        # Points in W that were removed from the map, or not added to it [m].
        self._gone: list[np.ndarray] = []
        # Number of drives so far.
        self._number = 0

    def add(self, session: Session, stands: np.ndarray, detect: Detect) -> None:
        """Updates the map by the next drive.

        Args:
            session: map of N points, scans and poses of the drive. The scans
                are moved to the folder of the map.
            stands: (N,) bool, points that may be added to the map. All other
                points are on moving objects.
            detect: function that compares the map with the drive. It is not
                called for the first drive, which has no map to compare with.
        """
        self._gone.append(session.points[~stands])
        session = replace(
            session,
            points=session.points[stands],
            classes=session.classes[stands],
            instances=session.instances[stands],
        )
        if self._map is None:
            self._drive_of = np.zeros(len(session.points), np.int16)
            self._is_added = np.zeros(len(session.points), bool)
            points, X_WS = session.points, session.X_WS
        else:
            labels = detect(SessionPair(self._map, session))
            points = self._merge(self._map.points, session.points, labels)
            X_WS = np.concatenate([self._map.X_WS, session.X_WS])
        self._move_scans(session)
        nothing = np.zeros(len(points), np.uint16)
        self._map = Session(self._folder, points, nothing, nothing, X_WS)
        self._number += 1

    def _merge(
        self, old: np.ndarray, new: np.ndarray, labels: PairLabels
    ) -> np.ndarray:
        """Returns the points of the map after a drive, (K, 3) [m].

        What is known of each point is updated alike. Points of the drive in
        cells that the map occupies are left out.

        Args:
            old: (N, 3) points of the map so far in W [m].
            new: (M, 3) points of the drive's map in W [m].
            labels: labels of both.
        """
        stays = labels.A != Label.GONE
        self._gone.append(old[~stays])
        is_free = ~_in_cells_of(new, old[stays])
        is_new = np.isin(labels.B, (Label.NEW, Label.NEWLY_SEEN))
        self._drive_of = np.concatenate(
            [
                self._drive_of[stays],
                np.full(int(is_free.sum()), self._number, np.int16),
            ]
        )
        self._is_added = np.concatenate(
            [self._is_added[stays], is_new[is_free]]
        )
        return np.concatenate([old[stays], new[is_free]])

    def _move_scans(self, session: Session) -> None:
        """Moves a drive's scans behind the scans in the folder of the map."""
        first = 0 if self._map is None else len(self._map.X_WS)
        scan_path(self._folder, first).parent.mkdir(parents=True, exist_ok=True)
        for number in range(len(session.X_WS)):
            target = scan_path(self._folder, first + number)
            scan_path(session.folder, number).rename(target)

    def finish(self) -> Updates:
        """Returns what the drives changed; at least one has been added."""
        assert self._map is not None
        points = self._map.points
        gone = np.concatenate([np.zeros((0, 3)), *self._gone])
        corner, cubes = _gone_cubes(points, gone)
        added = [
            points[self._is_added & (self._drive_of == k)]
            for k in range(self._number)
        ]
        return Updates(corner, cubes, added)


def _gone_cubes(
    points: np.ndarray, gone: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the cubes of which most points are gone.

    Args:
        points: (N, 3) points of the updated map in W [m].
        gone: (M, 3) points that are gone in W [m].

    Returns:
        See `Updates.corner` and `Updates.gone`.
    """
    every = np.concatenate([points, gone])
    cubes = np.floor(every / _CUBE)
    corner = cubes.min(axis=0, initial=0.0)
    keys, _ = cell_keys(cubes - corner)
    is_gone = np.arange(len(every)) >= len(points)
    numbers, cube_of = np.unique(keys, return_inverse=True)
    share = np.bincount(cube_of.ravel(), is_gone) / np.maximum(
        np.bincount(cube_of.ravel()), 1
    )
    return corner, numbers[share > 0.5]


def _in_cells_of(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Returns which points (N, 3) share a cell with points of a map, (N,)."""
    cells = [np.floor(cloud / CELL) for cloud in (points, others)]
    corner = np.concatenate(cells).min(axis=0, initial=0.0)
    (keys, _), (taken, _) = (cell_keys(corners - corner) for corners in cells)
    return np.isin(keys, taken)
