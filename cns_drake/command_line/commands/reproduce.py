"""The command `reproduce`, which measures the drives of whole maps."""

from typing import Annotated

import typer

from cns_drake.command_line import options
from evaluation.base import (
    InputError,
    ended_by_interrupts,
    note,
    shared_options,
    terminal,
)
from evaluation.recognition import RetrievalProtocol, with_protocols

GROUP = "Study what change costs"


@with_protocols("random-yaw", "paper")
def reproduce(
    maps: options.Maps = None,
    *,
    output: options.Results,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    pages: Annotated[bool | None, typer.Option("--pages/--no-pages")] = None,
    recordings: Annotated[
        bool, typer.Option("--recordings/--no-recordings")
    ] = True,
    method: shared_options.Methods = None,
    parameter: shared_options.MethodSettings = None,
    costs: shared_options.Costs = True,
    width: shared_options.Width = None,
    font: shared_options.Font = None,
    title: shared_options.Title = True,
    protocols: dict[str, RetrievalProtocol],
) -> None:
    """Simulate the drives of maps, and measure what they changed.

    Records all drives of the maps, and measures place recognition and
    structural change between these drives, as the experiment stages does. By
    default the results are by two protocols: by random-yaw, and by paper to
    compare them with the paper.

    Args:
        pages: Whether to write a web page of each drive as well. By default
            yes, except with --no-recordings.
        recordings: Whether to record the drives. With --no-recordings, the
            drives are simulated but not recorded. This saves time and disk
            space, and does not change the results.

    Example:
        cns-drake reproduce metropolis --output study
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.studies import reproduce_maps
        from evaluation.base import choose_cluster
        from evaluation.command_line import show_results
        from evaluation.results import PrintStyle

    printed = PrintStyle.checked(width, font, title)
    cluster = choose_cluster(jobs, scheduler)
    if pages and not recordings:
        raise InputError(
            "--no-recordings and --pages exclude each other; give one of them"
        )
    with terminal.resumable():
        report = reproduce_maps(
            maps,
            output,
            cluster,
            protocols,
            with_pages=pages is not False,
            with_recordings=recordings,
            methods=method or (),
            settings=parameter or (),
            with_costs=costs,
            printed=printed,
            on_note=note,
        )
    show_results(report)
