"""How alike the answers along a street are: how long its blocks must be.

    python tests/benchmarks/street_blocks.py QUERIES.csv

prints how two queries are correlated over their distance, in the `queries.csv`
of an experiment: in their answers, and in the difference of the answers of two
methods.
"""

import collections
from collections.abc import Sequence
import csv
import itertools
from pathlib import Path
import sys

import numpy as np

_DISTANCES = (0.0, 15.0, 30.0, 50.0, 70.0, 100.0, 140.0)
_CONDITION = ("database", "query", "both.stage", "verified")


def main() -> None:
    """Prints both tables."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    conditions: dict = collections.defaultdict(
        lambda: collections.defaultdict(list)
    )
    with Path(sys.argv[1]).open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["task"] == "place" and row["has_match"] == "1":
                condition = tuple(row.get(name) for name in _CONDITION)
                conditions[condition][row["method"]].append(
                    [
                        float(row[name])
                        for name in ("query_x", "query_y", "correct")
                    ]
                )
    answers, leads = [], []
    for by_method in conditions.values():
        # All methods answer the same queries.
        *p_WQ, _ = np.transpose(next(iter(by_method.values())))
        rights = [np.array(rows)[:, 2] for rows in by_method.values()]
        known = [right for right in rights if 0.1 < right.mean() < 0.9]
        answers += [(p_WQ, right) for right in known]
        pairs = itertools.combinations(known, 2)
        leads += [(p_WQ, one - other) for one, other in pairs]
    for title, some in (("answers", answers), ("differences", leads)):
        _print_correlations(title, some)


def _print_correlations(
    title: str, some: Sequence[tuple[list[np.ndarray], np.ndarray]]
) -> None:
    """Prints the mean correlation of two queries, by their distance.

    Args:
        title: what is correlated.
        some: x and y [m] and a value of each query (Q,), of each condition.
    """
    found = collections.defaultdict(list)
    for p_WQ, values in some:
        if not values.std() > 0.0:
            continue
        z = (values - values.mean()) / values.std()
        first, second = np.triu_indices(len(z), 1)
        distance = np.hypot(*(p[first] - p[second] for p in p_WQ))
        product = z[first] * z[second]
        bins = np.digitize(distance, _DISTANCES)
        for k in range(1, len(_DISTANCES)):
            if (bins == k).any():
                found[k].append(product[bins == k].mean())
    for k in sorted(found):
        ends = _DISTANCES[k - 1 : k + 1]
        print(title, "{:g} to {:g} m".format(*ends), f"{np.mean(found[k]):.3f}")


if __name__ == "__main__":
    main()
