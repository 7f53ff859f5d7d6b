"""The command `train`, which trains a method in simulated cities."""

from enum import Enum
from pathlib import Path
import shlex
import sys
from typing import Annotated, Any

import typer

from cns_drake.command_line.fields import LIDAR_HELP
from evaluation.base import (
    ended_by_interrupts,
    errors_at_option,
    shared_options,
    terminal,
)

GROUP = "Study what change costs"


class Variation(str, Enum):
    """Kinds of variation that can be left out of a training."""

    CHANGE = "change"
    RETURNS = "returns"
    DRIVER = "driver"


def train(
    *,
    output: Annotated[Path, typer.Option(metavar="FILE.npz")],
    minutes: Annotated[float, typer.Option(min=0.0, max=10_000.0)] = 60.0,
    cities: Annotated[int | None, typer.Option(min=1, max=1000)] = None,
    steps: Annotated[int | None, typer.Option(min=1)] = None,
    seed: Annotated[int, typer.Option(min=0, max=10_000)] = 1,
    without: Annotated[
        list[Variation] | None, typer.Option(metavar="|".join(Variation))
    ] = None,
    drawn_streets: Annotated[bool, typer.Option("--drawn-streets")] = False,
    graded: Annotated[bool, typer.Option("--graded")] = False,
    lidar: Annotated[
        list[str] | None,
        typer.Option(metavar="PRESET|FILE.yaml", help=LIDAR_HELP),
    ] = None,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
) -> None:
    """Train the place-recognition method `learned`.

    The training simulates drives through random cities along the streets of
    Riverside, Suburbia and Downtown, which differ in stage and driver. A third
    of the drives have one of five presets with 16 to 128 rings, the others the
    LiDAR of the map, or all of them those of --lidar, which may be repeated. On
    one machine, the same command always gives the same weights. Needs the extra
    `train` (JAX).

    Args:
        output: File for the weights. The training curve is written to FILE.png,
            and the state of the training, from which the same command resumes,
            to FILE.npz.training.
        minutes: Approximate computing time on one core in minutes, from which
            the numbers of cities and steps follow. The training ends after
            these steps, however long they take.
        cities: Number of cities to train on; by default the number follows from
            --minutes.
        steps: Number of training steps; by default the number follows from
            --minutes.
        seed: Seed of all random choices. Another seed gives other cities and
            other weights.
        without: Kind of variation to leave out, in order to measure what it
            contributes. change: of the city between drives. returns: weather,
            losses and errors. driver: wandering and lane changes. May be
            repeated.
        drawn_streets: Generate cities along random streets, so that the shipped
            maps can serve as a test.
        graded: Train with exact overlaps, so that a place ranks higher if it
            shows more of the query's scan; takes about 1.5 times as long.
            Without it, all places within 7.5 m of a query are equally good.

    Example:
        cns-drake train --output mine.npz --minutes 10
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.sensors import make_lidar_config
        from cns_drake.training import TrainingPlan, make_weights
        from evaluation.base import choose_cluster

    cluster = choose_cluster(jobs, scheduler)
    # A preset by its name, a data sheet by its content.
    lidars = []
    for unit in lidar or ():
        with errors_at_option("--lidar", "unit"):
            config = make_lidar_config(unit)
        lidars.append(config.preset or config.sheet.to_fields())
    fields: dict[str, Any] = {"seed": seed, "lidars": tuple(lidars)}
    if cities is not None:
        fields["cities"] = cities
    if steps is not None:
        fields["steps"] = steps
    fields |= {part.value: False for part in without or ()}
    fields |= {"drawn_streets": drawn_streets, "graded": graded}
    plan = TrainingPlan.of_minutes(minutes, **fields)
    command = shlex.join(["cns-drake", *sys.argv[1:]])
    picture = make_weights(plan, output, command, cluster)
    print(output)
    print(picture)
    words = ("--output", f"{output.with_suffix('')}_report", "--no-recordings")
    setting = ("--set", f"learned.weights={output}")
    terminal.next_command(
        "cns-drake", "reproduce", "metropolis", *words, *setting
    )
