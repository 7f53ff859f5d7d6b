"""A town of boxes and drives through it, as points in memory."""

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.base import from_xyz
from evaluation.drives import Drive

LIDAR_HEIGHT = 1.6
_RANGE = 45.0
_PERIOD_NS = 50_000_000
_POINTS_A_SCAN = 1500


def make_town(seed=3, gone=()):
    """Returns points (N, 3) of a street with boxes on either side.

    Args:
        seed: of the whole town.
        gone: numbers of missing boxes.
    """
    rng = np.random.default_rng([seed, 1])
    ground = rng.uniform([-70, -60], [190, 60], (45_000, 2))
    parts = [np.c_[ground, np.zeros(len(ground))]]
    for number in range(26):
        along = -60.0 + 20.0 * (number // 2) + rng.uniform(-5, 5)
        side = 1.0 if number % 2 else -1.0
        size = rng.uniform([6, 5, 3], [15, 14, 22])
        across = side * (rng.uniform(9, 16) + size[1] / 2)
        box = _box(rng, size, int(8 * size[2] * (size[0] + size[1])))
        turn = _turn(rng.uniform(-0.4, 0.4))
        if number not in gone:
            parts.append(box @ turn.T + [along, across, 0.0])
    return np.concatenate(parts)


def route(number=50, lane=0.0, length=120.0, reverse=False):
    """Returns poses (N, 4, 4) of the LiDAR along the winding street."""
    x = np.linspace(0.0, length, number)
    y = lane + 3.0 * np.sin(x / 25.0)
    yaw = np.arctan(3.0 / 25.0 * np.cos(x / 25.0))
    X = np.tile(np.eye(4), (number, 1, 1))
    X[:, :3, :3] = _turn(yaw)
    X[:, :3, 3] = np.stack([x, y, np.full(number, LIDAR_HEIGHT)], axis=1)
    if reverse:
        X = X[::-1] @ np.diag([-1.0, -1.0, 1.0, 1.0])
    return X


def rigid(move, yaw_deg):
    """Returns a pose (4, 4) turned about the vertical."""
    X = np.eye(4)
    X[:3, :3] = _turn(np.radians(yaw_deg))
    X[:3, 3] = move
    return X


def drifted(X, scale, turn_deg):
    """Returns poses of odometry with errors.

    Args:
        X: (N, 4, 4) true poses.
        scale: factor on the distances.
        turn_deg: error of the heading over 100 m.
    """
    steps = np.linalg.inv(X[:-1]) @ X[1:]
    length = np.linalg.norm(steps[:, :3, 3], axis=1)
    steps[:, :3, 3] *= scale
    steps[:, :3, :3] = steps[:, :3, :3] @ _turn(
        np.radians(turn_deg / 100.0 * length)
    )
    result = [X[0]]
    for step in steps:
        result.append(result[-1] @ step)
    return np.array(result)


def make_scans(town, X_WS):
    """Returns the points of a town in range of a LiDAR at some poses."""
    scans = []
    for index, X in enumerate(X_WS):
        near = np.hypot(*(town - X[:3, 3])[:, :2].T) < _RANGE
        p = (town[near] - X[:3, 3]) @ X[:3, :3]
        rng = np.random.default_rng([index, 9])
        chosen = rng.permutation(len(p))[:_POINTS_A_SCAN]
        noise = rng.normal(scale=0.01, size=(len(chosen), 3))
        scans.append(from_xyz((p[chosen] + noise).astype(np.float32)))
    return scans


class TownDrive(Drive):
    """A drive with its scans in memory."""

    def __init__(self, name, scans, X_WS, frame="map", datum=None):
        self.name = name
        self.world_frame = frame
        self._scans = scans
        self._X_WS = X_WS
        self._datum = datum

    def __len__(self):
        return len(self._scans)

    @property
    def stamps_ns(self):
        return _PERIOD_NS * np.arange(len(self))

    @property
    def X_WS(self):
        return self._X_WS

    @property
    def datum(self):
        return self._datum

    def scan(self, index):
        return self._scans[index]


def _turn(yaw):
    """Returns rotations (..., 3, 3) about the vertical."""
    rotvec = np.multiply.outer(yaw, [0.0, 0.0, 1.0])
    return Rotation.from_rotvec(rotvec).as_matrix()


def _box(rng, size, number):
    """Returns points on the walls and the roof of a box on the ground."""
    p = rng.uniform(-0.5, 0.5, (number, 3))
    p[:, 2] += 0.5
    face = rng.integers(0, 5, number)
    p[face == 0, 0], p[face == 1, 0] = -0.5, 0.5
    p[face == 2, 1], p[face == 3, 1] = -0.5, 0.5
    p[face == 4, 2] = 1.0
    return p * size
