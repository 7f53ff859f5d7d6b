"""Options that change fields of a scenario, for all commands that have them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import typer

from evaluation.base import (
    InputError,
    errors_at_option,
    nested,
    note,
    with_options,
)
from evaluation.lidar_sheets import LIDAR_PRESETS

if TYPE_CHECKING:
    from cns_drake.scenarios import Scenario

_PRESETS = list(LIDAR_PRESETS)
LIDAR_HELP = (
    "Model of LiDAR to simulate: the file of a data sheet of your own, or the "
    f"name of a preset: {', '.join(_PRESETS[:-1])} or {_PRESETS[-1]}."
)
# Options that switch on calibrated returns.
_WEATHER = ("fog", "rain", "snowfall")


class _Option(NamedTuple):
    """An option, and what it changes.

    Attributes:
        kind: type of the value.
        change: a field; or a function of a scenario and the value, which
            returns the changed scenario.
        metavar: name of the value in the help; by default the type's.
    """

    kind: Any
    change: str | Callable[[Scenario, Any], Scenario]
    help: str
    metavar: str | None = None


def field_options(
    *names: str,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Returns a decorator that adds options for fields to a command.

    The command gets their values in place of its keyword `changes`, for
    `changed`. The option `--set`, for all fields, is always added.

    Args:
        names: names of options, such as `imu_rate`.
    """
    return with_options(
        "changes",
        {name: (_declared(name), None) for name in (*names, "fields")},
        dict,
    )


def changed(scenario: Scenario, changes: Mapping[str, Any]) -> Scenario:
    """Returns a scenario with the changes that options make.

    Args:
        scenario: the scenario.
        changes: name of an option -> its value; None changes nothing.

    Raises:
        InputError: a value cannot be used; the message names the option.
        TypeError: there is no such option.
    """
    if unknown := changes.keys() - _OPTIONS.keys():
        raise TypeError(f"{min(unknown)}: no option for a field of a scenario")
    if changes.get("returns") == "ideal" and any(map(changes.get, _WEATHER)):
        raise InputError("--returns ideal: weather needs calibrated returns")
    for name, option in _OPTIONS.items():
        value = changes.get(name)
        if value is None:
            continue
        if name in _WEATHER and value:
            scenario = scenario.with_returns("calibrated")
        if callable(option.change):
            with errors_at_option(_flag(name), "unit"):
                scenario = option.change(scenario, value)
        else:
            scenario = scenario.with_fields(
                nested(option.change, value), _flag(name)
            )
    return scenario


def _flag(name: str) -> str:
    return "--set" if name == "fields" else f"--{name.replace('_', '-')}"


def _declared(name: str) -> Any:
    """Returns the type of an option's parameter, for typer."""
    kind, _, text, metavar = _OPTIONS[name]
    return Annotated[
        kind | None, typer.Option(_flag(name), metavar=metavar, help=text)
    ]


def _traffic(scenario: Scenario, number: int) -> Scenario:
    numbers = {"vehicles": number, "walkers": number}
    return scenario.with_fields({"traffic": numbers}, "--traffic")


def _transient(
    scenario: Scenario, given: Mapping[str, Any] | Iterable[str]
) -> Scenario:
    switches = dict(given) if isinstance(given, Mapping) else {}
    for item in [] if switches else ",".join(given).split(","):
        name, equals, value = (part.strip() for part in item.partition("="))
        if not (name and equals and value) or name in switches:
            raise InputError(
                f"--transient: '{item}' is not of the form SWITCH=VALUE, such "
                "as snow=0.2"
            )
        switches[name] = value
    return scenario.with_transient(**switches)


def _driver(scenario: Scenario, driver: Literal["real", "none"]) -> Scenario:
    if driver == "real" and scenario.waypoints is not None:
        note("--driver real: waypoints have no lanes to change to")
    return scenario.with_driver(driver)


