"""Uniform quintic B-splines, and their derivatives."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import BsplineBasis
from pydrake.trajectories import BsplineTrajectory

# Quintic, with four continuous derivatives: the accelerations of steered wheels
# need them.
ORDER = 6
# Number of control points on each side of a knot that affect the value there.
REACH = ORDER // 2 - 1


def make_uniform_spline(
    control_points: np.ndarray, spacing: float
) -> BsplineTrajectory:
    """Returns a quintic B-spline with evenly spaced control points.

    The spline starts at the first control point and ends at the last control
    point. At the parameter i * spacing, the spline passes near control point i.
    If all control points lie on a straight line, the spline is this line.

    A bound on all control points is also a bound on the spline. A bound on the
    difference quotients of the control points is also a bound on the
    derivatives of the spline.

    Args:
        control_points: (N, D) points of any dimension D, N >= 3.
        spacing: difference of the parameter between two control points.
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
    """A spline and its first few derivatives, to evaluate at many parameters.

    Attributes:
        end: greatest parameter of the spline.
    """

    def __init__(self, spline: BsplineTrajectory, count: int):
        """Takes the spline and the number of derivatives to prepare."""
        self._splines = [spline]
        self._splines += [spline.MakeDerivative(k) for k in range(1, count + 1)]
        self.end = spline.end_time()

    def evaluate(self, parameter: ArrayLike) -> list[np.ndarray]:
        """Returns the value and the derivatives of the spline at N parameters.

        The list contains the values, the first derivatives, the second
        derivatives, and so on. Each entry has the shape (N, D) for a spline of
        D dimensions. Parameters beyond an end of the spline give the results at
        this end.
        """
        parameter = np.clip(parameter, 0.0, self.end)
        return [spline.vector_values(parameter).T for spline in self._splines]
