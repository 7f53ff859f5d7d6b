"""An IMU on a vehicle whose motion is prescribed."""

from collections.abc import Callable
import math

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem
from scipy.spatial.transform import Rotation

from cns_drake.base.drives.drive import ImuSamples
from cns_drake.base.elementary import product, rotated
from cns_drake.motion.trajectory import Trajectory

# Samples computed at a time, and greatest distance of a wanted time from a
# sample's, in samples.
_BLOCK = 512
_TOLERANCE = 1e-6
# Samples on the port: enough for one frame at 1,000 samples and 5 frames a
# second.
_REMEMBERED = 256


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
        - samples

    `specific_force` [m/s^2] and `angular_velocity` w_WI [rad/s] are vectors
    of size 3, expressed in the IMU's frame I; between samples, the error of
    the last one holds. `samples` is abstract, `ImuSamples`: the last 256 up
    to the time of the context. All depend on time only.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        X_BI: RigidTransform,
        gravity_W: np.ndarray,
        rate: float,
        measure: Callable[[int, np.ndarray], np.ndarray] | None = None,
    ):
        """Declares the ports.

        Gravity is the acceleration of free fall [m/s^2], the rate the samples
        per second. `measure` adds errors: it takes the number of the first
        sample and (N, 6) exact specific forces and angular velocities, and
        returns the measured ones. By default there are no errors.
        """
        super().__init__()
        self._trajectory = trajectory
        self._X_BI = X_BI
        self._gravity_W = np.array(gravity_W)
        self._rate = rate
        self._add_errors = measure or (lambda first, exact: exact)
        # Number of a block -> its samples; the last two are kept.
        self._blocks: dict[int, ImuSamples] = {}
        for name in ("specific_force", "angular_velocity"):
            self.DeclareVectorOutputPort(
                name,
                3,
                lambda context, output, name=name: self._calc_vector(
                    name, context, output
                ),
                {self.time_ticket()},
            )
        self.DeclareAbstractOutputPort(
            "samples",
            lambda: Value(object()),
            self._calc_samples,
            {self.time_ticket()},
        )

    def _calc_vector(
        self, name: str, context: Context, output: BasicVector
    ) -> None:
        time = context.get_time()
        number = self._last_sample(time)
        if abs(time * self._rate - number) > _TOLERANCE:
            sample = self._measure(number, np.array([time]))
        else:
            sample = self._some(number, number + 1)
        output.SetFromVector(getattr(sample, name)[0])

    def _calc_samples(self, context: Context, output: AbstractValue) -> None:
        end = self._last_sample(context.get_time()) + 1
        output.set_value(self._some(end - _REMEMBERED, end))

    def _last_sample(self, time: float) -> int:
        return math.floor(time * self._rate + _TOLERANCE)

    def _some(self, first: int, end: int) -> ImuSamples:
        """Returns the samples of numbers from `first` to before `end`."""
        parts = []
        for number in range(first // _BLOCK, (end - 1) // _BLOCK + 1):
            start = number * _BLOCK
            if number not in self._blocks:
                times = (start + np.arange(_BLOCK)) / self._rate
                self._blocks[number] = self._measure(start, times)
                if len(self._blocks) > 2:
                    del self._blocks[next(iter(self._blocks))]
            rows = slice(max(first - start, 0), end - start)
            parts.append([one[rows] for one in self._blocks[number][1:]])
        return ImuSamples(first, *map(np.concatenate, zip(*parts, strict=True)))

    def _measure(self, first: int, times: np.ndarray) -> ImuSamples:
        """Returns samples at (N,) times with the errors from `first` on."""
        # Before the start the vehicle rests, as after the end.
        motion = self._trajectory.body_motion(np.maximum(times, 0.0))
        R_WI = product(motion.R, self._X_BI.rotation().matrix())
        R_IW = R_WI.transpose(0, 2, 1)
        a_WI = motion.acceleration_at(self._X_BI.translation())
        force = rotated(R_IW, a_WI - self._gravity_W)
        turn = rotated(R_IW, motion.w)
        measured = self._add_errors(first, np.hstack([force, turn]))
        return ImuSamples(
            first,
            Rotation.from_matrix(R_WI).as_quat(canonical=True),
            measured[:, 3:],
            measured[:, :3],
        )