def _camera(scenario: Scenario, given: Mapping[str, int] | str) -> Scenario:
    if isinstance(given, str):
        match = re.fullmatch(r"(\d{1,9})x(\d{1,9})@(\d{1,9})", given)
        if match is None:
            raise InputError(
                f"--camera: '{given}' is not of the form WxH@RATE, such as "
                "640x480@2"
            )
        numbers = map(int, match.groups())
        given = dict(zip(("width", "height", "rate"), numbers, strict=True))
    camera = {"depth": True, "label": True, **given}
    return scenario.with_fields({"cameras": {"camera": camera}}, "--camera")


def _set(scenario: Scenario, texts: Iterable[str]) -> Scenario:
    from cns_drake.scenarios import set_fields

    found = set_fields(scenario, texts)
    for name in found.lidars.keys() - scenario.lidars.keys():
        note(f"--set: lidars.{name}: a further LiDAR")
    return found


# By the names of parameters, in the order in which they change a scenario.
_OPTIONS = {
    "frames": _Option(
        int,
        "frames",
        "Number of frames (LiDAR scans) to record, from the start of the "
        "drive; by default the whole drive. Usually there are 20 frames per "
        "second.",
        "N",
    ),
    "seed": _Option(
        int,
        "seed",
        "Seed of the random noise and weather. A different seed gives "
        "different errors with the same statistics.",
        "N",
    ),
    "lidar": _Option(
        str,
        lambda scenario, unit: scenario.with_lidar(unit),
        LIDAR_HELP,
        "PRESET|FILE.yaml",
    ),
    "returns": _Option(
        Literal["ideal", "calibrated"],
        lambda scenario, model: scenario.with_returns(model),
        "Model of the LiDARs' returns. ideal returns are exact; calibrated "
        "returns have the noise, the losses and the intensities of the LiDAR's "
        "data sheet.",
    ),
    # In Python alone, with a `WeatherConfig`.
    "weather": _Option(None, "weather", ""),
    "fog": _Option(
        float,
        "weather.visibility",
        "Visibility in fog [m], with calibrated returns; a lower visibility "
        "means denser fog.",
        "METRES",
    ),
    "rain": _Option(
        float,
        "weather.rain",
        "Rain rate [mm/h], with calibrated returns.",
        "MM_H",
    ),
    "snowfall": _Option(
        float,
        "weather.snowfall",
        "Snowfall rate, as melted water [mm/h], with calibrated returns.",
        "MM_H",
    ),
    "traffic": _Option(
        int,
        _traffic,
        "Number of vehicles of the map's recorded traffic, at most 60 on a "
        "shipped map. The same number of pedestrians is added.",
        "N",
    ),
    "transient": _Option(
        list[str],
        _transient,
        "Temporary changes to the city, such as snow=0.25,leaves=0.15: fields "
        "of the section transient of a scenario. May be repeated.",
        "SWITCH=VALUE,...",
    ),
    "driver": _Option(
        Literal["real", "none"],
        _driver,
        "Model of the driver. With real, the car wanders in its lane and "
        "changes lanes, as in published data sets. With none, the car stays in "
        "the middle of its lane.",
    ),
    "ride": _Option(
        Literal["A", "B", "C", "D", "E", "none"],
        "ride.roughness",
        "Roughness of the road that shakes the car on its springs, as a class "
        "of ISO 8608 from A (new) to E (very poor).",
    ),
    "imu_rate": _Option(
        int, "imu.rate", "Sampling rate of the IMU [Hz].", "HZ"
    ),
    "camera": _Option(
        str,
        _camera,
        "Add a camera that looks ahead: width and height of an image in "
        "pixels, and images per second, such as 640x480@2. The camera also "
        "records depth images and images of semantic classes.",
        "WxH@RATE",
    ),
    "fields": _Option(
        list[str],
        _set,
        "New value for any field of a scenario, such as weather.rain=20; VALUE "
        "is YAML. For a field inside another field, join both names by a dot, "
        "such as lidars.lidar.rings=16. May be repeated.",
        "FIELD=VALUE",
    ),
}
