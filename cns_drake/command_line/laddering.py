"""The commands `cns-drake ladder`, `levels` and `size`."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.terminal import note
from cns_drake.command_line.map_truthing import run_task
from cns_drake.command_line.options import (
    Jobs,
    Maps,
    MethodFiles,
    Results,
    Scheduler,
    Task,
    TaskName,
)


def ladder(
    maps: Maps = None,
    *,
    output: Results,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Only the strongest level of each cause, and every other "
            "query.",
        ),
    ] = False,
    levels: Annotated[
        bool,
        typer.Option(
            "--levels",
            help="Only the frozen levels, with all causes together.",
        ),
    ] = False,
    cause: Annotated[
        list[str] | None,
        typer.Option(
            help="A cause of change, such as traffic or all; may be repeated. "
            "Every one by default.",
        ),
    ] = None,
    viewpoint: Annotated[
        str,
        typer.Option(
            metavar="near|lane|reversed",
            help="Where the database is driven on all rungs: 0.5 m beside the "
            "queries, 5 m, or 5 m and facing backwards.",
        ),
    ] = "near",
    pairs: Annotated[
        bool,
        typer.Option(
            "--pairs",
            help="Also cross the six causes that cost most two by two.",
        ),
    ] = False,
    seeds: Annotated[
        int,
        typer.Option(
            min=1,
            metavar="N",
            help="Repeat all random draws N times, and give means.",
        ),
    ] = 1,
    task: TaskName = Task.PLACE,
    method: MethodFiles = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """What each change costs each method.

    One drive queries a database of its own route, with one cause of change
    between the two at a time, and with all together. No drive is recorded.
    Writes ladder.csv, queries.csv and a figure. After an interruption the same
    command goes on where it was.
    """
    with uninterrupted():
        from dataclasses import replace

        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies.ladder import (
            QUICK_EXTENT,
            QUICK_PROTOCOL,
            climb_ladder,
            rung_pairs,
        )
        from cns_drake.studies.ladder_rungs import (
            CAUSES,
            EXTRAS,
            NEAR,
            VIEWPOINTS,
            Extent,
        )
        from cns_drake.studies.levels import LEVELS_EXTENT, LEVELS_PROTOCOL
        from evaluation.recognition.protocol import DEFAULT_PROTOCOL
        from evaluation.study.chosen_methods import choose_methods

    if viewpoint not in VIEWPOINTS:
        known = ", ".join(VIEWPOINTS)
        raise InputError(
            f"--viewpoint: no viewpoint {viewpoint!r} (there are: {known})"
        )
    is_own = quick or cause or seeds > 1 or pairs or viewpoint != NEAR
    if levels and is_own:
        raise InputError(
            "--levels: the levels are frozen; leave out --quick, --cause, "
            "--seeds, --pairs and --viewpoint"
        )
    if task is not Task.PLACE and (levels or pairs):
        raise InputError(f"--task {task.value}: leave out --levels and --pairs")
    cluster = choose_cluster(jobs, scheduler)
    causes = tuple(cause or CAUSES)
    for name in causes:
        if name not in (*CAUSES, *EXTRAS):
            known = ", ".join((*CAUSES, *EXTRAS))
            raise InputError(f"--cause: no cause {name!r} (there are: {known})")
    extent, protocol = Extent(), DEFAULT_PROTOCOL
    if quick:
        extent, protocol = QUICK_EXTENT, QUICK_PROTOCOL
        note(
            "--quick leaves out: levels 1 to 3 (but where a cause has no level "
            "4), every other query, more than 300 places of other cities"
        )
    extent = replace(
        extent,
        causes=causes,
        seeds=range(1, seeds + 1),
        viewpoint=viewpoint,
    )
    if levels:
        extent, protocol = LEVELS_EXTENT, LEVELS_PROTOCOL
    if task is not Task.PLACE:
        rungs = rung_pairs(maps, extent, note)
        spacing = protocol.query_spacing
        typer.echo(run_task(task, rungs, output, cluster, spacing, method))
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
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULTS.csv", help="Tables written by ladder --levels."
        ),
    ],
) -> None:
    """Check results on the frozen levels.

    Prints one table of all of them in Markdown.
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
    map_name: Annotated[
        str,
        typer.Argument(metavar="MAP", help="The map that is asked about."),
    ],
    *,
    output: Results,
    places: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N",
            help="Number of places of other cities, up to 100000; may be "
            "repeated. By default 0, 1000, 10000 and 100000.",
        ),
    ] = None,
    method: MethodFiles = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """AUC and time among many places.

    The database has the query's own route and more and more places of other
    cities: the other shipped ones, twin blocks, redrawn ones. A method that
    would take over an hour for all queries has its time only. Writes size.csv.
    After an interruption the same command goes on where it was.
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
        choose_methods(method or ()),
        on_note=note,
    )
    typer.echo(path)
