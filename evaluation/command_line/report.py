"""The command `report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import shared_options, terminal
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.protocol_options import with_protocol


@with_protocol
def report(
    recordings: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option()],
    method: shared_options.Methods = None,
    parameter: shared_options.MethodSettings = None,
    lidar: shared_options.LidarName = None,
    columns: shared_options.Columns = None,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    costs: shared_options.Costs = True,
    tables: shared_options.Tables = False,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """Evaluate all recordings in a folder and write a report.

    The command measures place recognition and structural change between the
    drives of each map. It writes report.html, figures, and the tables
    results.csv and queries.csv, which have the same columns as the tables of
    cns-drake study. To resume after an interruption, run the same command
    again.

    Args:
        recordings: Folder that contains the recordings.
        output: Folder for the report; created if it does not exist.
    """
    from cns_drake.base.jobs.cluster import choose_cluster
    from evaluation.command_line.suggestions import (
        name_tables,
        suggest_comparison,
    )
    from evaluation.paper import reference_for
    from evaluation.study.report_jobs import stages_report

    cluster = choose_cluster(jobs, scheduler)
    path = stages_report.report_on_recordings(
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
        columns=columns,
        with_tables=tables,
    )
    print(path)
    name_tables(path.parent)
    suggest_comparison(path.parent)
