"""What comes and goes between two drives through one stage."""

from __future__ import annotations

from pydantic import Field

from cns_drake.scenarios.section import Section


class TransientConfig(Section):
    """Changes of a city that no building plan lists.

    Each switch changes the stage as a function of the seed and of the names
    of its structures, whatever the other switches are.

    Attributes:
        seed: of all that is drawn.
        parked_cars: part of the parked cars that have left, stand elsewhere
            in their bay, or have another car in their place.
        leaves: part of the leaves that crowns and shrubs still have.
        snow: depth of the snow on what faces the sky [m].
        scaffolds: part of the fronts along the drive that stand behind a
            scaffold.
        works: part of the stretches of kerb along the drive with roadworks
            beside them.
        furniture: part of poles, lamps and signs that were replaced within
            2 m.
    """

    seed: int = Field(default=1, ge=0)
    parked_cars: float = Field(default=0.0, ge=0.0, le=1.0)
    leaves: float = Field(default=1.0, ge=0.0, le=1.0)
    snow: float = Field(default=0.0, ge=0.0, le=1.0)
    scaffolds: float = Field(default=0.0, ge=0.0, le=1.0)
    works: float = Field(default=0.0, ge=0.0, le=1.0)
    furniture: float = Field(default=0.0, ge=0.0, le=1.0)

    @property
    def is_off(self) -> bool:
        """Whether nothing changes."""
        return self == TransientConfig(seed=self.seed)
