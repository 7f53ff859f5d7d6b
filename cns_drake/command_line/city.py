"""The command `cns-drake city`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.map_folder import MapFolder
from cns_drake.base.terminal import note
from cns_drake.command_line.options import Jobs


def city(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER",
            help="Folder with roads.yaml, city.yaml and stages.yaml, and the "
            "drives of the city, whose figures are brought up to date.",
        ),
    ],
    start: Annotated[
        bool,
        typer.Option(
            "--start",
            help="First write the missing files besides roads.yaml: a plan "
            "with a district for each block, two stages, a drive for "
            "each.",
        ),
    ] = False,
    seed: Annotated[
        int,
        typer.Option(min=0, metavar="N", help="Seed of --start's draws."),
    ] = 0,
    check: Annotated[
        bool,
        typer.Option(
            "--check",
            help="Write nothing; exit with 1 if a file would change.",
        ),
    ] = False,
    repair_stages: Annotated[
        bool,
        typer.Option(
            "--repair-stages",
            help="Update stages.yaml after the plan has grown: structures "
            "that have kept their place in structures.csv get their new "
            "names.",
        ),
    ] = False,
    calibrate: Annotated[
        tuple[str, str] | None,
        typer.Option(
            metavar="EARLIER LATER",
            help="Generate nothing. Simulate the drives of two stages, "
            "such as 01 04, and show TCR_sym and each method without the "
            "offset of the routes, without absent structures, and "
            "without lower ones.",
        ),
    ] = None,
    jobs: Jobs = None,
) -> None:
    """Build a city from its roads and plan."""
    if calibrate is not None:
        _calibrate(folder, *calibrate, jobs)
        return
    with uninterrupted():
        from cns_drake.city.generation.generate import (
            differing_files,
            generate_city,
        )
        from cns_drake.city.generation.starter import start_city
        from cns_drake.scenarios.drive_table import write_table

    if check:
        changed = differing_files(folder, note, repair_stages=repair_stages)
        for path in changed:
            print(path)
        if changed:
            raise typer.Exit(1)
        return
    if start:
        start_city(folder, seed, note)
    files = generate_city(folder, note, repair_stages=repair_stages)
    write_table(folder, note)
    note(f"{len(files)} files")


def _calibrate(
    folder: Path, earlier: str, later: str, jobs: int | None
) -> None:
    with uninterrupted():  # Only --calibrate needs the evaluation.
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.scenarios.scenario_files import load_scenario
        from cns_drake.studies.knob_effects import effect_lines, knob_effects

    first, last = (
        load_scenario(MapFolder(folder).drive(stage))
        for stage in (earlier, later)
    )
    effects = knob_effects(first, last, choose_cluster(jobs, None))
    for line in effect_lines(effects):
        print(line)
