"""Angles in the plane, and units of time."""

from typing import TypeVar

import numpy as np

NS_PER_S = 1_000_000_000
Angle = TypeVar("Angle", float, np.ndarray)


def wrapped(angle: Angle) -> Angle:
    """Wraps an angle, or every angle of an array, to [-pi, pi) [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
