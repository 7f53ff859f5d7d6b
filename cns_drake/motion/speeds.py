"""The driver's limits of speed and acceleration."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

_Acceleration = Annotated[float, Field(ge=0.05, le=9.81, allow_inf_nan=False)]


class Speeds(BaseModel):
    """Limits of speed and acceleration, which the car never exceeds.

    Attributes:
        cruise: highest speed of the car [m/s]. The speed limits of the roads
            apply as well.
        longitudinal_acceleration: largest acceleration and deceleration along
            the path [m/s^2].
        lateral_acceleration: largest centripetal acceleration in bends [m/s^2].
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    cruise: float = Field(default=13.5, ge=0.5, le=60, allow_inf_nan=False)
    longitudinal_acceleration: _Acceleration = 2.0
    lateral_acceleration: _Acceleration = 3.0
