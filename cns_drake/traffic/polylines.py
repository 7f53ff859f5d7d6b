"""Evenly spaced points of lanes and walkways."""

import numpy as np

from cns_drake.base import distances_along, step_lengths

# Greatest distance between the points of lanes and walkways [m].
SPACING = 0.5


def resampled(points: np.ndarray, spacing: float = SPACING) -> np.ndarray:
    """Returns evenly spaced points (N, 3) along a polyline (M, 3) [m].

    Neighbouring points are at most `spacing` apart [m]. A corner is dropped if
    it coincides with the previous corner.
    """
    steps = step_lengths(points)
    points = points[np.append(True, steps > 1e-6)]
    along = distances_along(points)
    count = max(2, int(np.ceil(along[-1] / spacing)) + 1)
    wanted = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(wanted, along, x) for x in points.T])
