"""The field of view of a turn's beams."""

from __future__ import annotations

import numpy as np

# Numbers of cells in elevation and in azimuth; a cell has a width of 1 deg.
_ROWS, _COLUMNS = 180, 360


class BeamCoverage:
    """The directions that the beams of a turn cover.

    A beam covers its cell of 1 deg by 1 deg in elevation and azimuth, and the
    eight cells around it.
    """

    def __init__(self, d_Sset: np.ndarray):
        """Covers the cells about beams (N, 3), unit directions in S."""
        hit = np.zeros((_ROWS, _COLUMNS), bool)
        hit[_cells(d_Sset)] = True
        beside = hit | np.roll(hit, 1, axis=1) | np.roll(hit, -1, axis=1)
        self._is_covered = beside.copy()
        self._is_covered[1:] |= beside[:-1]
        self._is_covered[:-1] |= beside[1:]

    def covers(self, d_Sset: np.ndarray) -> np.ndarray:
        """Returns which directions (N, 3) in S are covered, (N,) bool."""
        return self._is_covered[_cells(d_Sset)]


def _cells(d_Sset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns row and column of the cells of unit directions (N, 3)."""
    x, y, z = d_Sset.T
    elevation_deg = np.degrees(np.arcsin(np.clip(z, -1.0, 1.0))) + 90.0
    azimuth_deg = np.degrees(np.arctan2(y, x)) + 180.0
    # The direction straight up is rounded to the upper limit.
    rows = np.minimum(elevation_deg.astype(np.int64), _ROWS - 1)
    return rows, azimuth_deg.astype(np.int64) % _COLUMNS
