"""States of vehicles and pedestrians at a time, and poses of their limbs."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.base.elementary import cos, sin
from cns_drake.traffic.body_shapes import Limb
from cns_drake.traffic.traffic_plan import TrafficPlan

# Faster bodies are labelled as moving, all others as standing [m/s].
MOVING_SPEED = 0.5
# Speed at which limbs swing with their full amplitude [m/s].
_FULL_SWING = 1.2
# Place of bodies that are absent [m].
_AWAY = np.array([0.0, 0.0, -10_000.0])


class BodyStates(NamedTuple):
    """The states of N bodies at one time: first vehicles, then pedestrians.

    Attributes:
        p_WB: (N, 3) centre of the base of each body's box, on the ground [m].
        v_WB: (N, 3) velocity [m/s].
        yaw, pitch: (N,) yaw and pitch [rad].
        yaw_rate: (N,) yaw rate [rad/s].
        present: (N,) bool, whether the body exists at this time.
        swing: (N,) position of a pedestrian in its gait, from -1 to 1.
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
        """The upward axes (N, 3) of the bodies."""
        (cy, sy), (cp, sp) = ((cos(a), sin(a)) for a in (self.yaw, self.pitch))
        return np.stack([cy * sp, sy * sp, cp], axis=-1)

    @property
    def quat_xyzw(self) -> np.ndarray:
        """The orientations (N, 4) of the bodies as quaternions (x, y, z, w)."""
        (cy, sy), (cp, sp) = (
            (cos(a / 2), sin(a / 2)) for a in (self.yaw, self.pitch)
        )
        return np.stack([-sy * sp, cy * sp, sy * cp, cy * cp], axis=-1)

    @property
    def is_moving(self) -> np.ndarray:
        """(N,) bool: which bodies are labelled as moving."""
        return np.linalg.norm(self.v_WB, axis=-1) > MOVING_SPEED


def bodies_at(plan: TrafficPlan, t: float) -> BodyStates:
    """Returns the states of all bodies at a time.

    Args:
        plan: the planned traffic.
        t: time since the start of the drive [s].
    """
    vehicles, vehicle_rates = plan.vehicles.at(t)
    walkers, walker_rates = plan.walkers.at(t)
    both = np.concatenate([vehicles[:, :4], walkers[:, :4]])
    rates = np.concatenate([vehicle_rates[:, :4], walker_rates[:, :4]])
    speed = np.hypot(walker_rates[:, 0], walker_rates[:, 1])
    swing = sin(walkers[:, 4]) * np.minimum(speed / _FULL_SWING, 1.0)
    return BodyStates(
        p_WB=both[:, :3],
        v_WB=rates[:, :3],
        yaw=both[:, 3],
        pitch=np.append(vehicles[:, 4], np.zeros(len(walkers))),
        yaw_rate=rates[:, 3],
        present=np.append(
            plan.vehicles.is_present(t), plan.walkers.is_present(t)
        ),
        swing=np.append(np.zeros(len(vehicles)), swing),
    )


class LimbTable:
    """The M rigid limbs of N bodies, in the order of the bodies.

    Attributes:
        body: (M,) number of the body to which each limb belongs.
    """

    def __init__(self, bodies: Sequence[tuple[Limb, ...]]):
        """Takes the limbs of each body."""
        self.body = np.repeat(np.arange(len(bodies)), [len(b) for b in bodies])
        limbs = [limb for limbs in bodies for limb in limbs]
        self._joint = np.array([limb.joint for limb in limbs]).reshape(-1, 3)
        self._swing = np.array([limb.swing for limb in limbs])

    def poses(self, states: BodyStates) -> np.ndarray:
        """Returns the poses X_WL (M, 4, 4) of all limbs in the world.

        The limbs of a body that has not arrived yet, or has left, are far below
        the ground.
        """
        body, p = self.body, self._joint.T
        # A forward swing is a rotation about -y.
        pitch = states.pitch[body] - self._swing * states.swing[body]
        cy, sy = cos(states.yaw)[body], sin(states.yaw)[body]
        X_WLs = np.zeros((len(body), 4, 4))
        X_WLs[:, 3, 3] = 1.0
        p_WB = np.where(states.present[:, None], states.p_WB, _AWAY)[body]
        cp, sp = cos(states.pitch)[body], sin(states.pitch)[body]
        X_WLs[:, 0, 3] = cy * cp * p[0] - sy * p[1] + cy * sp * p[2]
        X_WLs[:, 1, 3] = sy * cp * p[0] + cy * p[1] + sy * sp * p[2]
        X_WLs[:, 2, 3] = cp * p[2] - sp * p[0]
        X_WLs[:, :3, 3] += p_WB
        cp, sp = cos(pitch), sin(pitch)
        X_WLs[:, 0, 0], X_WLs[:, 0, 1], X_WLs[:, 0, 2] = cy * cp, -sy, cy * sp
        X_WLs[:, 1, 0], X_WLs[:, 1, 1], X_WLs[:, 1, 2] = sy * cp, cy, sy * sp
        X_WLs[:, 2, 0], X_WLs[:, 2, 2] = -sp, cp
        return X_WLs
