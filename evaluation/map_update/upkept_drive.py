"""Drives whose scans show a map that later drives updated.

The scan at a place of an older drive is replaced by a scan of the updated map
from the same place: the old scan without the points that are gone, and with all
new points that are not occluded. The maps for localisation and the places for
recognition therefore come from one map.
"""

import numpy as np

from evaluation.base import poses, xyz
from evaluation.drives import Drive, MovedDrive
from evaluation.map_update.upkeep import Updates
from evaluation.recognition import TOLERANCE, SeenSurfaces

# Of the new points in a direction, the nearest one is seen; directions are this
# far apart [rad].
_BEAMS_APART = np.deg2rad(0.35)


class UpkeptDrive(MovedDrive):
    """A drive of a map that later drives updated."""

    def __init__(self, drive: Drive, updates: Updates, number: int):
        """Wraps a drive.

        Args:
            drive: the drive.
            updates: what the drives of the map changed.
            number: number of the drive among the drives of the map.
        """
        super().__init__(drive, drive.X_WS, drive.world, drive.datum)
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
        """Returns the later drives' new points within the range of a scan.

        Args:
            X_WS: (4, 4) pose of the sensor.
            p_S: (N, 3) points of the scan [m].

        Returns:
            (M, 3) points in S [m].
        """
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
    """Returns the elevations of points (N, 3), (N,) [rad]."""
    return np.arctan2(p_S[:, 2], np.hypot(p_S[:, 0], p_S[:, 1]))
