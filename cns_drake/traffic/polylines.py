"""Polylines of lanes and walkways: their lengths, and evenly spaced points."""

import numpy as np

# Greatest distance between the points of lanes and walkways [m].
SPACING = 0.5


def resampled(points: np.ndarray, spacing: float = SPACING) -> np.ndarray:
    """Returns evenly spaced points (N, 3) along a polyline (M, 3) [m].

    Neighbouring points are at most `spacing` apart [m]. A corner is dropped if
    it coincides with the previous corner.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    points = points[np.append(True, steps > 1e-6)]
    along = distances_along(points)
    count = max(2, int(np.ceil(along[-1] / spacing)) + 1)
    wanted = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(wanted, along, x) for x in points.T])


def length_of(points: np.ndarray) -> float:
    """Returns the length of a line through points (N, 2 or 3) [m]."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def distances_along(points: np.ndarray) -> np.ndarray:
    """Returns the distances of a polyline's points along the polyline [m].

    The first point is at 0.

    Args:
        points: (N, 2) or (N, 3) points [m].

    Returns:
        (N,) distances [m].
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.append(0.0, np.cumsum(steps))
