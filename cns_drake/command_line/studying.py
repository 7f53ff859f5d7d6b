"""The commands that run studies: what change costs each method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base.drives.drive import PlacedDrive, check_same_map
from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.terminal import note
from cns_drake.command_line import options
from cns_drake.command_line.maps import RateFactor, RatesFile, maps_and_years
from cns_drake.command_line.simulating import family_members
from evaluation.command_line.options import Costs, Settings, with_named_protocol
from evaluation.recognition.protocol import RetrievalProtocol

if TYPE_CHECKING:
    from cns_drake.base.jobs.cluster import Cluster
    from cns_drake.scenarios.scenario import Scenario
    from evaluation.study.localisation import ComparedPair


def _run_task(
    task: options.Task,
    pairs: Sequence[ComparedPair],
    output: Path,
    cluster: Cluster,
    spacing: float,
    own_methods: Sequence[Path] | None,
) -> Path:
    """Runs a task other than `PLACE` on pairs of drives; returns its table."""
    if task is options.Task.LOCALISE:
        from evaluation.study.localisation import SHIPPED, localise_pairs

        methods = (*SHIPPED, *map(str, own_methods or ()))
        return localise_pairs(pairs, output, cluster, methods, spacing)
    if own_methods:
        raise InputError(
            "--task map: leave out --method (docs/map_update.md says how to "
            "score labels of one's own)"
        )
    from cns_drake.studies.map_pairs import update_pairs

    return update_pairs(pairs, output, cluster, note)


@with_named_protocol
def reproduce(
    maps: options.Maps = None,
    *,
    output: options.Output,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    pages: Annotated[bool | None, typer.Option("--pages/--no-pages")] = None,
    quick: Annotated[bool, typer.Option("--quick")] = False,
    method: options.MethodFiles = None,
    parameter: Settings = None,
    costs: Costs = True,
    task: options.TaskName = options.Task.PLACE,
    protocol: RetrievalProtocol,
) -> None:
    """Simulate a map, evaluate it and report.

    Args:
        pages: Also make a web page of each drive; the default without --quick.
        quick: Only the report: simulate without recording.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies import reproduction

    cluster = choose_cluster(jobs, scheduler)
    if quick and pages:
        raise InputError(
            "--quick and --pages exclude each other; give one of them"
        )
    if task is not options.Task.PLACE:
        if parameter or pages:
            raise InputError(
                f"--task {task.value}: leave out --set and --pages"
            )
        drives = reproduction.stage_pairs(maps, output)
        spacing = protocol.query_spacing
        typer.echo(_run_task(task, drives, output, cluster, spacing, method))
        return
    report = reproduction.reproduce_maps(
        maps,
        output,
        cluster,
        with_pages=pages is not False,
        quick=quick,
        protocol=protocol,
        own_methods=method or (),
        settings=parameter or (),
        with_costs=costs,
        on_note=note,
    )
    typer.echo(report)


