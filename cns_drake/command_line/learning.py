"""Commands that use the simulator's exact truth: for training, and for change.

`train` trains a method, `export-pairs` writes training data for other programs,
and `map-truth` labels what changed between two drives.
"""

from enum import Enum
from pathlib import Path
import shlex
import sys
from typing import Annotated, Literal

import typer

from cns_drake.base import terminal
from cns_drake.base.commands import Jobs, Scheduler, SessionSpacing
from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.command_line.simulating import DriveNames, family_members
from evaluation.recognition.protocol import RetrievalProtocol

_Recorded = Annotated[
    str, typer.Argument(metavar="RECORDING|NAME|SCENARIO.yaml")
]


class Part(str, Enum):
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
    without: list[Part] | None = None,
    drawn_streets: Annotated[bool, typer.Option("--drawn-streets")] = False,
    graded: Annotated[bool, typer.Option("--graded")] = False,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Train the place-recognition method `learned`.

    The training simulates drives through cities that are generated at random
    along the streets of Riverside, Suburbia and Downtown. The drives differ in
    the stage of the city and in the driver, and are not recorded. On one
    machine, the same command always gives the same weights. Needs the optional
    packages of the extra `train` (JAX).

    Args:
        output: File for the weights. The training curve goes to FILE.png.
            FILE.npz.training keeps the state, so that the same command resumes
            an interrupted training.
        minutes: Approximate computing time on one core in minutes. It only sets
            the numbers of cities and steps: the training does not stop when
            this time is over.
        cities: Number of cities to train on; by default it follows from
            --minutes.
        steps: Number of training steps; by default it follows from --minutes.
        seed: Seed of all random draws. Another seed gives other cities and
            other weights.
        without: Kind of variation to leave out of the training: changes of the
            city between drives (change); weather, and LiDAR returns with the
            losses and errors of a data sheet (returns); or wandering in the
            lane and lane changes (driver). Use it to measure what each kind
            contributes. May be repeated.
        drawn_streets: Draw the streets at random as well, instead of using
            those of the shipped maps. Use it to test the weights on shipped
            maps without having trained on their streets.
        graded: Train with exact overlaps: the more of a query's scan a place
            shows, the higher it should rank. Without this option, every place
            within 7.5 m of a query counts as right. With it, the training takes
            about 1.5 times as long.
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
    fields |= {"drawn_streets": drawn_streets, "graded": graded}
    plan = TrainingPlan.of_minutes(minutes, **fields)
    command = shlex.join(["cns-drake", *sys.argv[1:]])
    picture = make_weights(plan, output, command, cluster)
    print(output)
    print(picture)
    terminal.next_command(
        *("cns-eval", "report", "drives", "--output", "report"),
        *("--set", f"learned.weights={output}"),
    )


