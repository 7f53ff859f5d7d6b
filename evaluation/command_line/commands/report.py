"""The command `report`."""

from pathlib import Path
from typing import Annotated

import typer

from evaluation.base import shared_options, terminal
from evaluation.command_line import options
from evaluation.recognition import RetrievalProtocol, with_protocols

GROUP = "Recognise places"


@with_protocols("random-yaw")
def report(
    recordings: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option()],
    method: shared_options.Methods = None,
    parameter: shared_options.MethodSettings = None,
    align: options.Align = "auto",
    lidar: shared_options.LidarName = None,
    columns: shared_options.Columns = None,
    odometry: shared_options.OdometryTopic = None,
    pose_gap: shared_options.PoseGap = None,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    costs: shared_options.Costs = True,
    width: shared_options.Width = None,
    font: shared_options.Font = None,
    title: shared_options.Title = True,
    *,
    protocols: dict[str, RetrievalProtocol],
) -> None:
    """Evaluate all recordings in a folder.

    The command measures place recognition and structural change between the
    drives of each map, as the experiment stages of cns-drake study. It writes
    the page index.html, the tables results.csv and queries.csv, and pictures.
    To resume after an interruption, run the same command again.

    Args:
        recordings: Folder that contains the recordings.
        output: Folder for the results.

    Example:
        cns-eval report drives --output report
    """
    from evaluation.base import choose_cluster
    from evaluation.command_line.suggestions import show_results
    from evaluation.results import PrintStyle
    from evaluation.verbs import report as report_of

    page = report_of(
        recordings,
        output,
        method or (),
        settings=parameter or (),
        protocols=protocols,
        align=align,
        lidar=lidar,
        columns=columns,
        odometry=odometry,
        pose_gap=pose_gap,
        printed=PrintStyle.checked(width, font, title),
        cluster=choose_cluster(jobs, scheduler),
        with_costs=costs,
        on_note=terminal.note,
    )
    show_results(page)
