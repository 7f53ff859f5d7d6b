"""Registration of one cloud to another, from a rough guess.

The method is point-to-plane ICP (Chen and Medioni 1991), by small_gicp. Each
point is paired with the nearest point of the other cloud, and the distances
between the points and the planes of their partners are minimised. The maximum
correspondence distance shrinks from stage to stage: a large distance lets a
poor initial guess converge, and a small distance excludes wrong pairs where the
place has changed.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import small_gicp

from evaluation.base import poses

# Number of points to which a normal is fitted, including the point itself.
NUM_NEIGHBOURS = 10
# A surface is upright if the z component of its normal is below this.
_UPRIGHT = 0.5
# Greatest distance of a pair in each stage [m], and the number of points used:
# more points add time, not accuracy.
_STAGES = ((10.0, 1500), (5.0, 1500), (2.0, 4000), (1.0, 4000), (0.5, 4000))
# Greatest distance of the pairs by which a fit is judged [m].
_JUDGED_DISTANCE = 1.0
# Number of the points by which a fit is judged.
_NUM_SAMPLES = 4000
# Greatest number of steps of a stage.
_MAX_ITERATIONS = 15
# A stage ends when a step moves less than this [m] ...
_LEAST_MOVE = 0.005
# ... and turns less than this [rad].
_LEAST_TURN = 2e-4
# Least cosine between the normals of a pair.
_PARALLEL = 0.7
# A stage with fewer pairs leaves the pose as it was.
_FEWEST_PAIRS = 20
# Seed of the choice of points.
_SEED = 7
# Standard deviation of a point's distance from its plane [m].
_SIGMA = 0.1
# Number of neighbouring points that have a common error and count as one.
_CORRELATED = 50.0


@dataclass(frozen=True)
class Surface:
    """A cloud of points on surfaces, prepared for registration.

    Attributes:
        points: (N, 3) points [m].
        normals: (N, 3) unit normals, of either sign.
        cloud: the points as a cloud of small_gicp.
        tree: search tree of this cloud.
    """

    points: np.ndarray
    normals: np.ndarray
    cloud: small_gicp.PointCloud
    tree: small_gicp.KdTree

    def sample(self, number: int = _NUM_SAMPLES) -> np.ndarray:
        """Returns the increasing indices (M,) of a sample of the points."""
        count = len(self.points)
        if count <= number:
            return np.arange(count)
        rng = np.random.default_rng(_SEED)
        return np.sort(rng.choice(count, number, replace=False))

    @cached_property
    def covariances(self) -> np.ndarray:
        """(N, 3, 3) covariance around each point, made planar for GICP."""
        return covariances(self.cloud)

    @cached_property
    def is_upright(self) -> np.ndarray:
        """(N,) bool, which points are on walls rather than the ground."""
        return np.abs(self.normals[:, 2]) < _UPRIGHT


@dataclass(frozen=True)
class Registration:
    """The pose of a cloud S relative to a cloud T, and how well the clouds fit.

    Attributes:
        X_TS: (4, 4) pose of S in T.
        fitness: share of a cloud's points that have a counterpart in the other
            cloud. Of the shares of the two clouds, the greater one counts,
            because one cloud may show much that was built or torn down between
            the two drives.
        structure: the same share, but only of the points on upright surfaces,
            because flat ground fits nearly everywhere.
        covariance: (6, 6) covariance of a small motion of S in T: rotation
            [rad], translation [m].
    """

    X_TS: np.ndarray
    fitness: float
    structure: float
    covariance: np.ndarray


def covariances(cloud: small_gicp.PointCloud) -> np.ndarray:
    """Returns small_gicp's estimated covariances of points, (N, 3, 3)."""
    return np.reshape(cloud.covs(), (-1, 4, 4))[:, :3, :3]


def make_surface(
    points: np.ndarray, num_neighbours: int = NUM_NEIGHBOURS
) -> Surface:
    """Returns a cloud with normals and covariances of its points.

    Normals and covariances come from the nearest neighbours of each point.

    Args:
        points: (N, 3) points [m], N >= num_neighbours.
        num_neighbours: number of points to which each normal is fitted,
            including the point itself.
    """
    cloud = small_gicp.PointCloud(points)
    tree = small_gicp.KdTree(cloud)
    small_gicp.estimate_normals_covariances(cloud, tree, num_neighbours)
    # A view of the cloud's normals, whose rows have four numbers.
    return Surface(points, cloud.normals()[:, :3], cloud, tree)


