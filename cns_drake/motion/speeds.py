"""Speeds and accelerations of a drive."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Acceleration = Annotated[float, Field(ge=0.05, le=9.81, allow_inf_nan=False)]


class Speeds(BaseModel):
    """Bounds of a drive's speed and acceleration at every instant.

    Attributes:
        cruise: the highest speed; the roads' limits hold besides [m/s].
        longitudinal_acceleration: bound along the path, both signs [m/s^2].
        lateral_acceleration: bound of the centripetal acceleration [m/s^2].
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    cruise: float = Field(default=13.5, ge=0.5, le=60, allow_inf_nan=False)
    longitudinal_acceleration: Acceleration = 2.0
    lateral_acceleration: Acceleration = 3.0
