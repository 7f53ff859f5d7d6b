"""The command `generate`, which records many drives."""

from typing import Annotated, Any

import typer

from cns_drake.command_line import options
from cns_drake.command_line.fields import changed, field_options
from evaluation.base import ended_by_interrupts, shared_options, terminal

GROUP = "Drive through them"

DriveNames = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="NAME",
        help="Names of shipped drives, or scenario files. If you name none, "
        "the drives of the experiment that --vary names are recorded, or all "
        "shipped drives if --vary is not given.",
    ),
]


@field_options("frames")
def generate(
    names: DriveNames = None,
    *,
    output: options.Output,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    overwrite: options.Overwrite = False,
    vary: options.Vary = None,
    changes: dict[str, Any],
) -> None:
    """Record many drives.

    Simulates and records the named drives, as many at the same time as --jobs
    says. To resume after an interruption, run the same command again: finished
    recordings are skipped.

    Example:
        cns-drake generate metropolis_01 metropolis_04 \\
            --output drives --jobs 2
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.studies import named_drives, record_all
        from evaluation.base import choose_cluster

    cluster = choose_cluster(jobs, scheduler)
    drives = named_drives(names or (), vary, output, cluster)
    scenarios = [changed(drive, changes) for drive in drives]
    for path in record_all(scenarios, output, cluster, overwrite=overwrite):
        typer.echo(path)
    terminal.next_command("cns-eval", "report", output, "--output", "report")
