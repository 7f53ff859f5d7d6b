"""Registration of one cloud to another, from a rough guess.

Point-to-plane ICP (Chen and Medioni 1991): each point is paired with the
nearest one of the other cloud and drawn to its plane. The distance limit
shrinks from stage to stage: far guesses are drawn in, and later pairs are not
disturbed by changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from cns_drake.base import poses
from cns_drake.base.compiled import compiled
from evaluation.geometry.neighbours import nearest_neighbours

# Neighbours, the point among them, that a normal is fitted to.
NUM_NEIGHBOURS = 10
# A normal this close to the horizontal is that of an upright surface.
_UPRIGHT = 0.5
# Farthest pairs of each stage [m], and the points that it uses: more add
# time, not accuracy.
_STAGES = ((10.0, 1500), (5.0, 1500), (2.0, 4000), (1.0, 4000))
_LIMIT, _NUM_SAMPLES = _STAGES[-1]
_MAX_ITERATIONS = 15
# A stage is over when a step moves or turns less than this [m, rad].
_STILL = (0.005, 2e-4)
# Distances beyond this part of the limit lose their weight.
_SCALE = 0.25
# The normals of a pair on one surface have at least this cosine.
_PARALLEL = 0.7
_FEWEST_PAIRS = 20
# Powers of up to 2^6 part spreads that differ by a tenth.
_SQUARINGS = 6
_SEED = 7
# Error of a point off its plane [m]; number of neighbouring points with a
# common error, of which only one counts.
_SIGMA = 0.1
_CORRELATED = 50.0


@dataclass(frozen=True)
class Surface:
    """Points on surfaces.

    Attributes:
        points: (N, 3) [m].
        normals: (N, 3) of unit length, with either sign.
        tree: of the points.
    """

    points: np.ndarray
    normals: np.ndarray
    tree: cKDTree

    def sample(self, number: int = _NUM_SAMPLES) -> Surface:
        """Returns a number of the points, with the tree of all."""
        if len(self.points) <= number:
            return self
        rng = np.random.default_rng(_SEED)
        chosen = rng.choice(len(self.points), number, replace=False)
        return Surface(self.points[chosen], self.normals[chosen], self.tree)

    @property
    def is_upright(self) -> np.ndarray:
        """(N,) bool, which points are on walls rather than the ground."""
        return np.abs(self.normals[:, 2]) < _UPRIGHT


@dataclass(frozen=True)
class Registration:
    """The pose of a cloud S on a cloud T, and its fit.

    Attributes:
        X_TS: (4, 4).
        fitness: part of the points that have a counterpart, of S or of T,
            the greater of both: one cloud may show many things that were built
            or torn down in between.
        structure: the same of upright points only, since flat ground fits
            nearly everywhere.
        covariance: (6, 6) of a small motion of S in T: turn [rad], move [m].
    """

    X_TS: np.ndarray
    fitness: float
    structure: float
    covariance: np.ndarray


def make_surface(points: np.ndarray) -> Surface:
    """Returns a cloud with normals, fitted to the nearest neighbours.

    Points whose neighbours are all on one line are left out.

    Args:
        points: (N, 3) [m], N >= NUM_NEIGHBOURS.
    """
    normals = _normals(points, nearest_neighbours(points, NUM_NEIGHBOURS))
    has_normal = normals.any(axis=1)
    points = points[has_normal]
    return Surface(points, normals[has_normal], cKDTree(points))


def register(
    source: Surface, target: Surface, guess: np.ndarray
) -> Registration:
    """Moves a cloud onto another.

    Args:
        source: S.
        target: T.
        guess: (4, 4) X_TS, right within some metres and degrees.
    """
    X = np.array(guess, dtype=np.float64)
    for limit, number in _STAGES:
        sample = source.sample(number)
        for _ in range(_MAX_ITERATIONS):
            step = _step(sample, target, X, limit)
            X = step @ X
            move = np.linalg.norm(
                step[:3, :3] @ X[:3, 3] + step[:3, 3] - X[:3, 3]
            )
            turn = Rotation.from_matrix(step[:3, :3]).magnitude()
            if move < _STILL[0] and turn < _STILL[1]:
                break
    return _judge(source, target, X)


def _step(
    sample: Surface, target: Surface, X_TS: np.ndarray, limit: float
) -> np.ndarray:
    """Returns the motion (4, 4) in T that draws the pairs together."""
    is_paired, p_T, nearest = _pair(sample, target, X_TS, limit)
    if np.count_nonzero(is_paired) < _FEWEST_PAIRS:
        return np.eye(4)
    r, J = _linearise(p_T[is_paired], target, nearest[is_paired])
    weights = (1.0 + (r / (_SCALE * limit)) ** 2) ** -2
    H = J.T @ (weights[:, None] * J)
    # Directions without a constraint stay as they are.
    damping = 1e-6 * np.trace(H) * np.eye(6)
    xi = -np.linalg.solve(H + damping, J.T @ (weights * r))
    return poses.make_pose(Rotation.from_rotvec(xi[:3]).as_matrix(), xi[3:])


def _pair(
    sample: Surface, target: Surface, X_TS: np.ndarray, limit: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs points with the nearest ones of the target.

    Returns:
        (N,) bool, which points have a partner; (N, 3) their places in T; (N,)
        index of the partner.
    """
    p_T = poses.transform(X_TS, sample.points)
    distances, nearest = target.tree.query(p_T, distance_upper_bound=limit)
    is_paired = np.isfinite(distances)
    # Without a partner the tree answers with an index that there is not.
    nearest = np.where(is_paired, nearest, 0)
    cosines = np.einsum(
        "ni,ni->n", sample.normals @ X_TS[:3, :3].T, target.normals[nearest]
    )
    return is_paired & (np.abs(cosines) > _PARALLEL), p_T, nearest


