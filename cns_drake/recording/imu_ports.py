"""The recorder's ports of an IMU, and their messages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydrake.math import RotationMatrix
from pydrake.systems.framework import Context, LeafSystem

from cns_drake.recording import messages
from cns_drake.recording.input_values import declare_object, value_of
from cns_drake.recording.recorded_topics import IMU_TOPIC
from cns_drake.recording.schedule import Schedule


class ImuPorts:
    """Ports of the present sample: `specific_force`, `angular_velocity`."""

    def __init__(self, system: LeafSystem, variances: tuple[float, float]):
        """Declares the ports; for the variances see `make_imu`."""
        self._specific_force = system.DeclareVectorInputPort(
            "specific_force", 3
        )
        self._angular_velocity = system.DeclareVectorInputPort(
            "angular_velocity", 3
        )
        self._variances = variances

    def message(
        self, context: Context, R_WI: RotationMatrix | None, stamp_ns: int
    ) -> Any | None:
        """Returns the message; None if no port is connected.

        Args:
            context: of the recorder.
            R_WI: orientation of the imu frame I; None if it is not known.
            stamp_ns: time of the message [ns].
        """
        angular_velocity = value_of(self._angular_velocity, context)
        specific_force = value_of(self._specific_force, context)
        if angular_velocity is None and specific_force is None:
            return None
        quat_xyzw = None if R_WI is None else messages.to_quat_xyzw(R_WI)
        return messages.make_imu(
            quat_xyzw,
            angular_velocity,
            specific_force,
            stamp_ns,
            self._variances,
        )


class ImuSamplesPort:
    """The port `imu_samples`: the last samples up to now."""

    def __init__(self, system: LeafSystem, variances: tuple[float, float]):
        """Declares the port; for the variances see `make_imu`."""
        self._samples = declare_object(system, "imu_samples")
        self._variances = variances

    def messages(
        self,
        context: Context,
        schedule: Schedule,
        since: int,
        tick: int,
        start_ns: int,
    ) -> Iterator[tuple[int, int, Any]]:
        """Yields number, stamp [ns] and message of each new sample.

        Args:
            context: of the recorder.
            schedule: of the recording.
            since: the last tick whose sample is written.
            tick: the present one.
            start_ns: the stamp of time zero [ns].

        Raises:
            ValueError: the port shows too few samples.
        """
        step = schedule.steps[IMU_TOPIC.name]
        last = min(tick, schedule.ends.get(IMU_TOPIC.name, tick))
        numbers = range(since // step + 1, last // step + 1)
        samples = value_of(self._samples, context)
        if samples is None or not numbers:
            return
        first = numbers[0] - samples.first
        if first < 0:
            raise ValueError("imu_samples: the oldest samples are missing")
        for row, number in enumerate(numbers, first):
            stamp_ns = start_ns + schedule.time_ns(number * step)
            message = messages.make_imu(
                samples.quat_xyzw[row],
                samples.angular_velocity[row],
                samples.specific_force[row],
                stamp_ns,
                self._variances,
            )
            yield number, stamp_ns, message
