"""Says what a command's results are, where, and what to open next."""

from pathlib import Path

from evaluation.base import note, terminal
from evaluation.results import (
    QUERIES,
    RESULTS,
    QueryRows,
    Results,
    found_lines,
    lacks_baseline,
    summary_lines,
)


def show_results(page: Path) -> None:
    """Prints a study's main results, and where its page and tables are."""
    table = page.parent / RESULTS
    if table.is_file():
        results = Results.read(table)
        if lacks_baseline(results):
            for line in found_lines(QueryRows.read(page.parent)):
                print(line)
        for line in summary_lines(results):
            print(line)
    print(page)
    if table.is_file():
        note(f"wrote {table} and {QUERIES}")
    terminal.next_page(page)
