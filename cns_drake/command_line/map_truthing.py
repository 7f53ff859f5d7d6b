"""The commands `cns-drake map-truth` and `map-pairs`; tasks of others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base import terminal
from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.command_line.options import Task
from evaluation.command_line.map_updating import BaselineName
from evaluation.command_line.options import SessionSpacing

if TYPE_CHECKING:
    from cns_drake.base.jobs.cluster import Cluster
    from evaluation.report.compared import ComparedPair

_Drive = Annotated[str, typer.Argument(metavar="RECORDING|NAME|SCENARIO.yaml")]


def map_truth(
    a: _Drive,
    b: _Drive,
    *,
    output: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder to write.")
    ],
    spacing: SessionSpacing = 1.0,
) -> None:
    """Maps of two drives, labelled by rays.

    A is the older drive and B the newer one, of one place: recordings made by
    cns-drake, or scenarios, which are simulated. Each point of A's map is kept,
    gone or unobserved by B; each of B's kept, new or newly seen. The worlds of
    both drives decide. cns-eval map-update scores labels of others.
    """
    with uninterrupted():
        from cns_drake.studies.map_truth import open_survey, write_truth
        from evaluation.map_update.sessions import Label

    first, second = open_survey(a), open_survey(b)
    counts, table = write_truth(first, second, output, spacing, terminal.track)
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


def map_pairs(
    pairs: Annotated[
        list[str] | None,
        typer.Argument(metavar="PAIR", help="Test pairs; all by default."),
    ] = None,
    *,
    output: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder to write.")
    ],
    files: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="Folder of the imported cities' files."
        ),
    ] = None,
    baseline: Annotated[
        list[BaselineName] | None,
        typer.Option(
            help="Baseline to score; free-space and distance by default."
        ),
    ] = None,
    spacing: SessionSpacing = 1.0,
) -> None:
    """Make and score the frozen test pairs.

    Twelve pairs of maps, four of them of imported cities, by seeds that were
    drawn before any method ran on them. Writes cities, labelled maps and
    map_pairs.csv. What is there already stays.
    """
    with uninterrupted():
        from cns_drake.studies.map_pairs import score_pairs

    chosen = baseline or (BaselineName.FREE_SPACE, BaselineName.DISTANCE)
    print(
        score_pairs(
            pairs or (),
            [one.value for one in chosen],
            output,
            files,
            spacing,
            terminal.note,
            terminal.track,
        )
    )


def run_task(
    task: Task,
    pairs: Sequence[ComparedPair],
    output: Path,
    cluster: Cluster,
    spacing: float,
    own_methods: Sequence[Path] | None,
) -> Path:
    """Runs a task other than `PLACE` on pairs of drives; returns its table.

    Args:
        task: which one.
        pairs, output, cluster: see `localise_pairs` and `update_pairs`.
        spacing: between two queries that are localised [m].
        own_methods: Python files with estimators.

    Raises:
        InputError: the task takes no such methods, or cannot be done.
    """
    if task is Task.LOCALISE:
        from evaluation.study.localisation import SHIPPED, localise_pairs

        methods = (*SHIPPED, *map(str, own_methods or ()))
        return localise_pairs(pairs, output, cluster, methods, spacing)
    if own_methods:
        raise InputError(
            "--task map: leave out --method (docs/map_update.md says how to "
            "score labels of one's own)"
        )
    from cns_drake.studies.map_pairs import update_pairs

    return update_pairs(pairs, output, cluster, terminal.note)
