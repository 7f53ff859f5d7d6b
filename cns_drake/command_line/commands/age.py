"""The command `age`, which simulates years of change in a city."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.command_line.suggestions import suggest_reproduction
from evaluation.base import (
    InputError,
    ended_by_interrupts,
    errors_at_option,
    shared_options,
    terminal,
    whole_number,
)

GROUP = "Make cities"
# Years before today look like options.
CONTEXT_SETTINGS = {"ignore_unknown_options": True}

Years = Annotated[
    list[int],
    typer.Option(
        "--years",
        metavar="YEAR ...",
        help="Years for which to make stages, as numbers of years from today: "
        "in ascending order, and none above 200. Negative numbers are years in "
        "the past; they need a map whose buildings have years of construction.",
    ),
]

RateFactor = Annotated[
    float,
    typer.Option(
        min=0.0,
        metavar="FACTOR",
        help="Factor by which all yearly rates are multiplied. With 2, the "
        "city changes twice as fast as by default.",
    ),
]
RatesFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.yaml",
        help="File with your own rates. Each line has the form event: rate, "
        "where the rate is the probability per year, from 0 to 1. All other "
        "events have their default rates.",
    ),
]


def _maps_and_years(
    words: list[str], first: list[int]
) -> tuple[list[str], tuple[int, ...]]:
    """Separates the maps from the years in a command such as `a b --years 5 9`.

    The parser takes only the first year after --years as the option's value.
    The parser appends all further years to the arguments, after the names of
    the maps.

    Args:
        words: the arguments of the command: names of maps, then the further
            years.
        first: the values that the parser has already read for --years, one per
            occurrence of the option.

    Returns:
        The names of the maps, and all years.
    """
    maps = []
    years = list(first)
    for word in words:
        if word.removeprefix("-").isdecimal():
            years.append(whole_number(word, "--years"))
        elif word.startswith("-"):
            raise InputError(f"{word}: no such option")
        else:
            maps.append(word)
    return maps, tuple(years)


def age(
    source: Annotated[list[str], typer.Argument(metavar="MAP")],
    output: Annotated[Path, typer.Option()],
    years: Years,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    rate: RateFactor = 1.0,
    rates: RatesFile = None,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures")] = True,
    json: shared_options.Json = False,
) -> None:
    """Simulate years of change in a city.

    Every year, each lot, tree and street object may change, with a given
    probability. Writes pictures, a table of all events, the observed rates, and
    a map with a stage for today and for each given year.

    Args:
        source: Name of a shipped map, or folder of a map.
        output: Folder of the map to write; its name becomes the map's name.
        seed: Seed of all random events. Another seed gives another realisation
            of the city's ageing.
        pictures: Draw pictures of the city from the air and of three streets.

    Example:
        cns-drake age suburbia \\
            --years 1 5 20 --seed 1 --output old_suburbia
    """
    maps, wanted = _maps_and_years(source, years)
    if len(maps) != 1:
        raise InputError(f"give one map, not {' '.join(maps) or 'none'}")
    with ended_by_interrupts("cns-drake"):
        from cns_drake.pictures import draw_aged_city
        from cns_drake.scenarios import age_city
        from worlds.ageing import read_rates
        from worlds.maps import recordable_map

    with errors_at_option("--output", "output"):
        aged = age_city(
            recordable_map(maps[0]),
            wanted,
            seed,
            read_rates(rates, rate),
            output,
            *([draw_aged_city] if pictures else []),
        )
    rows = [
        (f"stage {stage}", f"year {year}" if year else "today")
        for stage, year in aged.years.items()
    ]
    rows += [(event, str(number)) for event, number in aged.events.items()]
    values = {
        "output": str(output),
        "years": dict(aged.years),
        "events": dict(aged.events),
    }
    terminal.show(values, [*rows, ("written", str(output))], json=json)
    suggest_reproduction(output)