@with_named_protocol
def fresh(
    maps: Annotated[list[str] | None, typer.Argument(metavar="MAP")] = None,
    *,
    output: options.Results,
    number: Annotated[list[int] | None, typer.Option(metavar="N")] = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    method: options.MethodFiles = None,
    protocol: RetrievalProtocol,
) -> None:
    """Evaluate cities that no method has seen.

    Each map has five versions: the same streets and stages between other
    buildings, with real drivers; two are turned, so that their streets lie off
    the axes. Their seeds were drawn before any method ran on them. Nothing is
    recorded. After an interruption the same command goes on where it was.

    Args:
        maps: Shipped maps; all of them by default.
        number: A version, from 1 to 5; may be repeated. All by default.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies.redrawing import draw_fresh_cities
        from cns_drake.studies.reproduction import reproduce_maps
        from evaluation.study.chosen_methods import choose_methods

    cluster = choose_cluster(jobs, scheduler)
    choose_methods(method or ())  # Before cities are drawn.
    cities = draw_fresh_cities(
        maps or (), number or (), output / "cities", cluster
    )
    report = reproduce_maps(
        [str(folder) for folder in cities],
        output,
        cluster,
        quick=True,
        protocol=protocol,
        own_methods=method or (),
        on_note=note,
    )
    typer.echo(report)


def ladder(
    maps: options.Maps = None,
    *,
    output: options.Results,
    quick: Annotated[bool, typer.Option("--quick")] = False,
    levels: Annotated[bool, typer.Option("--levels")] = False,
    cause: list[str] | None = None,
    viewpoint: Annotated[
        str, typer.Option(metavar="near|lane|reversed")
    ] = "near",
    pairs: Annotated[bool, typer.Option("--pairs")] = False,
    seeds: Annotated[int, typer.Option(min=1, metavar="N")] = 1,
    task: options.TaskName = options.Task.PLACE,
    method: options.MethodFiles = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
) -> None:
    """What each change costs each method.

    One drive queries a database of its own route, with one cause of change
    between the two at a time, and with all together. No drive is recorded.
    Writes ladder.csv, queries.csv and a figure. After an interruption the same
    command goes on where it was.

    Args:
        quick: Only the strongest level of each cause, and every other query.
        levels: Only the frozen levels, with all causes together.
        cause: A cause of change, such as traffic or all; may be repeated. Every
            one by default.
        viewpoint: Where the database is driven on all rungs: 0.5 m beside the
            queries, 5 m, or 5 m and facing backwards.
        pairs: Also cross the six causes that cost most two by two.
        seeds: Repeat all random draws N times, and give means.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies import ladder_rungs
        from cns_drake.studies.ladder import (
            QUICK_EXTENT,
            QUICK_PROTOCOL,
            climb_ladder,
            rung_pairs,
        )
        from cns_drake.studies.levels import LEVELS_EXTENT, LEVELS_PROTOCOL
        from evaluation.recognition.protocol import DEFAULT_PROTOCOL
        from evaluation.study.chosen_methods import choose_methods

    if viewpoint not in ladder_rungs.VIEWPOINTS:
        known = ", ".join(ladder_rungs.VIEWPOINTS)
        raise InputError(
            f"--viewpoint: no viewpoint {viewpoint!r} (there are: {known})"
        )
    is_own = (
        quick or cause or seeds > 1 or pairs or viewpoint != ladder_rungs.NEAR
    )
    if levels and is_own:
        raise InputError(
            "--levels: the levels are frozen; leave out --quick, --cause, "
            "--seeds, --pairs and --viewpoint"
        )
    if task is not options.Task.PLACE and (levels or pairs):
        raise InputError(f"--task {task.value}: leave out --levels and --pairs")
    cluster = choose_cluster(jobs, scheduler)
    causes = tuple(cause or ladder_rungs.CAUSES)
    for name in causes:
        if name not in (*ladder_rungs.CAUSES, *ladder_rungs.EXTRAS):
            known = ", ".join((*ladder_rungs.CAUSES, *ladder_rungs.EXTRAS))
            raise InputError(f"--cause: no cause {name!r} (there are: {known})")
    extent, protocol = ladder_rungs.Extent(), DEFAULT_PROTOCOL
    if quick:
        extent, protocol = QUICK_EXTENT, QUICK_PROTOCOL
        note(
            "--quick leaves out: levels 1 to 3 (but where a cause has no level "
            "4), every other query, more than 300 places of other cities"
        )
    extent = replace(
        extent, causes=causes, seeds=range(1, seeds + 1), viewpoint=viewpoint
    )
    if levels:
        extent, protocol = LEVELS_EXTENT, LEVELS_PROTOCOL
    if task is not options.Task.PLACE:
        rungs = rung_pairs(maps, extent, note)
        spacing = protocol.query_spacing
        typer.echo(_run_task(task, rungs, output, cluster, spacing, method))
        return
    path, text = climb_ladder(
        maps,
        output,
        cluster,
        choose_methods(method or ()),
        extent,
        protocol,
        with_pairs=pairs,
        on_note=note,
    )
    typer.echo(path)
    typer.echo(text)


def levels(
    results: Annotated[list[Path], typer.Argument(metavar="RESULTS.csv")],
) -> None:
    """Check results on the frozen levels.

    Prints one table of all of them in Markdown.

    Args:
        results: Tables written by ladder --levels.
    """
    with uninterrupted():
        from cns_drake.studies.levels import (
            frozen_levels,
            level_table,
            read_results,
        )

    table = level_table(read_results(results, frozen_levels()))
    typer.echo(table.to_markdown())


