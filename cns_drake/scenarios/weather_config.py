"""The weather of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from cns_drake.scenarios.section import Section

if TYPE_CHECKING:
    from cns_drake.sensors.returns.weather import Weather


class WeatherConfig(Section):
    """The weather, which affects all LiDARs with calibrated returns.

    Attributes:
        visibility: meteorological visibility in fog [m]; no fog by default.
        rain: rate of rain [mm/h].
        snowfall: rate of snowfall, as water [mm/h].
    """

    visibility: float | None = Field(default=None, ge=5.0, le=1e6)
    rain: float = Field(default=0.0, ge=0.0, le=300.0)
    snowfall: float = Field(default=0.0, ge=0.0, le=300.0)

    def weather(self) -> Weather:
        """Returns the weather as the model of a LiDAR."""
        # Slow to import, and not needed to describe a scenario.
        from cns_drake.sensors.returns.weather import Weather

        return Weather(self.visibility, self.rain, self.snowfall)
