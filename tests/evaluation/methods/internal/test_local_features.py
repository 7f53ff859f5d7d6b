import numpy as np
import pytest

from evaluation.methods.ringpp import local_features


def features_of(points):
    """Returns the features of a set of points as neighbours, (6,)."""
    points = np.asarray(points, dtype=np.float64)
    neighbours = np.arange(len(points), dtype=np.int32)[None]
    return local_features(points, neighbours)[0]


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng([seed]).normal(size=(3, 3)))
    return q * np.sign(np.diagonal(r))


def cross(a, b, c):
    """Returns points on three axes; the variances are as a^2, b^2, c^2."""
    return np.vstack([np.diag([a, b, c]), -np.diag([a, b, c])])


@pytest.mark.parametrize("seed", range(5))
def test_known_eigenvalues(seed):
    points = cross(3.0, 2.0, 1.0) @ rotation(seed).T + [40.0, -7.0, 2.0]
    shares = np.array([9.0, 4.0, 1.0]) / 14.0
    features = features_of(points)
    assert features[0] == pytest.approx(shares[2])
    assert features[1] == pytest.approx(shares.prod() ** (1 / 3))
    assert features[2] == pytest.approx(-(shares * np.log(shares)).sum())
    horizontal = np.linalg.eigvalsh(np.cov(points[:, :2].T))
    assert features[3] == pytest.approx(horizontal[0] / horizontal[1])
    assert features[4] == pytest.approx(np.ptp(points[:, 2]))
    assert features[5] == pytest.approx(np.var(points[:, 2]))


def test_against_eigenvalues_of_a_library():
    rng = np.random.default_rng([11])
    points = rng.normal(size=(300, 3)) * [1.0, 0.4, 0.05]
    neighbours = np.stack([rng.permutation(300)[:30] for _ in range(200)])
    features = local_features(points, neighbours.astype(np.int32))
    for row, chosen in zip(features, points[neighbours], strict=True):
        covariance = np.cov(chosen.T)
        values = np.linalg.eigvalsh(covariance)
        shares = values / values.sum()
        horizontal = np.linalg.eigvalsh(covariance[:2, :2])
        np.testing.assert_allclose(
            row,
            [
                shares[0],
                np.cbrt(shares.prod()),
                -(shares * np.log(shares)).sum(),
                horizontal[0] / horizontal[1],
                np.ptp(chosen[:, 2]),
                chosen[:, 2].var(),
            ],
            rtol=1e-7,
        )
    assert (features >= 0.0).all()