def _linearise(
    p_T: np.ndarray, target: Surface, partner: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns distances to planes (M,), and their Jacobian (M, 6)."""
    n_T = target.normals[partner]
    distances = np.einsum("ni,ni->n", p_T - target.points[partner], n_T)
    return distances, np.concatenate([np.cross(p_T, n_T), n_T], axis=1)


def _judge(source: Surface, target: Surface, X_TS: np.ndarray) -> Registration:
    sample = source.sample()
    is_paired, p_T, nearest = _pair(sample, target, X_TS, _LIMIT)
    _, J = _linearise(p_T[is_paired], target, nearest[is_paired])
    counting = len(source.points) / len(sample.points) / _CORRELATED
    H = J.T @ J * (counting / _SIGMA**2)
    reverse = target.sample()
    is_found, _, _ = _pair(reverse, source, poses.inverse(X_TS), _LIMIT)
    return Registration(
        X_TS=X_TS,
        fitness=float(max(is_paired.mean(), is_found.mean())),
        structure=max(
            _part(is_paired, sample.is_upright),
            _part(is_found, reverse.is_upright),
        ),
        # Without constraints, a metre and a few degrees remain uncertain.
        covariance=np.linalg.inv(H + np.eye(6)),
    )


def _part(is_counted: np.ndarray, of: np.ndarray) -> float:
    total = np.count_nonzero(of)
    return np.count_nonzero(is_counted & of) / total if total else 0.0


@compiled
def _normals(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Returns the directions (N, 3) in which neighbours (N, K) spread least.

    They are of unit length, or zero where the neighbours are on one line.

    That is the eigenvector of the least eigenvalue of their covariance C. It
    has the greatest eigenvalue in the adjugate of C, so that the powers of
    the adjugate tend to its projector; they are taken by squaring.
    """
    normals = np.empty((len(points), 3))
    number = neighbours.shape[1]
    for point in range(len(points)):
        # Relative to the point itself, so that squares of large coordinates
        # are not subtracted from each other.
        x, y, z = 0.0, 0.0, 0.0
        xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for other in neighbours[point]:
            dx = points[other, 0] - points[point, 0]
            dy = points[other, 1] - points[point, 1]
            dz = points[other, 2] - points[point, 2]
            x, y, z = x + dx, y + dy, z + dz
            xx, yy, zz = xx + dx * dx, yy + dy * dy, zz + dz * dz
            xy, xz, yz = xy + dx * dy, xz + dx * dz, yz + dy * dz
        xx, yy, zz = (
            xx - x * x / number,
            yy - y * y / number,
            zz - z * z / number,
        )
        xy, xz, yz = (
            xy - x * y / number,
            xz - x * z / number,
            yz - y * z / number,
        )
        # The adjugate, symmetric as well: a d e / d b f / e f c.
        a, b, c = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
        d, e, f = xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz
        if a + b + c <= 0.0:
            normals[point] = 0.0
            continue
        for _ in range(_SQUARINGS):
            trace = a + b + c
            a, b, c = a / trace, b / trace, c / trace
            d, e, f = d / trace, e / trace, f / trace
            a, b, c, d, e, f = (
                a * a + d * d + e * e,
                d * d + b * b + f * f,
                e * e + f * f + c * c,
                a * d + d * b + e * f,
                a * e + d * f + e * c,
                d * e + b * f + f * c,
            )
        if a >= b and a >= c:
            nx, ny, nz = a, d, e
        elif b >= c:
            nx, ny, nz = d, b, f
        else:
            nx, ny, nz = e, f, c
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        normals[point, 0] = nx / length
        normals[point, 1] = ny / length
        normals[point, 2] = nz / length
    return normals
