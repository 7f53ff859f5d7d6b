"""An ideal IMU on a vehicle whose motion is prescribed."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cns_drake.motion.trajectory import Trajectory

# Samples computed at a time, and greatest distance of a wanted time from a
# sample's, in samples.
_BLOCK = 512
_TOLERANCE = 1e-6


class VehicleImu(LeafSystem):
    """Measures like an ideal accelerometer and gyroscope on a vehicle.

    Its values equal those of Drake's sensors on a `VehicleMotion`, up to
    rounding, at a fifteenth of the cost: it handles one frame only, and
    computes many samples at a time.

    .. pydrake_system::

        name: VehicleImu
        output_ports:
        - specific_force
        - angular_velocity
        - R_WI

    `specific_force` [m/s^2] and `angular_velocity` w_WI [rad/s] are vectors
    of size 3, expressed in the IMU's frame I; `R_WI` is abstract, a
    RotationMatrix. They depend on time only.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        X_BI: RigidTransform,
        gravity_W: np.ndarray,
        rate: float,
    ):
        """Declares the ports.

        Args:
            trajectory: of the vehicle B.
            X_BI: pose of the IMU on it.
            gravity_W: the acceleration of free fall [m/s^2].
            rate: samples per second, for computing many at a time [1/s].
        """
        super().__init__()
        self._trajectory = trajectory
        self._X_BI = X_BI
        self._gravity_W = np.array(gravity_W)
        self._rate = rate
        self._block: int | None = None
        self._samples: tuple[np.ndarray, ...] = ()
        for place, name in enumerate(("specific_force", "angular_velocity")):
            self.DeclareVectorOutputPort(
                name,
                3,
                lambda context, output, place=place: self._calc_vector(
                    place, context, output
                ),
                {self.time_ticket()},
            )
        self.DeclareAbstractOutputPort(
            "R_WI",
            lambda: Value(RotationMatrix()),
            self._calc_rotation,
            {self.time_ticket()},
        )

    def _calc_vector(
        self, place: int, context: Context, output: BasicVector
    ) -> None:
        output.SetFromVector(self._sample(context.get_time())[place])

    def _calc_rotation(self, context: Context, output: AbstractValue) -> None:
        output.set_value(RotationMatrix(self._sample(context.get_time())[2]))

    def _sample(self, time: float) -> tuple[np.ndarray, ...]:
        """Returns specific force, angular velocity and R_WI at a time."""
        sample = round(time * self._rate)
        if abs(time * self._rate - sample) > _TOLERANCE:
            return tuple(one[0] for one in self._measure(np.array([time])))
        block, row = divmod(sample, _BLOCK)
        if block != self._block:
            numbers = block * _BLOCK + np.arange(_BLOCK)
            self._samples = self._measure(numbers / self._rate)
            self._block = block
        return tuple(one[row] for one in self._samples)

    def _measure(self, times: np.ndarray) -> tuple[np.ndarray, ...]:
        """Returns specific forces (N, 3), w_WI (N, 3) and R_WI (N, 3, 3)."""
        # Before the start the vehicle rests, as after the end.
        motion = self._trajectory.body_motion(np.maximum(times, 0.0))
        R_WI = motion.R @ self._X_BI.rotation().matrix()
        a_WI = motion.acceleration_at(self._X_BI.translation())
        force = np.einsum("nji,nj->ni", R_WI, a_WI - self._gravity_W)
        return force, np.einsum("nji,nj->ni", R_WI, motion.w), R_WI
