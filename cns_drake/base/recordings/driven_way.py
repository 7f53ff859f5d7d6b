"""The way of a drive through its city."""

from __future__ import annotations

from collections.abc import Mapping

# Fields of a scenario that lead the vehicle.
_PATHS = ("route", "waypoints")
# Fields that move it beside its path, or let it turn round.
_CHANGES = ("aside", "u_turns")


def driven_way(scenario: Mapping | None) -> dict | None:
    """Returns what a scenario says about where a drive leads.

    Two drives with the same way differ at most in what surrounds them and in
    how they measure it.

    Args:
        scenario: its fields, as a recording holds them.

    Returns:
        The fields that have an effect, to be compared with those of other
        drives; None if it does not say where the drive leads.
    """
    if scenario is None or not any(scenario.get(name) for name in _PATHS):
        return None
    return {
        name: scenario[name] for name in _PATHS + _CHANGES if scenario.get(name)
    }
