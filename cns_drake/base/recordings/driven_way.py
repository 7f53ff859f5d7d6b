"""The way of a drive through its city."""

from __future__ import annotations

from collections.abc import Mapping

# Fields of a scenario that lead the vehicle.
_PATHS = ("route", "waypoints")
# Fields that move the vehicle beside its path, or turn it round.
_CHANGES = ("aside", "u_turns")


def driven_way(scenario: Mapping | None) -> dict | None:
    """Returns the fields of a scenario that determine the path of a drive.

    Two drives with the same way differ at most in their surroundings and their
    sensors.

    Args:
        scenario: its fields, as a recording holds them.

    Returns:
        The fields that have an effect, to be compared with those of other
        drives; None if the scenario does not determine the path.
    """
    if scenario is None or not any(scenario.get(name) for name in _PATHS):
        return None
    return {
        name: scenario[name] for name in _PATHS + _CHANGES if scenario.get(name)
    }
