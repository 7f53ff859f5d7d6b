"""Options of LiDAR returns and of weather."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cns_drake.base.errors import InputError

if TYPE_CHECKING:
    from cns_drake.scenarios.weather_config import WeatherConfig


Kind = Literal["ideal", "calibrated"]


class ReturnsName(str, Enum):
    """Models of LiDAR returns."""

    IDEAL = "ideal"
    CALIBRATED = "calibrated"


Returns = Annotated[
    ReturnsName | None,
    typer.Option(
        help="Ideal returns, or those of the unit's data sheet with noise, "
        "losses and calibrated reflectivity as intensity."
    ),
]
Fog = Annotated[
    float | None,
    typer.Option(
        metavar="METRES",
        help="Visibility in fog. Weather switches calibrated returns on.",
    ),
]
Rain = Annotated[float, typer.Option(metavar="MM_H", help="Rate of rain.")]
Snowfall = Annotated[
    float, typer.Option(metavar="MM_H", help="Rate of snowfall, as water.")
]


_KINDS: dict[ReturnsName, Kind] = {
    ReturnsName.IDEAL: "ideal",
    ReturnsName.CALIBRATED: "calibrated",
}


def choose_returns(
    returns: ReturnsName | None,
    fog: float | None,
    rain: float,
    snowfall: float,
) -> tuple[Kind | None, WeatherConfig | None]:
    """Returns the returns and the weather of the options; None if not given.

    Raises:
        InputError: a value is out of range; the message names its option.
    """
    if fog is None and not rain and not snowfall:
        return None if returns is None else _KINDS[returns], None
    from pydantic import ValidationError

    from cns_drake.scenarios.weather_config import WeatherConfig

    if returns is ReturnsName.IDEAL:
        raise InputError("--returns ideal: weather needs calibrated returns")
    try:
        weather = WeatherConfig(visibility=fog, rain=rain, snowfall=snowfall)
    except ValidationError as error:
        fault = error.errors()[0]
        field = str(fault["loc"][0])
        option = "fog" if field == "visibility" else field
        raise InputError(f"--{option}: {fault['msg']}") from None
    return "calibrated", weather
