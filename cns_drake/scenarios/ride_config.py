"""The ride of a scenario: springs and a rough road."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from cns_drake.motion.road_profile import RoadProfile, RoughnessClass
from cns_drake.scenarios.section import Section


class RideConfig(Section):
    """The motion of the vehicle's body against its path.

    Attributes:
        roughness: class of the road after ISO 8608, from `A` (new) to `E` (very
            poor).
        seed: seed of the road's profile.
    """

    roughness: Literal["none", RoughnessClass] = "none"
    seed: int = Field(default=1, ge=0)

    def profile(self) -> RoadProfile | None:
        """Returns the road's profile; None if the vehicle is rigid."""
        if self.roughness == "none":
            return None
        return RoadProfile(self.roughness, self.seed)
