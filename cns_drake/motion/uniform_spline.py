"""Quintic B-splines over evenly spaced control points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import BsplineBasis
from pydrake.trajectories import BsplineTrajectory

# Quintic: four continuous derivatives, as the accelerations of steered
# wheels need.
ORDER = 6
# Control points that weigh on the value at a knot, on each side of it.
REACH = ORDER // 2 - 1


def make_uniform_spline(
    control_points: np.ndarray, spacing: float
) -> BsplineTrajectory:
    """Returns the spline with one control point for each knot.

    Such a spline never leaves the convex hull of ORDER neighbouring control
    points, its derivatives never that of their difference quotients, and it
    reproduces a straight line: bounds on the control points are bounds on
    the curve. It starts at 0 and has its i-th knot at i * spacing. Beyond
    both ends the control points are mirrored in the last one, so that the
    curve ends in it.

    Args:
        control_points: (N, D) values at the knots, N > REACH.
        spacing: distance of the knots in the parameter.
    """
    points = np.asarray(control_points, dtype=float)
    points = np.concatenate(
        [
            2 * points[0] - points[REACH:0:-1],
            points,
            2 * points[-1] - points[-2 : -REACH - 2 : -1],
        ]
    )
    # The domain begins at the last of the first ORDER knots.
    knots = spacing * (np.arange(len(points) + ORDER) - (ORDER - 1))
    basis = BsplineBasis(ORDER, list(knots))
    return BsplineTrajectory(basis, [point[:, None] for point in points])


class SplineDerivatives:
    """A spline with its first derivatives, evaluated at many parameters."""

    def __init__(self, spline: BsplineTrajectory, count: int):
        """Prepares the value and `count` derivatives."""
        self._splines = [spline]
        self._splines += [spline.MakeDerivative(k) for k in range(1, count + 1)]
        self.end = spline.end_time()

    def evaluate(self, parameter: ArrayLike) -> list[np.ndarray]:
        """Returns value and derivatives, each (N, D), at (N,) parameters."""
        parameter = np.clip(parameter, 0.0, self.end)
        return [spline.vector_values(parameter).T for spline in self._splines]
