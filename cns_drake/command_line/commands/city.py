"""The command `city`, which builds the stages of a city."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.command_line.suggestions import suggest_reproduction
from evaluation.base import InputError, ended_by_interrupts, note

GROUP = "Make cities"


def city(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER")],
    new: Annotated[bool, typer.Option("--new")] = False,
    seed: Annotated[int | None, typer.Option(min=0, metavar="N")] = None,
    check: Annotated[bool, typer.Option("--check")] = False,
    repair_stages: Annotated[bool, typer.Option("--repair-stages")] = False,
) -> None:
    """Build the stages of a city from its roads and plan.

    You write the files roads.yaml, with the roads, and city.yaml, with the
    districts along the roads. The command generates an SDF world for each
    stage.

    Args:
        folder: Folder with roads.yaml, city.yaml and stages.yaml. The command
            writes the stages to this folder, and updates the folder's table of
            drives.
        new: Start from a folder with only roads.yaml: first write the missing
            files (two stages, a drive for each, and a city.yaml with a district
            for each block).
        seed: Seed of the random districts and drives that --new writes; by
            default 0.
        check: Write nothing. List the files that would change, and exit with
            status 1 if any would.
        repair_stages: Update the names of structures in stages.yaml, since
            additions to city.yaml renumber them. Structures are recognised by
            their coordinates in the structures.csv of the last run.

    Example:
        cns-drake city town --new
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.scenarios import build_city
        from worlds.city import differing_files

    if seed is not None and not new:
        raise InputError("--seed: has no effect without --new")
    if new and check:
        raise InputError(
            "--new and --check exclude each other; give one of them"
        )
    if check:
        changed = differing_files(folder, note, repair_stages=repair_stages)
        for path in changed:
            print(path)
        if changed:
            raise typer.Exit(1)
        return
    files = build_city(
        folder, new=new, seed=seed or 0, repair_stages=repair_stages
    )
    note(f"{len(files)} files")
    suggest_reproduction(folder)
