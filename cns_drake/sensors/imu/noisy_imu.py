"""A system that adds the errors of an IMU to exact measurements."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import (
    Context,
    LeafSystem,
)

from cns_drake.sensors.imu.noise import ImuErrors, ImuNoise
from cns_drake.sensors.imu.sampling import MEASUREMENTS, last_sample


class NoisyImu(LeafSystem):
    """Adds the errors of an IMU to exact specific force and angular velocity.

    .. pydrake_system::

        name: NoisyImu
        input_ports:
        - specific_force
        - angular_velocity
        output_ports:
        - specific_force
        - angular_velocity

    All ports are vectors of size 3, expressed in the IMU's frame [m/s^2,
    rad/s]. Sample k is at time k / rate. Between two samples, the error of the
    earlier sample is added.
    """

    def __init__(self, noise: ImuNoise, rate: float):
        """Declares the ports.

        Args:
            noise: errors of the IMU.
            rate: samples per second.
        """
        super().__init__()
        self._errors = ImuErrors(noise, rate)
        self._rate = rate
        self._inputs = [
            self.DeclareVectorInputPort(name, 3) for name in MEASUREMENTS
        ]
        for column, name in ((0, MEASUREMENTS[0]), (3, MEASUREMENTS[1])):
            self.DeclareVectorOutputPort(
                name,
                3,
                lambda context, output, column=column: output.SetFromVector(
                    self._calc_sample(context)[column : column + 3]
                ),
            )

    def _calc_sample(self, context: Context) -> np.ndarray:
        """Returns the sample (6,) at the time of the Context."""
        sample = last_sample(context.get_time(), self._rate)
        exact = [port.Eval(context) for port in self._inputs]
        return self._errors.measure(sample, np.hstack(exact)[None])[0]
