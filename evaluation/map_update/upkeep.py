"""Maps of several drives that are updated after each drive.

The map A begins as the map of the first drive. After each further drive B, a
change detector labels the points of A and of the map of B (see
`evaluation.map_update.baselines`). Points that are gone are removed from A, and
the points of B are added.

The scan at a place of an older drive is replaced by a scan of the updated map
from the same place: the old scan without the points that are gone, and with all
new points that are not occluded. The maps for localisation and the places for
recognition therefore come from one map.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cns_drake.base import poses
from cns_drake.base.drives.drive import Drive
from cns_drake.base.points import xyz
from evaluation.drives.drive_views import MovedDrive
from evaluation.map_update.baselines import BASELINES
from evaluation.map_update.labels import Label
from evaluation.map_update.map_builder import THINNED
from evaluation.map_update.scores import Labels
from evaluation.map_update.sessions import Pair, Session
from evaluation.maps.grid_cells import cell_keys
from evaluation.recognition.seen_surfaces import TOLERANCE, SeenSurfaces

# No map is updated: all drives are merged.
NOT_MAINTAINED = "none"
# Exact labels decide what is gone.
TRUTH = "truth"
# What updates a map.
MAINTAINERS = (*BASELINES, TRUTH)
# A point of a scan is gone if most points of the map in its cube are. Scans are
# denser than maps, whose own cells are too small for this [m].
_CUBE = 0.4
# Of the new points in a direction, the nearest one is seen; directions are this
# far apart [rad].
_BEAMS_APART = np.deg2rad(0.35)

# A change detector: labels the points of the map so far and of the next drive's
# map.
Detect = Callable[[Pair], Labels]


@dataclass(frozen=True)
class Updates:
    """Changes that later drives made to the maps of several drives.

    Attributes:
        corner: (3,) numbers along x, y and z of the cube at the map's corner.
        gone: (G,) int64 numbers of the cubes whose points are gone, ascending.
        added: for each drive, the points (N, 3) in W that the drive added to
            the map, without those that were removed later [m].
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
        self._drive_of = np.zeros(0, np.int16)
        self._is_added = np.zeros(0, bool)
        self._gone: list[np.ndarray] = []
        self._number = 0

    def add(self, session: Session, stands: np.ndarray, detect: Detect) -> None:
        """Updates the map by the next drive.

        Args:
            session: map of N points, scans and poses of the drive. The scans
                are moved to the folder of the map.
            stands: (N,) bool, points that may be added to the map. All other
                points are on moving objects.
            detect: compares the map with the drive; not called for the first
                drive, which has no map to compare with.
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
            labels = detect(Pair(self._map, session))
            stays = labels.A != Label.GONE
            old = self._map.points
            self._gone.append(old[~stays])
            old = old[stays]
            is_free = ~_in_cells_of(session.points, old)
            is_new = np.isin(labels.B, (Label.NEW, Label.NEWLY_SEEN))
            points = np.concatenate([old, session.points[is_free]])
            self._drive_of = np.concatenate(
                [
                    self._drive_of[stays],
                    np.full(int(is_free.sum()), self._number, np.int16),
                ]
            )
            self._is_added = np.concatenate(
                [self._is_added[stays], is_new[is_free]]
            )
            X_WS = np.concatenate([self._map.X_WS, session.X_WS])
        self._move_scans(session)
        nothing = np.zeros(len(points), np.uint16)
        self._map = Session(self._folder, points, nothing, nothing, X_WS)
        self._number += 1

    def _move_scans(self, session: Session) -> None:
        scans = self._folder / "Scans"
        scans.mkdir(parents=True, exist_ok=True)
        first = 0 if self._map is None else len(self._map.X_WS)
        for number in range(len(session.X_WS)):
            target = scans / f"{first + number:06d}.pcd"
            (session.folder / "Scans" / f"{number:06d}.pcd").rename(target)

    def finish(self) -> Updates:
        """Returns what the drives changed."""
        assert self._map is not None
        points = self._map.points
        gone = np.concatenate([np.zeros((0, 3)), *self._gone])
        every = np.concatenate([points, gone])
        cubes = np.floor(every / _CUBE)
        corner = cubes.min(axis=0, initial=0.0)
        keys, _ = cell_keys(cubes - corner)
        is_gone = np.arange(len(every)) >= len(points)
        numbers, cube_of = np.unique(keys, return_inverse=True)
        share = np.bincount(cube_of.ravel(), is_gone) / np.maximum(
            np.bincount(cube_of.ravel()), 1
        )
        added = [
            points[self._is_added & (self._drive_of == k)]
            for k in range(self._number)
        ]
        return Updates(corner, numbers[share > 0.5], added)


def _in_cells_of(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Returns which points (N, 3) share a cell of a map with others, (N,)."""
    cells = [np.floor(one / THINNED) for one in (points, others)]
    corner = np.concatenate(cells).min(axis=0, initial=0.0)
    (keys, _), (taken, _) = (cell_keys(one - corner) for one in cells)
    return np.isin(keys, taken)


