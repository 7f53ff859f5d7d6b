"""How well a scan fits a map at a pose."""

from dataclasses import dataclass
import math

import numpy as np

from cns_drake.base import poses
from evaluation.alignment import Surface

# A point of a scan fits if a surface of the map is this near [m].
_FIT = 0.15
# Pairs farther apart say nothing about the fit [m].
_PAIR = 1.0
# Least standard deviation from a plane [m], even where a scan fits exactly.
_ROUGHNESS = 0.01
# Standard deviation of a plane's distance if no point of the map is near [m].
_UNKNOWN = 1.0
# Least eigenvalue of a Hessian: directions without constraints get a standard
# deviation of 100 m or rad.
_LEAST_EIGENVALUE = 1e-4
# Normals are exact to 3 deg. This is the square of the component along the
# surface that such an error produces; uncorrected, it would seem to constrain a
# scan along the surface.
_NORMAL_NOISE = math.sin(math.radians(3.0)) ** 2


@dataclass(frozen=True)
class Fit:
    """The fit of a scan at a pose.

    Attributes:
        share: share of the scan's points that lie on a surface of the map.
        residual: root mean square distance of the scan's points from the planes
            at the nearest points of the map [m]. Points of the scan more than 1
            m from the map do not count; NaN if no point counts.
        covariance: (6, 6) covariance of a small motion about the LiDAR, in axes
            of W: rotation [rad], translation [m]. The covariance is the inverse
            Hessian of the point-to-plane error, corrected for the noise of the
            normals, times the square of the residual (at least 0.01 m).
    """

    share: float
    residual: float
    covariance: np.ndarray


def fit_at(surface: Surface, scan: np.ndarray, X_WS: np.ndarray) -> Fit:
    """Returns how well a scan fits a map at a given pose, see `Fit`.

    Args:
        surface: surface of the map.
        scan: (N, 3) points in the LiDAR's frame S [m].
        X_WS: (4, 4) the pose.
    """
    p_W = poses.transform(X_WS, scan)
    found, squares = surface.tree.batch_nearest_neighbor_search(p_W)
    is_pair = np.asarray(squares) < _PAIR**2
    nearest = np.asarray(found, dtype=np.int64)[is_pair]
    n_W = surface.normals[nearest]
    off = np.einsum("ni,ni->n", n_W, p_W[is_pair] - surface.points[nearest])
    arms = p_W[is_pair] - X_WS[:3, 3]
    residual, sigma = math.nan, _UNKNOWN
    if len(off):
        residual = math.sqrt(np.mean(off**2))
        sigma = max(residual, _ROUGHNESS)
    return Fit(
        float(np.count_nonzero(np.abs(off) < _FIT) / len(scan)),
        residual,
        _bounded_inverse(_corrected_hessian(arms, n_W) / sigma**2),
    )


def _corrected_hessian(arms: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Returns the point-to-plane Hessian (6, 6) without the noise of normals.

    Args:
        arms: (N, 3) vectors from the LiDAR to the points, in W [m].
        normals: (N, 3) unit normals of the planes at the points, in W.
    """
    H = _point_to_plane_hessian(arms, normals)
    for axis in np.eye(3):
        H -= _NORMAL_NOISE * _point_to_plane_hessian(
            arms, np.broadcast_to(axis, arms.shape)
        )
    return H


def _point_to_plane_hessian(
    arms: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """Returns the point-to-plane Hessian (6, 6) over turn, then move.

    For the arguments, see `_corrected_hessian`.
    """
    J = np.concatenate([np.cross(arms, normals), normals], axis=1)
    return J.T @ J


def _bounded_inverse(H: np.ndarray) -> np.ndarray:
    """Returns the inverse of a Hessian (6, 6), with bounded eigenvalues."""
    values, vectors = np.linalg.eigh(H)
    return vectors / np.maximum(values, _LEAST_EIGENVALUE) @ vectors.T
