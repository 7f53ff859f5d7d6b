"""Where the limbs of all bodies are at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.traffic.body_shapes import Limb
from cns_drake.traffic.traffic_plan import TrafficPlan

# At this speed limbs swing as far as they do [m/s].
_FULL_SWING = 1.2
# Where those are who are not there now [m].
_AWAY = (0.0, 0.0, -10_000.0)


class BodyStates(NamedTuple):
    """N bodies at a time: vehicles, then walkers.

    Attributes:
        p_WB: (N, 3) of the middle of each box on the ground [m].
        v_WB: (N, 3) velocity [m/s].
        yaw, pitch: (N,) [rad].
        yaw_rate: (N,) [rad/s].
        present: (N,) whether it is there.
        swing: (N,) from -1 to 1, where in its gait a walker is.
    """

    p_WB: np.ndarray
    v_WB: np.ndarray
    yaw: np.ndarray
    pitch: np.ndarray
    yaw_rate: np.ndarray
    present: np.ndarray
    swing: np.ndarray

    @property
    def R_WB(self) -> np.ndarray:
        """The (N, 3, 3) orientations."""
        angles = np.stack([self.yaw, self.pitch], axis=1)
        return Rotation.from_euler("ZY", angles).as_matrix()

    @property
    def speed(self) -> np.ndarray:
        """The (N,) speeds [m/s]."""
        return np.linalg.norm(self.v_WB, axis=1)


def bodies_at(plan: TrafficPlan, t: float) -> BodyStates:
    """Returns where everybody is at a time [s]."""
    vehicles, vehicle_rates = plan.vehicles.at(t)
    walkers, walker_rates = plan.walkers.at(t)
    both = np.concatenate([vehicles[:, :4], walkers[:, :4]])
    rates = np.concatenate([vehicle_rates[:, :4], walker_rates[:, :4]])
    none = np.zeros(len(walkers))
    speed = np.hypot(*walker_rates[:, :2].T)
    swing = np.sin(walkers[:, 4]) * np.minimum(speed / _FULL_SWING, 1.0)
    return BodyStates(
        p_WB=both[:, :3],
        v_WB=rates[:, :3],
        yaw=both[:, 3],
        pitch=np.concatenate([vehicles[:, 4], none]),
        yaw_rate=rates[:, 3],
        present=np.concatenate(
            [plan.vehicles.is_present(t), plan.walkers.is_present(t)]
        ),
        swing=np.concatenate([np.zeros(len(vehicles)), swing]),
    )


class LimbTable:
    """The limbs of N bodies, one after the other."""

    def __init__(self, bodies: Sequence[tuple[Limb, ...]]):
        """Takes the limbs of each body."""
        self.body = np.repeat(np.arange(len(bodies)), [len(b) for b in bodies])
        limbs = [limb for limbs in bodies for limb in limbs]
        self._joint = np.array([limb.joint for limb in limbs]).reshape(-1, 3)
        self._swing = np.array([limb.swing for limb in limbs])

    def poses(self, states: BodyStates) -> tuple[np.ndarray, np.ndarray]:
        """Returns R_WL (M, 3, 3) and p_WL (M, 3) of all limbs [m]."""
        R_WB = states.R_WB[self.body]
        angle = self._swing * states.swing[self.body]
        # Forwards is about -y.
        c, s = np.cos(angle), -np.sin(angle)
        R_BL = np.zeros((len(angle), 3, 3))
        R_BL[:, 0, 0], R_BL[:, 0, 2] = c, s
        R_BL[:, 1, 1] = 1.0
        R_BL[:, 2, 0], R_BL[:, 2, 2] = -s, c
        p_WB = np.where(states.present[:, None], states.p_WB, _AWAY)
        p_WL = p_WB[self.body] + np.einsum("nij,nj->ni", R_WB, self._joint)
        return R_WB @ R_BL, p_WL
