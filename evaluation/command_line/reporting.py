"""The commands `cns-eval report` and `cns-eval trend`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import terminal
from evaluation.command_line.options import (
    Costs,
    Jobs,
    LidarName,
    OwnMethods,
    Scheduler,
    Settings,
    with_protocol,
)
from evaluation.recognition.protocol import RetrievalProtocol


@with_protocol
def report(
    recordings: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option(help="Folder to write.")],
    method: OwnMethods = None,
    parameter: Settings = None,
    lidar: LidarName = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    costs: Costs = True,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """Report on all recordings in a folder.

    Writes tables, figures and report.html. After an interruption the same
    command goes on where it was.
    """
    from cns_drake.base.jobs.cluster import choose_cluster
    from evaluation.paper import reference_for
    from evaluation.study import benchmark as reporting

    cluster = choose_cluster(jobs, scheduler)
    path = reporting.write_report(
        recordings,
        output,
        cluster,
        method or (),
        protocol,
        on_note=terminal.note,
        settings=parameter or (),
        with_costs=costs,
        reference_for=reference_for,
        lidar=lidar,
    )
    print(path)


@with_protocol
def trend(
    databases: Annotated[list[Path], typer.Argument(metavar="DATABASE")],
    query: Annotated[Path, typer.Option(help="The query drive.")],
    output: Annotated[Path, typer.Option(help="Folder to write.")],
    control: Annotated[
        list[Path] | None,
        typer.Option(
            help="A drive on the route of databases through the stage of the "
            "query, to plot the kept share of AUC as well; may be "
            "repeated."
        ),
    ] = None,
    method: OwnMethods = None,
    lidar: LidarName = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    parameter: Settings = None,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """AUC over TCR_sym, of many databases.

    One drive queries them all, by every method. Writes trend.csv and a figure
    with 95 % bands. After an interruption the same command goes on where it
    was.
    """
    from cns_drake.base.jobs.cluster import choose_cluster
    from evaluation.study.trend import write_trend
    from evaluation.study.trend_databases import measure_trend

    cluster = choose_cluster(jobs, scheduler)
    points = measure_trend(
        query,
        databases,
        output,
        cluster,
        method or (),
        protocol,
        control or (),
        lidar,
        parameter or (),
    )
    print(write_trend(points, output))
