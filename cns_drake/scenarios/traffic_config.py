"""The traffic of a scenario."""

from __future__ import annotations

from pydantic import Field

from cns_drake.scenarios.section import Section

# No map holds more.
_MOST = 2000


class TrafficConfig(Section):
    """Vehicles and walkers that move while a drive is recorded.

    Attributes:
        vehicles: how many cars, vans, trucks, buses, motorcycles and bicycles
            drive along the map's roads.
        walkers: how many people walk on its sidewalks and crossings.
        seed: seed of their kinds, starts and ways.
    """

    vehicles: int = Field(default=0, ge=0, le=_MOST)
    walkers: int = Field(default=0, ge=0, le=_MOST)
    seed: int = Field(default=1, ge=0)

    @property
    def is_off(self) -> bool:
        """Whether nobody moves."""
        return self.vehicles == self.walkers == 0
