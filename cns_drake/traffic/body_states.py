"""The poses of the limbs of all bodies at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.traffic.body_shapes import Limb
from cns_drake.traffic.traffic_plan import TrafficPlan

# Speed of the full swing of limbs [m/s].
_FULL_SWING = 1.2
# Place of bodies that are absent now [m].
_AWAY = (0.0, 0.0, -10_000.0)


class BodyStates(NamedTuple):
    """N bodies at a time: vehicles, then walkers.

    At T times, each array has one more dimension, the first.

    Attributes:
        p_WB: (N, 3) of the middle of each box on the ground [m].
        v_WB: (N, 3) velocity [m/s].
        yaw, pitch: (N,) [rad].
        yaw_rate: (N,) [rad/s].
        present: (N,) whether it is there.
        swing: (N,) from -1 to 1, position of a walker in its gait.
    """

    p_WB: np.ndarray
    v_WB: np.ndarray
    yaw: np.ndarray
    pitch: np.ndarray
    yaw_rate: np.ndarray
    present: np.ndarray
    swing: np.ndarray

    @property
    def up_W(self) -> np.ndarray:
        """The (N, 3) upward axes."""
        (cy, sy), (cp, sp) = (
            (np.cos(a), np.sin(a)) for a in (self.yaw, self.pitch)
        )
        return np.stack([cy * sp, sy * sp, cp], axis=-1)

    @property
    def quat_xyzw(self) -> np.ndarray:
        """The (N, 4) orientations as unit quaternions."""
        return _quaternions(self.yaw, self.pitch)

    @property
    def speed(self) -> np.ndarray:
        """The (N,) speeds [m/s]."""
        return np.linalg.norm(self.v_WB, axis=-1)


def bodies_at(plan: TrafficPlan, t: float | np.ndarray) -> BodyStates:
    """Returns the bodies at a time, or at (T,) times [s]."""
    vehicles, vehicle_rates = plan.vehicles.at(t)
    walkers, walker_rates = plan.walkers.at(t)
    both = np.concatenate([vehicles[..., :4], walkers[..., :4]], axis=-2)
    rates = np.concatenate(
        [vehicle_rates[..., :4], walker_rates[..., :4]], axis=-2
    )
    none = np.zeros_like(walkers[..., 0])
    speed = np.hypot(walker_rates[..., 0], walker_rates[..., 1])
    swing = np.sin(walkers[..., 4]) * np.minimum(speed / _FULL_SWING, 1.0)
    present = [plan.vehicles.is_present(t), plan.walkers.is_present(t)]
    return BodyStates(
        p_WB=both[..., :3],
        v_WB=rates[..., :3],
        yaw=both[..., 3],
        pitch=np.concatenate([vehicles[..., 4], none], axis=-1),
        yaw_rate=rates[..., 3],
        present=np.concatenate(present, axis=-1),
        swing=np.concatenate([np.zeros_like(vehicles[..., 0]), swing], axis=-1),
    )


class LimbTable:
    """The limbs of N bodies, one after the other."""

    def __init__(self, bodies: Sequence[tuple[Limb, ...]]):
        """Takes the limbs of each body."""
        self.body = np.repeat(np.arange(len(bodies)), [len(b) for b in bodies])
        limbs = [limb for limbs in bodies for limb in limbs]
        self._joint = np.array([limb.joint for limb in limbs]).reshape(-1, 3)
        self._swing = np.array([limb.swing for limb in limbs])

    def poses(self, states: BodyStates) -> np.ndarray:
        """Returns X_WL (M, 4, 4) of all limbs at a time."""
        angles = (states.yaw, states.pitch, self._angles(states)[1])
        X_WLs = np.empty((len(self.body), 4, 4))
        _pose_limbs(
            X_WLs, self.body, self._joint, states.p_WB, states.present,
            *(f(a) for a in angles for f in (np.cos, np.sin)),
        )  # fmt: skip
        return X_WLs

    def quat_xyzw(self, states: BodyStates) -> np.ndarray:
        """Returns the (M, 4) orientations of all limbs."""
        return _quaternions(*self._angles(states))

    def _angles(self, states: BodyStates) -> tuple[np.ndarray, np.ndarray]:
        """Returns yaw and pitch of all limbs [rad]."""
        swing = self._swing * states.swing[..., self.body]
        # A forward swing turns about -y.
        return (
            states.yaw[..., self.body],
            states.pitch[..., self.body] - swing,
        )


@compiled
def _pose_limbs(
    X_WLs: np.ndarray,
    body: np.ndarray,
    joint: np.ndarray,
    p_WB: np.ndarray,
    present: np.ndarray,
    cos_yaw: np.ndarray,
    sin_yaw: np.ndarray,
    cos_pitch: np.ndarray,
    sin_pitch: np.ndarray,
    cos_limb: np.ndarray,
    sin_limb: np.ndarray,
) -> None:
    """Fills in the poses of M limbs, which turn about y, then about z.

    Args:
        X_WLs: (M, 4, 4) to fill.
        body: (M,) of each limb.
        joint: (M, 3) its origin in the frame of the body.
        p_WB: (N, 3) of the bodies.
        present: (N,) whether each is there; others are put away.
        cos_yaw, sin_yaw, cos_pitch, sin_pitch: (N,) of the bodies.
        cos_limb, sin_limb: (M,) of the pitches of limbs.
    """
    for m in range(len(body)):
        X, n, p = X_WLs[m], body[m], joint[m]
        cy, sy = cos_yaw[n], sin_yaw[n]
        cp, sp = cos_limb[m], sin_limb[m]
        X[0, 0], X[0, 1], X[0, 2] = cy * cp, -sy, cy * sp
        X[1, 0], X[1, 1], X[1, 2] = sy * cp, cy, sy * sp
        X[2, 0], X[2, 1], X[2, 2] = -sp, 0.0, cp
        X[3, 0], X[3, 1], X[3, 2], X[3, 3] = 0.0, 0.0, 0.0, 1.0
        cp, sp = cos_pitch[n], sin_pitch[n]
        for i in range(3):
            X[i, 3] = p_WB[n, i] if present[n] else _AWAY[i]
        X[0, 3] += cy * cp * p[0] - sy * p[1] + cy * sp * p[2]
        X[1, 3] += sy * cp * p[0] + cy * p[1] + sy * sp * p[2]
        X[2, 3] += cp * p[2] - sp * p[0]


def _quaternions(yaw: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """Returns rotations about y, then about z [rad], as (..., 4) quaternions.

    Args:
        yaw: (...) angle about z.
        pitch: (...) angle about y.

    Returns:
        Unit quaternions, x y z w.
    """
    (cy, sy), (cp, sp) = ((np.cos(a / 2), np.sin(a / 2)) for a in (yaw, pitch))
    return np.stack([-sy * sp, cy * sp, sy * cp, cy * cp], axis=-1)