def size(
    map_name: Annotated[str, typer.Argument(metavar="MAP")],
    *,
    output: options.Results,
    places: Annotated[list[int] | None, typer.Option(metavar="N")] = None,
    method: options.MethodFiles = None,
    only: Annotated[list[str] | None, typer.Option(metavar="NAME")] = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
) -> None:
    """AUC and time among many places.

    The database has the query's own route and more and more places of other
    cities: the other shipped ones, twin blocks, redrawn ones. A method that
    would take over an hour for all queries has its time only. Writes size.csv.
    After an interruption the same command goes on where it was.

    Args:
        map_name: The map that is asked about.
        places: Number of places of other cities, up to 100000; may be repeated.
            By default 0, 1000, 10000 and 100000.
        only: Measure only the method of this name; may be repeated.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies.size import measure_sizes
        from evaluation.study.chosen_methods import choose_methods

    path = measure_sizes(
        map_name,
        places or (0, 1000, 10_000, 100_000),
        output,
        choose_cluster(jobs, scheduler),
        choose_methods(method or (), only=only or ()),
        on_note=note,
    )
    typer.echo(path)


def years(
    maps: Annotated[list[str], typer.Argument(metavar="MAP")],
    output: options.Results,
    years: Annotated[list[int] | None, typer.Option(metavar="YEAR ...")] = None,
    seeds: Annotated[int, typer.Option(min=1, metavar="N")] = 1,
    quick: Annotated[bool, typer.Option("--quick")] = False,
    rate: RateFactor = 1.0,
    rates: RatesFile = None,
    localise: Annotated[bool, typer.Option("--localise")] = False,
    map_update: Annotated[bool, typer.Option("--map-update")] = False,
    method: options.MethodFiles = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
) -> None:
    """How old a map may be for each method.

    A drive queries a database of its own route that is some years older, and
    an older drive one of today. No drive is recorded. Writes years.csv,
    lifetimes.csv and a chart. After an interruption the same command goes on.

    Args:
        maps: Maps, by name or folder.
        years: Years between database and query, ascending; 1 2 5 10 20 40 by
            default, 5 20 40 with --quick.
        seeds: Number of histories of each city.
        quick: Fewer years, queries and places, and only old databases.
        localise: Also localise the queries in the maps of the databases.
        map_update: Also score what finds the changes of the maps.
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


@with_named_protocol
def trend(
    *,
    vary: Annotated[Path, typer.Option(metavar="FAMILY.yaml")],
    query: Annotated[str, typer.Option(metavar="NAME|SCENARIO.yaml")],
    output: options.Results,
    method: options.MethodFiles = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    parameter: Settings = None,
    protocol: RetrievalProtocol,
) -> None:
    """AUC over TCR_sym, of a family of drives.

    No drive is recorded. Writes trend.csv and a figure with 95 % bands: AUC,
    and the share of it that is kept against the same route without change.
    After an interruption the same command goes on where it was.

    Args:
        vary: The members of this family are the databases.
        query: The query drive: a shipped drive or a scenario file.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.scenarios.scenario_files import load_scenario
        from cns_drake.simulation.simulated_drive import DriveSimulation
        from evaluation.study import trend_databases
        from evaluation.study.chosen_methods import choose_methods
        from evaluation.study.trend import write_trend

    cluster = choose_cluster(jobs, scheduler)
    methods = choose_methods(method or (), parameter or ())
    query_drive = load_scenario(query)
    members = family_members(vary, output, cluster)
    for member in members:
        check_same_map(*map(_placed, (member, query_drive)))
    controls = family_controls(members, query_drive)
    points = trend_databases.measure_drives(
        query_drive.name,
        DriveSimulation(query_drive),
        {
            one.name: DriveSimulation(one)
            for one in (*members, *controls.values())
        },
        {member: control.name for member, control in controls.items()},
        output,
        cluster,
        methods,
        protocol,
    )
    print(write_trend(points, output))


def _placed(scenario: Scenario) -> PlacedDrive:
    city = None if scenario.map is None else {"map": scenario.map}
    return PlacedDrive(scenario.name, "map", city)


def family_controls(
    members: Sequence[Scenario], query_drive: Scenario
) -> dict[str, Scenario]:
    """Returns member -> its drive through the city of the query drive.

    Members that differ only by their city share one.
    """
    city = {
        name: getattr(query_drive, name)
        for name in ("map", "stage", "world", "without")
    }
    kinds: list[dict] = []
    controls = {}
    for member in members:
        drive = member.model_copy(update={**city, "name": "", "title": ""})
        kind = drive.model_dump()
        if kind not in kinds:
            kinds.append(kind)
        name = f"{query_drive.name}_unchanged_{kinds.index(kind) + 1}"
        controls[member.name] = drive.replaced(name=name)
    return controls