def register(
    source: Surface, target: Surface, guess: np.ndarray
) -> Registration:
    """Registers one cloud to another; returns pose and quality of the fit.

    Args:
        source: the cloud S.
        target: the cloud T.
        guess: (4, 4) guess of X_TS, off by at most some metres and degrees.
    """
    X = np.array(guess, dtype=np.float64)
    for limit, number in _STAGES:
        sample = small_gicp.PointCloud(source.points[source.sample(number)])
        found = small_gicp.align(
            target.cloud,
            sample,
            target.tree,
            X,
            "PLANE_ICP",
            max_correspondence_distance=limit,
            max_iterations=_MAX_ITERATIONS,
            translation_epsilon=_LEAST_MOVE,
            rotation_epsilon=_LEAST_TURN,
        )
        if found.num_inliers >= _FEWEST_PAIRS:
            X = found.T_target_source
    return registration_at(source, target, X)


class _Pairs(NamedTuple):
    """A sample of M points of a cloud S, paired with the points of a cloud T.

    Attributes:
        sample: (M,) indices of the sampled points.
        is_paired: (M,) bool, which of these points have a partner.
        p_T: (M, 3) positions of the sampled points in T [m].
        nearest: (M,) index of the point of T that is nearest to each.
    """

    sample: np.ndarray
    is_paired: np.ndarray
    p_T: np.ndarray
    nearest: np.ndarray


def _nearest_pairs(
    source: Surface, target: Surface, X_TS: np.ndarray
) -> _Pairs:
    """Pairs a sample of the points with the nearest points of the target.

    Args:
        X_TS: (4, 4) pose of S in T.
    """
    sample = source.sample()
    p_T = poses.transform(X_TS, source.points[sample])
    found, squares = target.tree.batch_nearest_neighbor_search(p_T)
    nearest = np.asarray(found, dtype=np.int64)
    cosines = np.einsum(
        "ni,ni->n",
        source.normals[sample] @ X_TS[:3, :3].T,
        target.normals[nearest],
    )
    is_paired = (np.asarray(squares) < _JUDGED_DISTANCE**2) & (
        np.abs(cosines) > _PARALLEL
    )
    return _Pairs(sample, is_paired, p_T, nearest)


def registration_at(
    source: Surface, target: Surface, X_TS: np.ndarray
) -> Registration:
    """Returns the quality of the fit of two clouds at a pose, as it is.

    Args:
        source: the cloud S.
        target: the cloud T.
        X_TS: (4, 4) pose of S in T.
    """
    forth = _nearest_pairs(source, target, X_TS)
    back = _nearest_pairs(target, source, poses.inverse(X_TS))
    return Registration(
        X_TS=X_TS,
        fitness=float(max(forth.is_paired.mean(), back.is_paired.mean())),
        structure=max(
            _share_of(forth.is_paired, source.is_upright[forth.sample]),
            _share_of(back.is_paired, target.is_upright[back.sample]),
        ),
        covariance=_covariance(source, target, forth),
    )


def _covariance(source: Surface, target: Surface, pairs: _Pairs) -> np.ndarray:
    """Returns the covariance (6, 6) of a registration; see `Registration`.

    Args:
        pairs: points of S, paired with those of T.
    """
    n_T = target.normals[pairs.nearest[pairs.is_paired]]
    counting = len(source.points) / len(pairs.sample) / _CORRELATED
    H = point_to_plane_hessian(pairs.p_T[pairs.is_paired], n_T)
    H *= counting / _SIGMA**2
    # Directions without constraints get uncertainties of a metre and a radian.
    return np.linalg.inv(H + np.eye(6))


def point_to_plane_hessian(arms: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Returns the point-to-plane Hessian (6, 6) over turn, then move.

    Args:
        arms: (N, 3) vectors from the centre of the turn to the points [m].
        normals: (N, 3) unit normals of the planes at the points.
    """
    J = np.concatenate([np.cross(arms, normals), normals], axis=1)
    return J.T @ J


def _share_of(is_counted: np.ndarray, of: np.ndarray) -> float:
    """Returns the share of the points in a mask that count; 0 without any.

    Args:
        is_counted: (N,) bool, which points count.
        of: (N,) bool, the mask.
    """
    total = np.count_nonzero(of)
    return np.count_nonzero(is_counted & of) / total if total else 0.0
