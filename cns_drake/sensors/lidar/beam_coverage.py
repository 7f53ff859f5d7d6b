"""The directions that the beams of a LiDAR cover."""

import numpy as np

from evaluation.base import arcsin, arctan2

# Width of a cell in elevation and in azimuth [deg].
_CELL_DEG = 0.25
# Number of cells in elevation.
_ROWS = round(180 / _CELL_DEG)
# Number of cells in azimuth.
_COLUMNS = round(360 / _CELL_DEG)
# How far a beam covers its surroundings: 1.5 deg, in cells.
_NEAR_CELLS = 6
# Half of the widest gap between beams that still counts as field of view: 12
# deg, in cells.
_GAP_CELLS = 48


class BeamCoverage:
    """The directions that the beams of a revolution cover.

    A beam covers all directions inside the field of view whose elevation and
    azimuth differ from the beam's by at most 1.5 deg each.

    The field of view consists of cells of 0.25 deg: the cells of the beams; the
    neighbours of the beams' cells, because rounding can move a point into a
    neighbour; and all cells between beams that are up to 24 deg apart (a
    morphological closing).
    """

    def __init__(self, d_Sset: np.ndarray):
        """Takes the directions of the beams, (N, 3) unit vectors in S."""
        # Imported here: the rest of the module needs no library that is slow
        # to load.
        from scipy.ndimage import maximum_filter, minimum_filter

        hit = np.zeros((_ROWS, _COLUMNS), np.uint8)
        hit[_cell_indices(d_Sset)] = 1
        # Azimuths go round, elevations do not.
        modes = ("constant", "wrap")
        field = maximum_filter(hit, 2 * _GAP_CELLS + 1, mode=modes)
        # One cell less: those beside the beams stay.
        field = minimum_filter(field, 2 * _GAP_CELLS - 1, mode=modes, cval=1)
        near = maximum_filter(hit, 2 * _NEAR_CELLS + 1, mode=modes)
        self._is_covered = (near & field).astype(bool)

    def covers(self, d_Sset: np.ndarray) -> np.ndarray:
        """Returns which directions a revolution's beams cover, (N,) bool.

        Args:
            d_Sset: (N, 3) unit directions, expressed in S.
        """
        return self._is_covered[_cell_indices(d_Sset)]


def _cell_indices(d_Sset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns row and column of the cells of unit directions (N, 3)."""
    x, y, z = d_Sset.T
    elevation_deg = np.degrees(arcsin(np.clip(z, -1.0, 1.0))) + 90.0
    azimuth_deg = np.degrees(arctan2(y, x)) + 180.0
    # The direction straight up is rounded to the upper limit.
    rows = np.minimum((elevation_deg / _CELL_DEG).astype(np.int64), _ROWS - 1)
    return rows, (azimuth_deg / _CELL_DEG).astype(np.int64) % _COLUMNS
