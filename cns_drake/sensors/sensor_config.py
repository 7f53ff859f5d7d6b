"""What the descriptions of all sensors share, and that of odometry.

The descriptions are sections of a scenario. This module does not import Drake,
which is slow to import.
"""

from __future__ import annotations

import abc
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from cns_drake.sensors.lidar.beams import HIGHEST_RATE
from evaluation.base import NS_PER_S, Section

if TYPE_CHECKING:
    from pydrake.geometry import SceneGraph
    from pydrake.multibody.tree import RigidBody
    from pydrake.systems.framework import DiagramBuilder, OutputPort, System

    from cns_drake.recording import Topic

# Greatest distance of a sensor from the vehicle's origin [m]; rays are cast in
# single precision.
Place = Annotated[float, Field(ge=-1000.0, le=1000.0)]
Triple = tuple[Place, Place, Place]
Angle = Annotated[float, Field(ge=-3600.0, le=3600.0)]


def field_off_by_default(default: Any, **constraints: Any) -> Any:
    """Defines a field that is written to a file only if it is not the default.

    Thus a new field does not change the text of scenarios that do not use it.

    Args:
        default: default value of the field.
        constraints: further arguments of pydantic's `Field`, such as `ge`.
    """
    return Field(
        default=default,
        exclude_if=lambda value: value == default,
        **constraints,
    )


class Mount(Section):
    """Where a sensor sits on the vehicle.

    Attributes:
        xyz: position in base_link [m].
        rpy_deg: roll, pitch, yaw in base_link [deg].
    """

    xyz: Triple
    rpy_deg: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)


class SensorConfig(Mount, abc.ABC):
    """A sensor that publishes one message at a time on one topic.

    For your own kind of sensor, derive a class from this class. If a subclass
    of `Scenario` has a field of this class, the sensor is added to the Diagram
    and recorded. The name of the field is the name of the sensor and of its
    frame.

    Attributes:
        xyz: position in base_link [m].
        rpy_deg: roll, pitch, yaw in base_link [deg].
        rate: messages per second, at least the rate of the fastest LiDAR and at
            most 1000; by default one message per scan.
    """

    xyz: Triple = (0.0, 0.0, 0.0)
    rate: int | None = field_off_by_default(None)

    @abc.abstractmethod
    def topic(self, name: str) -> Topic:
        """Returns the topic of the sensor with this name: `/<name>/...`."""

    @abc.abstractmethod
    def add(
        self,
        builder: DiagramBuilder,
        scene_graph: SceneGraph,
        body: RigidBody,
        *,
        motion: System,
        name: str,
        seed: int,
    ) -> OutputPort:
        """Adds the sensor to a Diagram; returns the output port to record.

        Args:
            builder: builder of the Diagram.
            scene_graph: SceneGraph with the geometry that the sensor may see.
            body: the vehicle B, of a finalized plant.
            motion: system with the kinematic output ports of that plant.
            name: name of the sensor.
            seed: seed of the drive, for the sensor's random numbers.
        """

    @abc.abstractmethod
    def make_message(self, value: Any, frame_id: str, stamp_ns: int) -> Any:
        """Converts a value of the recorded port to a ROS 2 message.

        Args:
            value: value of the output port that `SensorConfig.add` returned.
            frame_id: name of the sensor's frame.
            stamp_ns: time of the value [ns].
        """


class OdometrySection(Section):
    """How often the vehicle's ground-truth motion is recorded.

    Attributes:
        rate: messages per second [Hz]: a multiple of the fastest LiDAR's rate,
            at most 1000, and a whole number of nanoseconds apart. By default
            one per scan.
    """

    rate: int | None = None


def check_rate(
    rate: float, lowest: int, name: str = "rate", *, multiple_of: int = 1
) -> None:
    """Checks that a sensor can have a rate [Hz].

    Time stamps are whole nanoseconds, so the rate must divide a billion. The
    rate must also be at least `lowest` and a multiple of `multiple_of`. Error
    messages call the field `name`.

    Raises:
        ValueError: the rate is not allowed; the message gives the nearest
            allowed rates.
    """
    allowed = [
        candidate
        for candidate in range(lowest, HIGHEST_RATE + 1)
        if NS_PER_S % candidate == 0 and candidate % multiple_of == 0
    ]
    if rate in allowed:
        return
    below = [candidate for candidate in allowed if candidate < rate][-1:]
    above = [candidate for candidate in allowed if candidate > rate][:1]
    kind = "a number"
    if multiple_of > 1:
        kind = f"a multiple of {multiple_of}"
    near = " or ".join(map(str, below + above))
    raise ValueError(
        f"{name}: {rate:g} a second; it must be {kind} from"
        f" {lowest} to {HIGHEST_RATE} that divides 1,000,000,000 ns"
        + (f", such as {near}" if near else ", and there is none")
    )
