"""Says what a command's results are, where, and what to open next."""

from pathlib import Path

from cns_drake.base import next_page, note
from evaluation.results import QUERIES, RESULTS, Results, summary_lines


def show_results(page: Path) -> None:
    """Prints a study's main results, and where its page and tables are."""
    table = page.parent / RESULTS
    if table.is_file():
        for line in summary_lines(Results.read(table)):
            print(line)
    print(page)
    if table.is_file():
        note(f"wrote {table} and {QUERIES}")
    next_page(page)
