"""Names the tables of results, and suggests what to run next."""

import contextlib
from pathlib import Path

from cns_drake.base import InputError, next_command, note
from evaluation.results import QUERIES, RESULTS, compare_tables


def suggest_comparison(folder: Path) -> None:
    """Prints the command that compares a folder's results with shipped results.

    Nothing is printed if that command would refuse the results, for example
    because no results of the same experiment are shipped.
    """
    with contextlib.suppress(InputError):
        compare_tables([folder])
        next_command("cns-eval", "compare", folder)


def name_tables(folder: Path) -> None:
    """Prints where the tables beside a page are, unless there are none."""
    if (folder / RESULTS).is_file():
        note(f"wrote {folder / RESULTS} and {QUERIES}")
