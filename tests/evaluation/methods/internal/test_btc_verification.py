import math

import numpy as np
import pytest

from evaluation.base import poses
from evaluation.methods.btc import align, find_motion, plane_overlap
from evaluation.methods.btc_planes import Planes


def turn(angle, offset=(0.0, 0.0, 0.0)):
    X = np.eye(4)
    X[:2, :2] = [
        [math.cos(angle), -math.sin(angle)],
        [math.sin(angle), math.cos(angle)],
    ]
    X[:3, 3] = offset
    return X


def moved(X, triangles):
    return triangles @ X[:3, :3].T + X[:3, 3]


class TestFindMotion:
    def pairs(self, seed, right, wrong):
        """Returns pairs of triangles, some of which share a motion."""
        rng = np.random.default_rng([seed, 63])
        X = turn(2.0, [4.0, -7.0, 0.3])
        query = rng.uniform(-40.0, 40.0, (right + wrong, 3, 3))
        query[..., 2] = -1.6
        place = rng.uniform(-40.0, 40.0, query.shape)
        place[:right] = moved(X, query[:right])
        place[:right] += rng.normal(0.0, 0.1, (right, 3, 3))
        order = rng.permutation(right + wrong)
        return X, query[order], place[order]

    @pytest.mark.parametrize(("right", "found"), [(3, False), (4, True)])
    def test_needs_agreement(self, right, found):
        X, query, place = self.pairs(right, right, 12)
        X_PQ = find_motion(query, place)
        if not found:
            assert X_PQ is None
        else:
            np.testing.assert_allclose(X_PQ[:3, :3], X[:3, :3], atol=0.05)
            np.testing.assert_allclose(X_PQ[:3, 3], X[:3, 3], atol=0.5)

    @pytest.mark.parametrize("number", [49, 50, 99, 101, 260])
    def test_brute_force(self, number):
        _, query, place = self.pairs(number, number // 3, number - number // 3)
        stride = number // 50 + 1
        best = None
        best_votes = 3
        for k in range(number // stride):
            X = align(query[k * stride], place[k * stride])
            votes = sum(
                np.linalg.norm(moved(X, q) - p, axis=1).max() < 3.0
                for q, p in zip(query, place, strict=True)
            )
            if votes > best_votes:
                best = X
                best_votes = votes
        assert best is not None
        np.testing.assert_allclose(find_motion(query, place), best, atol=1e-12)


class TestPlaneOverlap:
    def planes(self, centers, normals):
        number = len(centers)
        return Planes(
            np.asarray(centers, float),
            np.broadcast_to(np.asarray(normals, float), (number, 3)),
            np.zeros((number, 3, 3)),
            np.ones(number, dtype=np.int64),
        )

    def ground(self, normal=(0.0, 0.0, 1.0)):
        centers = [[2 * i, 2 * j, -1.6] for i in range(5) for j in range(4)]
        return self.planes(centers, normal)

    def overlap(self, query, place, X_PQ):
        return plane_overlap(query, place, X_PQ, 0.2, 0.5)

    def test_itself(self):
        assert self.overlap(self.ground(), self.ground(), np.eye(4)) == 1.0

    def test_moved(self):
        X_PQ = poses.make_pose(
            poses.rotation_from_quaternion([0.1, -0.2, 0.9, 0.3]),
            np.array([40.0, -3.0, 6.0]),
        )
        query = self.ground()
        place = self.planes(
            poses.transform(X_PQ, query.centers), X_PQ[:3, :3] @ [0, 0, 1]
        )
        assert self.overlap(query, place, X_PQ) == 1.0
        assert self.overlap(query, place, poses.inverse(X_PQ)) == 0.0

    @pytest.mark.parametrize(
        ("height", "share"), [(0.49, 1.0), (0.51, 0.0), (-0.51, 0.0)]
    )
    def test_limit_of_distance(self, height, share):
        X_PQ = turn(0.0, [0.0, 0.0, height])
        assert self.overlap(self.ground(), self.ground(), X_PQ) == share

    def test_only_distance_from_the_plane_counts(self):
        X_PQ = turn(0.0, [500.0, 0.0, 0.0])
        assert self.overlap(self.ground(), self.ground(), X_PQ) == 1.0

    @pytest.mark.parametrize(
        ("angle", "share"),
        [(0.19, 1.0), (0.21, 0.0), (math.pi - 0.19, 1.0), (math.pi, 1.0)],
    )
    def test_limit_of_normals(self, angle, share):
        # Normals at an angle a differ by 2 sin(a / 2), or by 2 cos(a / 2)
        # where one is turned over.
        tilted = self.ground((math.sin(angle), 0.0, math.cos(angle)))
        assert self.overlap(tilted, self.ground(), np.eye(4)) == share
        assert self.overlap(self.ground(), tilted, np.eye(4)) == share

    def test_the_nearest_patch_decides(self):
        # Over the ground there is a wall; one query patch is nearer to it.
        place = self.planes(
            [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [[0, 0, 1], [1, 0, 0]]
        )
        query = self.planes([[0.1, 0.0, 0.4], [0.1, 0.0, 0.6]], [0, 0, 1])
        assert self.overlap(query, place, np.eye(4)) == 0.5

    def test_share_of_the_query(self):
        query = self.ground()
        place = query.take(np.arange(5))
        wall = self.planes([[100.0, 0.0, 5.0]] * 12, [0.0, 1.0, 0.0])
        both = Planes(
            np.concatenate([query.centers, wall.centers]),
            np.concatenate([query.normals, wall.normals]),
            np.concatenate([query.covariances, wall.covariances]),
            np.concatenate([query.counts, wall.counts]),
        )
        assert self.overlap(both, place, np.eye(4)) == 20 / 32
        assert self.overlap(place, both, np.eye(4)) == 1.0
