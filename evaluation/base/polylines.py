"""Lengths along lines through points: arc lengths of polylines."""

import numpy as np


def step_lengths(points: np.ndarray) -> np.ndarray:
    """Returns the distances (N - 1,) between neighbouring points (N, D) [m]."""
    return np.linalg.norm(np.diff(points, axis=0), axis=1)


def length_of(points: np.ndarray) -> float:
    """Returns the length of the line through points (N, D) [m]."""
    return float(step_lengths(points).sum())


def distances_along(points: np.ndarray) -> np.ndarray:
    """Returns the distances (N,) of points (N, D) along their line [m].

    The first point is at 0.
    """
    return np.append(0.0, np.cumsum(step_lengths(points)))
