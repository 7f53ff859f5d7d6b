"""Localisation of scans in a map, against scenes with known answers."""

import math

from helpers.point_street import sheet, street
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import small_gicp

from evaluation.alignment import make_surface
from evaluation.base import poses
from evaluation.localisation import Settings, map_of
from evaluation.localisation.estimators import _gauss_newton_step
from evaluation.localisation.localiser import fit_at


def a_pose(*p, far=0.0):
    R = Rotation.from_euler("ZYX", [100.0, 8.0, -5.0], degrees=True)
    return poses.make_pose(R.as_matrix(), np.array(p) + far)


ROBUST = ("robust-plane-icp", "robust-gicp")


@pytest.mark.parametrize("method", ROBUST)
def test_a_step_is_that_of_weighted_least_squares(method):
    surface = make_surface(street(density=1.0))
    X = a_pose(1.0, 2.0, 1.7)
    scan = poses.transform(poses.inverse(X), street(9, density=0.1)) + 0.05
    width = 1.5
    spread = None
    if method == "robust-gicp":
        cloud = small_gicp.PointCloud(scan)
        small_gicp.estimate_covariances(cloud, num_neighbors=10)
        spread = np.array(cloud.covs())[:, :3, :3]
    rows, wanted = [], []
    for k, p in enumerate(scan):
        arm = X[:3, :3] @ p
        gaps = np.linalg.norm(surface.points - arm - X[:3, 3], axis=1)
        near = gaps.argmin()
        if gaps[near] >= width:
            continue
        off = arm + X[:3, 3] - surface.points[near]
        root = surface.normals[near][None]
        if spread is not None:
            C = np.array(surface.cloud.covs()[near])[:3, :3]
            C = (C + X[:3, :3] @ spread[k] @ X[:3, :3].T) / 2e-3
            root = np.linalg.cholesky(np.linalg.inv(C)).T
        kernel = width / 9.0
        weight = kernel / (kernel + ((root @ off) ** 2).sum())
        x, y, z = arm
        turn = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        rows.append(weight * root @ np.hstack([turn, np.eye(3)]))
        wanted.append(-weight * root @ off)
    least, *_ = np.linalg.lstsq(
        np.concatenate(rows), np.concatenate(wanted), rcond=None
    )
    # The step is held by a little, where nothing else holds it.
    np.testing.assert_allclose(
        _gauss_newton_step(surface, scan, X, width, spread), least, atol=1e-6
    )


def test_covariance_of_planes_in_closed_form():
    # Three sheets at right angles: each holds one axis. N points, off by s.
    parts = [
        sheet((-1.0, -1.0, -1.0), (2, 0, 0), (0, 2, 0), 1, 400.0),
        sheet((-1.0, -1.0, -1.0), (2, 0, 0), (0, 0, 2), 2, 200.0),
        sheet((-1.0, -1.0, -1.0), (0, 2, 0), (0, 0, 2), 3, 100.0),
    ]
    surface = map_of(np.concatenate(parts), "map", Settings.neighbours).surface
    middles = np.concatenate(
        [part[(np.abs(part) < 0.8).sum(axis=1) == 2] for part in parts]
    )
    fit = fit_at(surface, middles, np.eye(4))
    counts = [np.count_nonzero(middles[:, axis] == -1.0) for axis in range(3)]
    # Nothing is off its plane, so that the least roughness counts: 0.01 m.
    # Noise of normals takes 0.27 % of all points from each axis.
    noise = math.sin(math.radians(3.0)) ** 2 * len(middles)
    held = 0.01**2 / (np.array(counts) - noise)
    covariance = np.linalg.inv(np.linalg.inv(fit.covariance)[3:, 3:])
    assert np.diag(covariance) == pytest.approx(held, rel=0.01)
    assert fit.share == 1.0