class UpkeptDrive(MovedDrive):
    """A drive of a map that later drives updated."""

    def __init__(self, drive: Drive, updates: Updates, number: int):
        """Wraps a drive.

        Args:
            drive: the drive.
            updates: what the drives of the map changed.
            number: number of the drive among them.
        """
        super().__init__(drive, drive.X_WS, drive.world_frame, drive.datum)
        self._updates = updates
        later = updates.added[number + 1 :]
        self._added = np.concatenate([np.zeros((0, 3)), *later])

    def scan(self, index: int) -> np.ndarray:
        scan = super().scan(index)
        X_WS = self.X_WS[index]
        p_S = xyz(scan)
        gone = self._updates.is_gone(poses.transform(X_WS, p_S))
        new = visible_points(p_S, gone, self._new_points(X_WS, p_S))
        if not (gone.any() or len(new)):
            return scan
        hidden = np.zeros(len(scan), bool)
        if len(new):
            hidden = SeenSurfaces.of(new).hides(p_S)
        kept = scan[~(gone | hidden)]
        more = np.zeros(len(new), scan.dtype)
        for column, name in enumerate("xyz"):
            more[name] = new[:, column]
        return np.concatenate([kept, more])

    def _new_points(self, X_WS: np.ndarray, p_S: np.ndarray) -> np.ndarray:
        """Returns the later drives' new points within range, in S."""
        if len(self._added) == 0 or len(p_S) == 0:
            return np.zeros((0, 3))
        reach = float(np.nanmax(np.linalg.norm(p_S, axis=1)))
        offsets = self._added - X_WS[:3, 3]
        near = np.einsum("ij,ij->i", offsets, offsets) <= reach**2
        return offsets[near] @ X_WS[:3, :3]


def visible_points(
    scan: np.ndarray, gone: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Returns new points that a scan would show.

    A new point is visible if it lies within the scan's elevations, and in front
    of all surfaces that the scan shows and that are not gone. Of the visible
    points in one direction, only the nearest point is returned.

    Args:
        scan: (N, 3) points in the frame of the sensor S [m].
        gone: (N,) bool, points of the scan that are gone.
        points: (M, 3) new points in S [m].

    Returns:
        (K, 3) points in S [m].
    """
    if len(points) == 0 or len(scan) == 0:
        return np.zeros((0, 3))
    low, high = np.nanmin(_elevations(scan)), np.nanmax(_elevations(scan))
    elevations = _elevations(points)
    points = points[(elevations >= low) & (elevations <= high)]
    clearance = SeenSurfaces.of(scan[~gone]).clearances(points)
    points = points[clearance > TOLERANCE]
    ranges = np.linalg.norm(points, axis=1)
    azimuths = np.arctan2(points[:, 1], points[:, 0])
    angles = np.stack([azimuths, _elevations(points)], axis=1)
    order = np.argsort(ranges, kind="stable")
    beams = np.floor(angles[order] / _BEAMS_APART)
    _, first = np.unique(beams, axis=0, return_index=True)
    return points[order[np.sort(first)]]


def _elevations(p_S: np.ndarray) -> np.ndarray:
    return np.arctan2(p_S[:, 2], np.hypot(p_S[:, 0], p_S[:, 1]))
