"""Angles in the plane."""

from typing import TypeVar

import numpy as np

Angle = TypeVar("Angle", float, np.ndarray)


def wrapped(angle: Angle) -> Angle:
    """Returns an angle, or each of an array, in [-pi, pi) [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
