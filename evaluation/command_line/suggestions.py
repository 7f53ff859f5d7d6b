"""Suggests what to run next."""

import contextlib
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.base.terminal import next_command
from evaluation.results.table_comparison import compare_tables


def suggest_comparison(folder: Path) -> None:
    """Prints the command that compares a folder's results with shipped results.

    Nothing is printed if that command would refuse the results, for example
    because no results of the same experiment are shipped.
    """
    with contextlib.suppress(InputError):
        compare_tables([folder])
        next_command("cns-eval", "compare", folder)
