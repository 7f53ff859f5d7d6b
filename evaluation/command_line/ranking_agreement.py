"""The command `cns-eval ranking`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import terminal


def ranking(
    first: Annotated[Path, typer.Argument(metavar="REPORT")],
    second: Annotated[Path, typer.Argument(metavar="REPORT")],
    json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.")
    ] = False,
) -> None:
    """Whether two reports rank methods alike.

    The reports may be of simulated and of real drives. Prints the mean AUC of
    each method in both, and Kendall's tau with its 95 %
    interval. A report is a folder with a queries.csv, or that file.
    """
    from evaluation.recognition.rank_agreement import rank_agreement

    found = rank_agreement(first, second)
    if json:
        terminal.print_json(found.to_json())
        return
    rows = [
        (method, f"{one:.4f}  {other:.4f}")
        for method, one, other in zip(
            found.methods, found.first, found.second, strict=True
        )
    ]
    low, high = map(terminal.number, (found.interval.low, found.interval.high))
    tau = f"{terminal.number(found.tau)}  (95 %: {low} to {high})"
    terminal.print_rows(
        [("method", "AUC in each"), *rows, ("Kendall's tau", tau)]
    )
