"""Names of the systems of sensors and traffic in a diagram."""

from collections.abc import Collection

from pydrake.systems.framework import DiagramBuilder

from evaluation.base import check_type

# Endings of the names of an IMU's systems.
IMU_PARTS = ("accelerometer", "gyroscope", "noise")


def check_new_sensor(
    builder: DiagramBuilder, name: str, parts: Collection[str] = ()
) -> None:
    """Checks the name of a sensor that is added to a diagram.

    Only a recorder asks more of a name: it becomes a part of a ROS 2 topic.

    Args:
        builder: builder of the diagram.
        name: the name.
        parts: endings of the names of the sensor's systems; an underscore
            stands between the sensor's name and the ending.

    Raises:
        ValueError: the name is no text, is empty, or another system or sensor
            of the diagram has it.
    """
    if not isinstance(name, str) or not name:
        raise ValueError(f"name: {name!r} is not a text of at least one letter")
    # An IMU has the first part, but no system of the name itself.
    endings = dict.fromkeys((IMU_PARTS[0], *parts))
    check_unused_names(builder, name, *(f"{name}_{part}" for part in endings))


def check_unused_names(builder: DiagramBuilder, *names: str) -> None:
    """Checks that a diagram has no systems of certain names yet.

    A diagram with two systems of one name ends the process when it is built.

    Raises:
        TypeError: the builder is no DiagramBuilder.
        ValueError: the diagram has a system of one of these names.
    """
    check_type("builder", builder, DiagramBuilder)
    for name in names:
        if builder.HasSubsystemNamed(name):
            raise ValueError(
                f"name: the diagram has a system '{name}'; give each a name "
                "of its own"
            )
