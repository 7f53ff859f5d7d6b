"""The commands `cns-drake age` and `years`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.process import uncollected
from cns_drake.base.terminal import note, print_rows
from cns_drake.command_line.options import Jobs, MethodFiles, Results, Scheduler

FirstYear = Annotated[
    list[int],
    typer.Option(
        "--years",
        metavar="YEAR ...",
        help="Years from today, ascending, at most 200; before today where "
        "buildings have years.",
    ),
]

RateFactor = Annotated[
    float,
    typer.Option(
        min=0.0, metavar="FACTOR", help="Factor for all yearly rates."
    ),
]
RatesFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.yaml",
        help="Rates of your own: event: rate a year, from 0 to 1; the others "
        "keep theirs.",
    ),
]


def maps_and_years(
    words: list[str], first: list[int]
) -> tuple[list[str], tuple[int, ...]]:
    """Returns maps and years.

    Years that follow the first come as arguments.

    Raises:
        InputError: a word begins like an option.
    """
    maps, years = [], list(first)
    for word in words:
        if word.removeprefix("-").isdecimal():
            years.append(int(word))
        elif word.startswith("-"):
            raise InputError(f"{word}: no such option")
        else:
            maps.append(word)
    return maps, tuple(years)


def age(
    source: Annotated[
        list[str],
        typer.Argument(
            metavar="MAP", help="A shipped map by name, or a map's folder."
        ),
    ],
    output: Annotated[
        Path, typer.Option(help="Map folder to write; its name is the map's.")
    ],
    years: FirstYear,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of everything that happens.")
    ] = 0,
    rate: RateFactor = 1.0,
    rates: RatesFile = None,
    pictures: Annotated[
        bool,
        typer.Option(
            "--pictures/--no-pictures",
            help="Draw the city from the air and from three streets.",
        ),
    ] = True,
) -> None:
    """Let a city live for some years.

    Every year each lot, tree and thing meets its rate: buildings are built,
    torn down and replaced, trees die, lamps and signs move. Writes a map with
    a stage for today and for each year, its history, the rates that came about,
    and pictures.
    """
    maps, wanted = maps_and_years(source, years)
    if len(maps) != 1:
        raise InputError(f"give one map, not {' '.join(maps) or 'none'}")
    with uninterrupted():
        from cns_drake.ageing.aged_map import age_map
        from cns_drake.ageing.aged_pictures import draw_pictures
        from cns_drake.ageing.rates import read_rates
        from cns_drake.scenarios.shipped import shipped_maps

    folder = shipped_maps().get(maps[0], Path(maps[0]))
    if not folder.is_dir():
        raise InputError(
            f"{maps[0]}: neither a shipped map ({', '.join(shipped_maps())}) "
            "nor a folder"
        )
    with uncollected():
        aged = age_map(
            folder,
            wanted,
            seed,
            read_rates(rates, rate),
            output,
            note,
            finish=lambda draft, one: (
                draw_pictures(draft, one, note) if pictures else None
            ),
        )
    rows = [
        (f"stage {stage}", f"year {year}" if year else "today")
        for stage, year in aged.years.items()
    ]
    rows += [(event, str(number)) for event, number in aged.events.items()]
    print_rows([*rows, ("written", str(output))])


def years(
    maps: Annotated[
        list[str],
        typer.Argument(metavar="MAP", help="Maps, by name or folder."),
    ],
    output: Results,
    years: Annotated[
        list[int] | None,
        typer.Option(
            metavar="YEAR ...",
            help="Years between database and query, ascending; 1 2 5 10 20 40 "
            "by default, 5 20 40 with --quick.",
        ),
    ] = None,
    seeds: Annotated[
        int,
        typer.Option(
            min=1, metavar="N", help="Number of histories of each city."
        ),
    ] = 1,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Fewer years, queries and places, and only old databases.",
        ),
    ] = False,
    rate: RateFactor = 1.0,
    rates: RatesFile = None,
    localise: Annotated[
        bool,
        typer.Option(
            "--localise",
            help="Also localise the queries in the maps of the databases.",
        ),
    ] = False,
    map_update: Annotated[
        bool,
        typer.Option(
            "--map-update",
            help="Also score what finds the changes of the maps.",
        ),
    ] = False,
    method: MethodFiles = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """How old a map may be for each method.

    A drive queries a database of its own route that is some years older, and
    an older drive one of today. No drive is recorded. Writes years.csv,
    lifetimes.csv and a chart. After an interruption the same command goes on.
    """
    named, wanted = maps_and_years(maps, years or [])
    with uninterrupted():
        from cns_drake.ageing.rates import read_rates
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies import years as study
        from evaluation.report.years import BACKWARD, FORWARD
        from evaluation.study.chosen_methods import choose_methods

    path, text = study.measure_years(
        named,
        wanted or (study.QUICK_YEARS if quick else study.YEARS),
        range(1, seeds + 1),
        read_rates(rates, rate),
        output,
        choose_cluster(jobs, scheduler),
        choose_methods(method or ()),
        study.QUICK_PROTOCOL if quick else study.YEARS_PROTOCOL,
        (FORWARD,) if quick else (FORWARD, BACKWARD),
        localises=localise,
        updates=map_update,
        on_note=note,
    )
    typer.echo(path)
    typer.echo(text)
