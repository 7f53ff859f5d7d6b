"""The command `cns-drake reproduce`."""

from typing import Annotated

import typer

from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.terminal import note
from cns_drake.command_line.options import (
    Jobs,
    Maps,
    MethodFiles,
    Output,
    Scheduler,
)
from evaluation.command_line.options import Costs, Settings, with_protocol
from evaluation.recognition.protocol import RetrievalProtocol


@with_protocol
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
    protocol: RetrievalProtocol,
) -> None:
    """Simulate a map, evaluate it and report."""
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies.reproduction import reproduce_maps

    cluster = choose_cluster(jobs, scheduler)
    if quick and pages:
        raise InputError(
            "--quick and --pages exclude each other; give one of them"
        )
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
