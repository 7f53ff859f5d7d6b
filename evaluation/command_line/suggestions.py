"""Says where a command's results are, and what to open next."""

from pathlib import Path

from cns_drake.base import next_page, note
from evaluation.results import QUERIES, RESULTS


def name_results(page: Path) -> None:
    """Prints where the page of a study is, and the tables beside it, if any."""
    folder = page.parent
    if (folder / RESULTS).is_file():
        note(f"wrote {folder / RESULTS} and {QUERIES}")
    next_page(page)
