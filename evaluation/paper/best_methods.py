"""The methods with the greatest AUC on each pair of drives."""

from collections import Counter
from collections.abc import Iterable, Sequence
import itertools

from evaluation.paper.paper_values import Measured, StagePair, paper
from evaluation.recognition import Mode
from evaluation.results import in_table_order, title

RING = title("ring++")


def best_with_all_queries(
    results: Sequence[Measured],
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
    results: Sequence[Measured], mode: Mode | None = None
) -> list[list[str]]:
    """Returns the methods with the greatest AUC on each pair.

    Table II of the paper prints these methods in bold. A pair has several best
    methods if their AUCs are equal as printed, with four decimals. A method
    that is alone on a pair is not the best. By default, each method is scored
    in the mode that the paper used for it.
    """
    of_pair: dict[StagePair, dict[str, float]] = {}
    for one in results:
        numbers = paper().counted(one) if mode is None else one.by_mode[mode]
        shown = of_pair.setdefault(one.pair, {})
        shown[one.method] = round(numbers.auc, 4)
    return [
        [
            title(name)
            for name in in_table_order(shown)
            if len(shown) > 1 and shown[name] == max(shown.values())
        ]
        for shown in of_pair.values()
    ]


def listed_counts(best: Iterable[Iterable[str]]) -> str:
    """Returns on how many pairs each method is best, as text.

    The text has the form "<method> on <number>, ...".
    """
    counts = Counter(itertools.chain.from_iterable(best)).most_common()
    return ", ".join(f"{method} on {number}" for method, number in counts)
