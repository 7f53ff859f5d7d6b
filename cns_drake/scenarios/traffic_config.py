"""The traffic of a scenario."""

from __future__ import annotations

from pydantic import Field, model_validator

from cns_drake.scenarios.section import Section, field_off_by_default

# More than any map can hold.
_MOST = 2000


class TrafficConfig(Section):
    """Vehicles and walkers that move while a drive is recorded.

    Attributes:
        vehicles: number of cars, vans, trucks, buses, motorcycles and bicycles
            that drive along the map's roads.
        walkers: number of people that walk on its sidewalks and crossings.
        seed: seed of their kinds, starts and ways.
        fcd: a trace of SUMO (floating-car data) to play instead; then nothing
            else moves.
    """

    vehicles: int = Field(default=0, ge=0, le=_MOST)
    walkers: int = Field(default=0, ge=0, le=_MOST)
    seed: int = Field(default=1, ge=0)
    fcd: str | None = field_off_by_default(None)

    @model_validator(mode="after")
    def _check_fcd(self) -> TrafficConfig:
        if self.fcd is not None and (self.vehicles or self.walkers):
            raise ValueError(
                "fcd: the trace replaces other traffic; leave out vehicles "
                "and walkers"
            )
        return self

    @property
    def is_off(self) -> bool:
        """Whether there is no traffic."""
        return self.fcd is None and self.vehicles == self.walkers == 0
