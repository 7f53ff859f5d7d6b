"""The smooth curve that a vehicle follows, and its derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import BsplineBasis
from pydrake.trajectories import BsplineTrajectory

from cns_drake.base.elementary import arctan2

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
    reproduces a straight line: bounds on the control points are bounds on the
    curve. It starts at 0 and has its i-th knot at i * spacing. Beyond both ends
    the (N, D) control points, N > REACH, are mirrored in the last one, so that
    the curve ends in it.
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


# Distance of the places at which bends are measured, far below that of the
# knots between which curvature changes [m].
_BEND_STEP = 0.1


@dataclass(frozen=True)
class PathJet:
    """The path and its derivatives with respect to the path parameter u.

    A name with n leading `d` is an n-th derivative. All are arrays over the
    N parameters that were asked for.

    Attributes:
        p, dp, ddp: (N, 3) position in the world.
        yaw, dyaw, ddyaw: heading about the world's z, without jumps [rad].
        climb, dclimb, ddclimb: angle of the tangent above the horizon [rad].
        speed, dspeed, ddspeed: arc length per parameter, about 1.
        turn, dturn, ddturn: rotation about the vehicle's own z [rad].
    """

    p: np.ndarray
    dp: np.ndarray
    ddp: np.ndarray
    yaw: np.ndarray
    dyaw: np.ndarray
    ddyaw: np.ndarray
    climb: np.ndarray
    dclimb: np.ndarray
    ddclimb: np.ndarray
    speed: np.ndarray
    dspeed: np.ndarray
    ddspeed: np.ndarray
    turn: np.ndarray
    dturn: np.ndarray
    ddturn: np.ndarray

    def rows(self, which: slice) -> PathJet:
        """Returns the values at some of the parameters."""
        values = (getattr(self, field.name) for field in fields(self))
        return PathJet(*(value[which] for value in values))


@dataclass(frozen=True)
class PathSection:
    """The path from the last knot before each of N parameters up to it.

    `knot` has the (N,) numbers of the knots, `length` the (N,) parameters since
    them, and `jet` the path at the nodes of Gauss and Legendre's quadrature,
    those of the first section first.
    """

    knot: np.ndarray
    length: np.ndarray
    jet: PathJet

    # The error is far below a micrometre in a section, where the path is a
    # polynomial.
    NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)

    def integrate(self, values: np.ndarray) -> np.ndarray:
        """Returns the (N,) integrals of values at the nodes."""
        values = values.reshape(-1, len(self.WEIGHTS))
        # In a fixed order: a matrix product rounds by N.
        return sum(values.T * self.WEIGHTS[:, None]) * self.length / 2


class SmoothPath:
    """A quintic B-spline along the points of a lane path.

    The points are the control points, not points of the curve: in a bend of
    radius r the curve runs spacing^2 / (4 r) to the inside of them, and its
    curvature changes without a step. The parameter u runs from 0 to `end`,
    in metres along the points.
    """

    def __init__(self, points: np.ndarray, spacing: float):
        """Makes the path of (N, 3) points at even distances [m]."""
        self.spacing = spacing
        self._spline = SplineDerivatives(
            make_uniform_spline(points, spacing), 4
        )
        self.end = self._spline.end
        # Headings at the knots, free of jumps, from which to count turns.
        knots = np.arange(len(points)) * spacing
        tangents = self._spline.evaluate(knots)[1]
        self._knot_yaw = np.unwrap(arctan2(tangents[:, 1], tangents[:, 0]))

    def evaluate(self, u: ArrayLike) -> PathJet:
        """Returns the path and its derivatives at (N,) parameters u."""
        u = np.atleast_1d(np.asarray(u, dtype=float))
        p, d1, d2, d3, d4 = self._spline.evaluate(u)
        (x1, y1, z1), (x2, y2, z2) = d1.T, d2.T
        (x3, y3, z3), (x4, y4, _) = d3.T, d4.T

        # The tangent's horizontal length, squared, and its heading: from
        # yaw' * h = x' y'' - y' x'' by differentiating both sides.
        h = x1**2 + y1**2
        dh = 2 * (x1 * x2 + y1 * y2)
        ddh = 2 * (x2**2 + x1 * x3 + y2**2 + y1 * y3)
        cross = x1 * y2 - y1 * x2
        dcross = x1 * y3 - y1 * x3
        ddcross = x2 * y3 - y2 * x3 + x1 * y4 - y1 * x4
        dyaw = cross / h
        ddyaw = (dcross - dyaw * dh) / h
        dddyaw = (ddcross - 2 * ddyaw * dh - dyaw * ddh) / h

        # Arc length: speed^2 = p' . p'.
        s = np.sqrt(h + z1**2)
        ds = np.sum(d1 * d2, axis=1) / s
        dds = (np.sum(d2 * d2 + d1 * d3, axis=1) - ds**2) / s

        # Climb: tan(climb) = z' / r, r the tangent's horizontal length.
        r = np.sqrt(h)
        dr = dh / (2 * r)
        ddr = (ddh / 2 - dr**2) / r
        climb = arctan2(z1, r)
        dclimb = (z2 * r - z1 * dr) / s**2
        ddclimb = (z3 * r - z1 * ddr) / s**2 - 2 * dclimb * ds / s

        # Yaw is about the world's z; the vehicle's z is tilted by the climb.
        c, sine = r / s, z1 / s
        dc = -sine * dclimb
        ddc = -c * dclimb**2 - sine * ddclimb
        return PathJet(
            p=p,
            dp=d1,
            ddp=d2,
            yaw=self._count_turns(u, arctan2(y1, x1)),
            dyaw=dyaw,
            ddyaw=ddyaw,
            climb=climb,
            dclimb=dclimb,
            ddclimb=ddclimb,
            speed=s,
            dspeed=ds,
            ddspeed=dds,
            turn=dyaw * c,
            dturn=ddyaw * c + dyaw * dc,
            ddturn=dddyaw * c + 2 * ddyaw * dc + dyaw * ddc,
        )

    def tightest_bend(self) -> tuple[float, np.ndarray]:
        """Returns the least radius [m] and the (3,) place that has it."""
        steps = int(np.ceil(self.end / _BEND_STEP))
        jet = self.evaluate(np.linspace(0.0, self.end, steps + 1))
        curvature = np.abs(jet.turn) / jet.speed
        at = int(curvature.argmax())
        return float(1 / max(curvature[at], 1e-12)), jet.p[at]

    def evaluate_with_section(
        self, u: ArrayLike
    ) -> tuple[PathJet, PathSection]:
        """Returns the path at (N,) parameters u, and the sections before them.

        One evaluation costs little more than that of one parameter.
        """
        wanted = np.atleast_1d(np.asarray(u, dtype=float))
        wanted = np.clip(wanted, 0.0, self.end)
        last = round(self.end / self.spacing) - 1
        knot = (wanted / self.spacing).astype(int).clip(0, last)
        length = wanted - knot * self.spacing
        jet = self.evaluate(np.concatenate([wanted, self._nodes(knot, length)]))
        num = len(wanted)
        section = PathSection(knot, length, jet.rows(slice(num, None)))
        return jet.rows(slice(num)), section

    def intervals(self) -> PathSection:
        """Returns the whole path, from each knot to the next."""
        knot = np.arange(round(self.end / self.spacing))
        length = np.full(len(knot), self.spacing)
        jet = self.evaluate(self._nodes(knot, length))
        return PathSection(knot, length, jet)

    def _nodes(self, knot: np.ndarray, length: np.ndarray) -> np.ndarray:
        start = knot * self.spacing
        along = (PathSection.NODES + 1) / 2
        return (start[:, None] + length[:, None] * along).ravel()

    def _count_turns(self, u: np.ndarray, yaw: np.ndarray) -> np.ndarray:
        """Returns yaw plus the full turns made so far."""
        index = np.rint(np.clip(u, 0.0, self.end) / self.spacing).astype(int)
        nearby = self._knot_yaw[index.clip(0, len(self._knot_yaw) - 1)]
        return yaw + 2 * np.pi * np.rint((nearby - yaw) / (2 * np.pi))


class PathIntegral:
    """The integral from 0 to u of a function along a path."""

    def __init__(
        self, path: SmoothPath, integrand: Callable[[PathJet], np.ndarray]
    ):
        """Tabulates the integral at the knots."""
        self._integrand = integrand
        whole = path.intervals()
        steps = whole.integrate(integrand(whole.jet))
        self._table = np.concatenate([[0.0], np.cumsum(steps)])
        # The integral over the whole path.
        self.total = float(self._table[-1])

    def evaluate(self, section: PathSection) -> np.ndarray:
        """Returns the (N,) integrals up to the ends of N sections."""
        return self._table[section.knot] + section.integrate(
            self._integrand(section.jet)
        )
