"""Options that several commands share, and functions that act on them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from evaluation.base import InputError, terminal

if TYPE_CHECKING:
    from evaluation.verbs import Measured

# Option: when drives are aligned to one world.
When = Literal["auto", "always", "never"]
Align = Annotated[
    When,
    typer.Option(
        help="Whether to align the drives to each other before the comparison. "
        "auto aligns drives unless something says that they share a world: a "
        "frame map, utm, earth, world or enu, their format, or one map that "
        "their scenarios name."
    ),
]
MethodName = Annotated[
    str,
    typer.Option(
        "--method",
        help="Place-recognition method to run: the name of a shipped method, "
        "or a Python file with your own method.",
    ),
]
Tables = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Folder for the tables results.csv and queries.csv, which have "
        "the columns of a study's tables.",
    ),
]
SensorHeight = Annotated[
    float, typer.Option(help="Height of the LiDAR above the ground [m].")
]


def write_tables(found: Measured, output: Path) -> None:
    """Writes both tables of what was measured, and shows a note on them."""
    from evaluation import results

    done = "replaced" if (output / results.RESULTS).exists() else "wrote"
    results.write_tables(output, found.results, found.queries)
    terminal.note(f"{done} {output / results.RESULTS} and {results.QUERIES}")


def overlap_of(truth: str) -> float | None:
    """Returns the least overlap of a match, from the option --truth.

    Args:
        truth: `radius` or `overlap:PART`.

    Returns:
        PART, from above 0 to 1; None for `radius`.

    Raises:
        InputError: the text is neither.
    """
    if truth == "radius":
        return None
    kind, _, part = truth.partition(":")
    try:
        least = float(part) if kind == "overlap" else math.nan
    except ValueError:
        least = math.nan
    if not 0.0 < least <= 1.0:
        raise InputError(
            f"--truth: {truth!r} is neither 'radius' nor 'overlap:PART' with a"
            " part above 0 and up to 1, such as overlap:0.5"
        )
    return least
