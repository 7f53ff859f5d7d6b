"""A system that adds an IMU's errors to exact values."""

from __future__ import annotations

import math

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import (
    BasicVector,
    Context,
    LeafSystem,
    ValueProducer,
)

from cns_drake.sensors.imu_noise import ImuErrors, ImuNoise

# Rounding error of a sample's time, in periods.
_SAMPLE_TOLERANCE = 1e-6


class NoisyImu(LeafSystem):
    """Adds noise to specific force and angular velocity.

    .. pydrake_system::

        name: NoisyImu
        input_ports:
        - specific_force
        - angular_velocity
        output_ports:
        - specific_force
        - angular_velocity

    All ports are vectors of size 3, expressed in the IMU's frame [m/s^2,
    rad/s]. Sample k is at k / rate; between samples the error of the last one
    holds.
    """

    def __init__(self, noise: ImuNoise, rate: float):
        """Declares the ports.

        Args:
            noise: the errors' sizes.
            rate: samples per second [1/s].
        """
        super().__init__()
        self._errors = ImuErrors(noise, rate)
        self._rate = rate
        names = ("specific_force", "angular_velocity")
        self._inputs = [self.DeclareVectorInputPort(name, 3) for name in names]
        # Both ports use the same sample.
        measured = self.DeclareCacheEntry(
            "measured",
            ValueProducer(
                allocate=lambda: Value(object()), calc=self._calc_measured
            ),
            {*(port.ticket() for port in self._inputs), self.time_ticket()},
        )
        self._measured = measured
        for place, name in enumerate(names):
            self.DeclareVectorOutputPort(
                name,
                3,
                lambda context, output, place=place: self._calc(
                    place, context, output
                ),
                {self.cache_entry_ticket(measured.cache_index())},
            )

    def _calc_measured(self, context: Context, value: AbstractValue) -> None:
        sample = math.floor(context.get_time() * self._rate + _SAMPLE_TOLERANCE)
        exact = [
            port.Eval(context) if port.HasValue(context) else np.zeros(3)
            for port in self._inputs
        ]
        measured = self._errors.measure(sample, np.hstack(exact)[None])
        value.set_value(measured[0])

    def _calc(self, place: int, context: Context, output: BasicVector) -> None:
        measured = self._measured.Eval(context)
        output.SetFromVector(measured[3 * place : 3 * place + 3])
