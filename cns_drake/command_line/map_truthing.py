"""The commands `cns-drake map-truth` and `map-pairs`."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import terminal
from cns_drake.base.interrupts import uninterrupted
from evaluation.command_line.map_updating import BaselineName
from evaluation.command_line.options import SessionSpacing

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
    counts = write_truth(first, second, output, spacing, terminal.track)
    for side, found in counts.items():
        text = ", ".join(
            f"{count} {Label(label).name.lower().replace('_', ' ')}"
            for label, count in sorted(found.items())
        )
        terminal.note(f"{side}: {text}")
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
        from cns_drake.studies.map_pairs import measure_pairs

    chosen = baseline or (BaselineName.FREE_SPACE, BaselineName.DISTANCE)
    print(
        measure_pairs(
            pairs or (),
            [one.value for one in chosen],
            output,
            files,
            spacing,
            terminal.note,
            terminal.track,
        )
    )
