"""The IMU of a vehicle whose trajectory is known."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    System,
)
from scipy.spatial.transform import Rotation

from cns_drake.motion import Trajectory
from cns_drake.sensors import carriers
from cns_drake.sensors.imu.config import ImuSection
from cns_drake.sensors.imu.imu import add_imu
from cns_drake.sensors.imu.noise import (
    MEASUREMENTS,
    ImuErrors,
    is_sample_time,
    last_sample,
)
from evaluation.base import product, rotated
from evaluation.drives import ImuSamples

# Samples that `VehicleImu` computes at a time.
_BLOCK = 512
# Samples on its port: enough for one frame at 1,000 samples and 5 frames a
# second.
_REMEMBERED = 256


def add_described_imu(
    config: ImuSection,
    builder: DiagramBuilder,
    body: RigidBody,
    *,
    trajectory: Trajectory,
    motion: System,
    scan_rate: int,
    seed: int,
) -> dict[str, OutputPort]:
    """Adds an IMU to a diagram, given its description in a scenario.

    Args:
        config: the description, a section of a scenario.
        builder: builder of the diagram.
        body: body that carries the IMU.
        trajectory: motion of that body as a function of time.
        motion: system with the kinematic output ports of the body's plant.
        scan_rate: scans per second; also the rate of the IMU if the description
            has no rate.
        seed: seed of the IMU's errors.

    Returns:
        Name -> output port: `specific_force` [m/s^2] and `angular_velocity`
        [rad/s], both in the frame of the IMU. If the IMU has errors, or a rate
        of its own, there is also `imu_samples`, of type `ImuSamples`.

    Raises:
        InputError: Kalibr's file cannot be used.
    """
    X_BI = carriers.sensor_pose(config)
    if config.is_ideal:
        return add_imu(builder, body, X_BI, motion=motion).ports()
    rate = config.sample_rate(scan_rate)
    gravity = body.GetParentPlant().gravity_field().gravity_vector()
    errors = ImuErrors(config.noise(seed), rate)
    imu = builder.AddNamedSystem(
        "imu", VehicleImu(trajectory, X_BI, gravity, rate, errors.measure)
    )
    ports = {name: imu.GetOutputPort(name) for name in MEASUREMENTS}
    return ports | {"imu_samples": imu.GetOutputPort("samples")}


class VehicleImu(LeafSystem):
    """Measures like an accelerometer and a gyroscope on a vehicle.

    Up to rounding and added errors, the values equal the values of Drake's
    `Accelerometer` and `Gyroscope`. This system is much faster than Drake's
    systems, because it computes many samples at once from a known trajectory.

    .. pydrake_system::

        name: VehicleImu
        output_ports:
        - specific_force
        - angular_velocity
        - samples

    `specific_force` [m/s^2] and `angular_velocity` w_WI [rad/s] are vectors of
    size 3, expressed in the IMU's frame I. At a time between two samples, both
    outputs are the exact values plus the error of the earlier sample. `samples`
    is abstract, of type `ImuSamples`: the last 256 samples up to the time of
    the context. All outputs depend only on time.
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

        Args:
            trajectory: motion of the body B.
            X_BI: pose of the IMU.
            gravity_W: acceleration of free fall [m/s^2].
            rate: samples per second.
            measure: function that adds errors. Its arguments are the number of
                the first sample, and the exact specific forces and angular
                velocities, (N, 6). The function returns the measured values,
                (N, 6). By default there are no errors.
        """
        super().__init__()
        self._trajectory = trajectory
        self._X_BI = RigidTransform(X_BI)
        self._gravity_W = np.array(gravity_W)
        self._rate = rate
        self._add_errors = measure or (lambda first, exact: exact)
        # Threads may share the system.
        self._block = lru_cache(maxsize=4)(self._calc_block)
        for name in MEASUREMENTS:
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
        number = last_sample(time, self._rate)
        if is_sample_time(time, self._rate):
            sample = self._samples_between(number, number + 1)
        else:
            sample = self._measure_at(number, np.array([time]))
        output.SetFromVector(getattr(sample, name)[0])

    def _calc_samples(self, context: Context, output: AbstractValue) -> None:
        end = last_sample(context.get_time(), self._rate) + 1
        output.set_value(self._samples_between(end - _REMEMBERED, end))

    def _samples_between(self, first: int, end: int) -> ImuSamples:
        """Returns the samples with numbers `first` to `end` - 1."""
        parts = []
        for number in range(first // _BLOCK, (end - 1) // _BLOCK + 1):
            start = number * _BLOCK
            rows = slice(max(first - start, 0), end - start)
            parts.append([column[rows] for column in self._block(number)[1:]])
        return ImuSamples(first, *map(np.concatenate, zip(*parts, strict=True)))

    def _calc_block(self, number: int) -> ImuSamples:
        start = number * _BLOCK
        return self._measure_at(start, (start + np.arange(_BLOCK)) / self._rate)

    def _measure_at(self, first: int, times: np.ndarray) -> ImuSamples:
        """Returns samples number `first` onwards, taken at (N,) times [s]."""
        # Before the start the vehicle rests, as after the end.
        motion = self._trajectory.body_motion(np.maximum(times, 0.0))
        R_WI = product(motion.R, self._X_BI.rotation().matrix())
        R_IW = R_WI.transpose(0, 2, 1)
        a_WI = motion.acceleration_at(self._X_BI.translation())
        force = rotated(R_IW, a_WI - self._gravity_W)
        rate = rotated(R_IW, motion.w)
        measured = self._add_errors(first, np.hstack([force, rate]))
        return ImuSamples(
            first,
            Rotation.from_matrix(R_WI).as_quat(canonical=True),
            measured[:, 3:],
            measured[:, :3],
        )
