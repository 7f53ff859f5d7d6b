"""The commands `cns-drake train` and `cns-drake export-pairs`."""

from enum import Enum
from pathlib import Path
import shlex
import sys
from typing import Annotated, Literal

import typer

from cns_drake.base import terminal
from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.command_line.options import Jobs, Scheduler
from cns_drake.command_line.simulating import family_members


class Part(str, Enum):
    """What a training can leave out."""

    CHANGE = "change"
    RETURNS = "returns"
    DRIVER = "driver"


def train(
    *,
    output: Annotated[
        Path,
        typer.Option(
            metavar="FILE.npz",
            help="Weights to write; the curve goes to FILE.png, and "
            "FILE.npz.training keeps what an interrupted training goes on "
            "with.",
        ),
    ],
    minutes: Annotated[
        float,
        typer.Option(
            min=0.0,
            help="Sets the number of cities and steps, by about so many "
            "minutes of one core. The clock does not matter.",
        ),
    ] = 60.0,
    cities: Annotated[
        int | None,
        typer.Option(
            min=1, max=1000, help="Number of cities, if not by --minutes."
        ),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Number of steps, if not by --minutes."),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, max=10_000, help="Seed of everything.")
    ] = 1,
    without: Annotated[
        list[Part] | None,
        typer.Option(
            help="Leave out change between drives, calibrated returns, or "
            "drivers who wander; may be repeated.",
        ),
    ] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Train the method learned.

    Cities, their younger stages, effects and drivers are drawn along the
    streets of Riverside, Suburbia and Downtown. Nothing is recorded. The same
    command gives the same weights on the same machine. It needs the extra
    `train` (JAX).
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.studies.training import TrainingPlan, make_weights

    cluster = choose_cluster(jobs, scheduler)
    fields: dict[str, int | bool] = {"seed": seed}
    if cities is not None:
        fields["cities"] = cities
    if steps is not None:
        fields["steps"] = steps
    fields |= {one.value: False for one in without or ()}
    plan = TrainingPlan.of_minutes(minutes, **fields)
    command = shlex.join(["cns-drake", *sys.argv[1:]])
    picture = make_weights(plan, output, command, cluster, terminal.track)
    print(output)
    print(picture)


def export_pairs(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME",
            help="Shipped drives or scenario files; all shipped ones by "
            "default.",
        ),
    ] = None,
    *,
    format: Annotated[
        Literal["pointnetvlad", "overlap"],
        typer.Option(
            help="Clouds and pickles of PointNetVLAD, or scans with exact "
            "overlaps.",
        ),
    ],
    output: Annotated[
        Path, typer.Option(help="Folder of the set; created if need be.")
    ],
    vary: Annotated[
        Path | None,
        typer.Option(
            metavar="FAMILY.yaml", help="Export the members of a family, too."
        ),
    ] = None,
    held_out: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A drive for the evaluation alone; may be repeated.",
        ),
    ] = None,
    spacing: Annotated[
        float,
        typer.Option(
            min=0.1, metavar="METRES", help="Between two clouds of a drive."
        ),
    ] = 10.0,
    scans: Annotated[
        int,
        typer.Option(
            min=1,
            metavar="N",
            help="Merge N consecutive scans into each cloud, a submap.",
        ),
    ] = 1,
    max_range: Annotated[
        float,
        typer.Option(
            min=1.0,
            metavar="METRES",
            help="Leave out points with a greater x, y or z.",
        ),
    ] = 50.0,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Sets of scans for other trainers.

    Drives are simulated without a recording; positives, negatives and overlaps
    are exact. After an interruption the same command goes on.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.scenarios.scenario_files import load_scenario
        from cns_drake.scenarios.shipped import recordable_drives
        from cns_drake.studies.pair_export import (
            ExportOptions,
        )
        from cns_drake.studies.pair_export import (
            export_pairs as export,
        )

    if format == "overlap" and scans > 1:
        raise InputError("--scans: overlaps are those of single scans")
    cluster = choose_cluster(jobs, scheduler)
    tested = [load_scenario(name) for name in held_out or ()]
    if not names and vary is None:
        taken = {one.name for one in tested}
        names = [one for one in recordable_drives() if one not in taken]
    learned = [load_scenario(name) for name in names or ()]
    if vary is not None:
        learned += family_members(vary, output, cluster)
    options = ExportOptions(format, spacing, scans, max_range)
    for path in export(learned, tested, output, options, cluster):
        print(path)
