"""Passing changes between two drives through one stage."""

from __future__ import annotations

from pydantic import Field

from cns_drake.scenarios.section import Section


class TransientConfig(Section):
    """Changes of a city that no building plan lists.

    The effect of each switch depends on the seed and on the names of
    structures, not on the other switches.

    Attributes:
        seed: seed of all draws.
        parked_cars: part of the parked cars that have left (three in ten of
            them), stand elsewhere in their bay (two), or have another in their
            place.
        leaves: part of the leaves that is left on crowns, needles included;
            wood stays; a shrub without wood keeps a tenth, as twigs.
        snow: depth of the snow on surfaces that face the sky within 120 m of
            the drive; roads are cleared, with banks along their kerbs [m].
        scaffolds: part of the fronts within 30 m of the drive that stand behind
            a scaffold, four in ten of them with a net.
        works: part of the stretches of kerb within 30 m of the drive with
            fences, skips or diggers beside the road, and a new kerb stone 0.3 m
            into it.
        furniture: part of poles, lamps and signs that were replaced within 2 m.
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
