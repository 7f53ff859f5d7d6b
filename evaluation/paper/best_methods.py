"""The methods with the greatest AUC on each pair of drives."""

from collections import Counter
from collections.abc import Iterable, Sequence
import itertools

from evaluation.paper.paper_values import paper
from evaluation.recognition.metrics import Mode
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report.tables.recognition import recognition_table
from evaluation.results.table_forms import Cell, title

RING = title("ring++")


def best_with_all_queries(
    results: Sequence[PlaceOutcome],
    words: str = "If all queries count for every method",
) -> str:
    """Returns a sentence on which methods are best if all queries count.

    That is the mode `all` for every method.
    """
    best = best_methods(results, "all")
    number = sum(RING in methods for methods in best)
    return (
        f"{words}, {RING} is best on {number} of {len(best)} pairs"
        f" ({listed_counts(best)})."
    )


def best_methods(
    results: Sequence[PlaceOutcome], mode: Mode | None = None
) -> list[list[str]]:
    """Returns the methods with the greatest AUC on each pair.

    Table II of the paper prints these methods in bold. A pair has several best
    methods if their AUCs are equal as printed. By default, each method is
    scored in the mode that the paper used for it.
    """
    table = recognition_table(results, (), mode, paper())
    methods = [name for name, _ in table.groups[1:]]
    step = table.groups[1][1]  # AUC is the first of a method's columns.
    return [
        [
            method
            for method, cell in zip(
                methods, row[-step * len(methods) :: step], strict=True
            )
            if isinstance(cell, Cell) and cell.rank == 1
        ]
        for row in table.rows
    ]


def listed_counts(best: Iterable[Iterable[str]]) -> str:
    """Returns on how many pairs each method is best, as text.

    The text has the form "<method> on <number>, ...".
    """
    counts = Counter(itertools.chain.from_iterable(best)).most_common()
    return ", ".join(f"{method} on {number}" for method, number in counts)
