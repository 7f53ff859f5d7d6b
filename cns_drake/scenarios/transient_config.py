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
        furniture: part of poles, lamps and signs that were replaced within
            2 m.
    """

    seed: int = Field(default=1, ge=0)
    parked_cars: float = Field(default=0.0, ge=0.0, le=1.0)
    leaves: float = Field(default=1.0, ge=0.0, le=1.0)
    furniture: float = Field(default=0.0, ge=0.0, le=1.0)

    @property
    def is_off(self) -> bool:
        """Whether nothing changes."""
        return self == TransientConfig(seed=self.seed)