def export_pairs(
    names: DriveNames = None,
    *,
    format: Annotated[
        Literal["pointnetvlad", "overlap", "overlap-table"], typer.Option()
    ],
    output: Annotated[Path, typer.Option()],
    vary: Annotated[Path | None, typer.Option(metavar="FAMILY.yaml")] = None,
    held_out: Annotated[list[str] | None, typer.Option(metavar="NAME")] = None,
    spacing: Annotated[float, typer.Option(min=0.1, metavar="METRES")] = 10.0,
    scans: Annotated[int, typer.Option(min=1, metavar="N")] = 1,
    max_range: Annotated[
        float | None,
        typer.Option(min=1.0, max=10_000.0, metavar="METRES"),
    ] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Export training data for other programs.

    Simulates the drives without recording them, and writes point clouds with
    exact positives, negatives and overlaps for training place recognition. To
    resume after an interruption, run the same command again.

    Args:
        format: Kind of data to write: pointnetvlad (clouds and pickle files as
            PointNetVLAD reads them), overlap (scans and the exact overlap of
            each pair), or overlap-table (only a table of the overlaps between a
            database and a query drive, for cns-eval pr --exact-overlaps).
        output: Folder for the data; created if it does not exist.
        vary: File of a family of drives (one drive and what varies in it),
            whose members are exported in addition to the named drives.
        held_out: Drive to keep for evaluation only. It is left out of the
            training data even if you also name it as a training drive. May be
            repeated.
        spacing: Distance that the car drives between two clouds [m].
        scans: Number of consecutive scans that are merged into each cloud (a
            submap).
        max_range: Leave out points that are farther than this along x, y or z
            in the LiDAR's frame [m]. By default 50, or 100 for overlap-table.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.scenarios.scenario_files import load_scenario
        from cns_drake.scenarios.shipped import recordable_drives
        from cns_drake.studies import pair_export

    if format == "overlap" and scans > 1:
        raise InputError("--scans: overlaps are those of single scans")
    cluster = choose_cluster(jobs, scheduler)
    tested = [load_scenario(name) for name in held_out or ()]
    if not names and vary is None:
        names = list(recordable_drives())
    learned = [load_scenario(name) for name in names or ()]
    if vary is not None:
        learned += family_members(vary, output, cluster)
    if format == "overlap-table":
        if len(learned) != 2 or tested:
            raise InputError(
                "--format overlap-table: give two drives, database and query"
            )
        protocol = RetrievalProtocol(
            query_spacing=spacing, max_range=max_range or 100.0
        )
        table = pair_export.write_overlap_table(
            learned[0], learned[1], output, protocol
        )
        print(table)
        terminal.next_command(
            *("cns-eval", "pr", *(f"drives/{one.name}" for one in learned)),
            *("--method", "solid", "--truth", "overlap:0.5"),
            *("--exact-overlaps", table),
        )
        return
    taken = {one.name for one in tested}
    learned = [one for one in learned if one.name not in taken]
    options = pair_export.ExportOptions(
        format, spacing, scans, max_range or 50.0
    )
    for path in pair_export.export_pairs(
        learned, tested, output, options, cluster, terminal.note
    ):
        print(path)


def map_truth(
    a: _Recorded,
    b: _Recorded,
    *,
    output: Annotated[Path, typer.Option(metavar="DIR")],
    spacing: SessionSpacing = 1.0,
) -> None:
    """Label what changed between the maps of two drives.

    Both drives go through the same place; A is the older drive, B the newer
    one. Each can be a recording of cns-drake, or a scenario, which is then
    simulated. Every point of A's map gets a label that says whether B finds it
    kept, gone or unobserved. Every point of B's map gets a label that says
    whether it is kept, new or newly seen. The labels are exact, because rays
    are cast in the worlds of both drives. To score the labels of your own
    change detector against them, run cns-eval map-update.

    Args:
        a: Older drive A: a recording, a shipped drive or a scenario file.
        b: Newer drive B: a recording, a shipped drive or a scenario file.
        output: Folder to write the maps and labels to; it must not exist yet.
    """
    with uninterrupted():
        from cns_drake.base.files import check_new_folder
        from cns_drake.studies.map_truth import open_survey, write_truth
        from evaluation.map_update.sessions import Label

    check_new_folder(output)
    first, second = open_survey(a), open_survey(b)
    counts, table = write_truth(first, second, output, spacing)
    for side, found in counts.items():
        text = ", ".join(
            f"{count} {Label(label).name.lower().replace('_', ' ')}"
            for label, count in sorted(found.items())
        )
        terminal.note(f"{side}: {text}")
        alone = [
            row
            for row in table
            if row.side == side and row.alone and not row.moves
        ]
        mapped = sum(row.points > 0 for row in alone)
        right = sum(row.verdict in ("gone", "new") for row in alone)
        terminal.note(
            f"{side}: {len(alone)} structures are in this drive's world alone;"
            f" {mapped} are in its map, {right} of them gone or new"
        )
    print(output)
    terminal.next_command("cns-eval", "map-update", output)
