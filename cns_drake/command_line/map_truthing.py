"""The command `cns-drake map-truth`."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import terminal
from cns_drake.base.interrupts import uninterrupted
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
