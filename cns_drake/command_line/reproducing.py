"""The commands `cns-drake reproduce` and `cns-drake fresh`."""

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
    Output,
    Results,
    Scheduler,
    Task,
    TaskName,
)
from evaluation.command_line.options import Costs, Settings, with_named_protocol
from evaluation.recognition.protocol import RetrievalProtocol


@with_named_protocol
def reproduce(
    maps: Maps = None,
    *,
    output: Output,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    pages: Annotated[
        bool | None,
        typer.Option(
            "--pages/--no-pages",
            help="Also make a web page of each drive; the default without "
            "--quick.",
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Only the report: simulate without recording.",
        ),
    ] = False,
    method: MethodFiles = None,
    parameter: Settings = None,
    costs: Costs = True,
    task: TaskName = Task.PLACE,
    protocol: RetrievalProtocol,
) -> None:
    """Simulate a map, evaluate it and report."""
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies.reproduction import (
            reproduce_maps,
            stage_pairs,
        )

    cluster = choose_cluster(jobs, scheduler)
    if quick and pages:
        raise InputError(
            "--quick and --pages exclude each other; give one of them"
        )
    if task is not Task.PLACE:
        if parameter or pages:
            raise InputError(
                f"--task {task.value}: leave out --set and --pages"
            )
        drives = stage_pairs(maps, output)
        spacing = protocol.query_spacing
        typer.echo(run_task(task, drives, output, cluster, spacing, method))
        return
    report = reproduce_maps(
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
    maps: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="MAP", help="Shipped maps; all of them by default."
        ),
    ] = None,
    *,
    output: Results,
    number: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N",
            help="A version, from 1 to 5; may be repeated. All by default.",
        ),
    ] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    method: MethodFiles = None,
    protocol: RetrievalProtocol,
) -> None:
    """Evaluate cities that no method has seen.

    Each map has five versions: the same streets and stages between other
    buildings, with real drivers; two are turned, so that their streets lie off
    the axes. Their seeds were drawn before any method ran on them. Nothing is
    recorded. After an interruption the same command goes on where it was.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies.fresh_cities import evaluate_fresh_cities

    report = evaluate_fresh_cities(
        maps or (),
        number or (),
        output,
        choose_cluster(jobs, scheduler),
        protocol=protocol,
        own_methods=method or (),
        on_note=note,
    )
    typer.echo(report)
