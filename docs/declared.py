"""Reports what two experiments declared before they ran: `notes/declared.csv`.

    python docs/declared.py

`what_changes.yaml` declared t intervals over four cities, and that a method
survives if the lower limit is at least 0.9; `ranking.yaml` on how many pairs
each method is best, in which share of samples of whole cities (bootstrap; here
all 256 samples), and by how much its mean changes with the draw of the yaw
alone. The pages report sign flips and survival over more cities beside it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
import csv
import itertools
from pathlib import Path
import sys

import numpy as np
from scipy.stats import t

ROOT = Path(__file__).resolve().parents[1]
# As a program, this file is not in the package `docs`.
sys.path.insert(0, str(ROOT))

from docs.fill_numbers import csv_rows  # noqa: E402

_COLUMNS = (
    "plan", "condition", "metric", "verified", "method", "mean", "low", "high",
    "verdict", "best_on", "best_in_samples", "spread_of_draws",
)  # fmt: skip


def what_changes() -> Iterator[tuple[object, ...]]:
    """Yields a line for each cause, verification and method."""
    kept: dict[tuple[str, ...], list[float]] = defaultdict(list)
    for row in csv_rows("what_changes.csv"):
        if row["metric"] == "relative_auc_strict" and row["cause"] != "none":
            key = row["cause"], row["metric"], row["verified"], row["method"]
            kept[key].append(float(row["value"]))
    for key, values in kept.items():
        mean, number = np.mean(values), len(values)
        half = t.ppf(0.975, number - 1) * np.std(values, ddof=1)
        low, high = mean + np.array([-1.0, 1.0]) * half / np.sqrt(number)
        verdict = "survives" if low >= 0.9 else "does not survive"
        limits = (f"{limit:.4f}" for limit in (mean, low, high))
        yield "what_changes", *key, *limits, verdict, "", "", ""


def ranking() -> Iterator[tuple[object, ...]]:
    """Yields a line for each radius, verification and method."""
    # Metric, radius, verified -> method -> pair -> values of the draws.
    tables: dict = defaultdict(lambda: defaultdict(lambda: defaultdict(list)))
    for row in csv_rows("yaw_draws.csv"):
        if not row["version"]:
            pair = row["map"], row["database"], row["query"]
            key = "auc_strict", row["radius"], row["verified"]
            value = float(row["auc_strict"])
            tables[key][row["method"]][pair].append(value)
    for row in csv_rows("ranking.csv"):
        if row["cities"] == "shipped":
            pair = row["map"], row["database"], row["query"]
            key = "auc", row["radius"], row["verified"]
            tables[key][row["method"]][pair].append(float(row["auc"]))
    for (metric, radius, verified), of_method in tables.items():
        methods, pairs = list(of_method), list(next(iter(of_method.values())))
        values = np.array(
            [[of_method[name][pair] for pair in pairs] for name in methods]
        )
        means = values.mean(axis=2)
        best_on = np.bincount(means.argmax(axis=0), minlength=len(methods))
        cities = sorted({city for city, *_ in pairs})
        of_city = [
            [k for k, (city, *_) in enumerate(pairs) if city == name]
            for name in cities
        ]
        samples = [
            np.concatenate(drawn)
            for drawn in itertools.product(of_city, repeat=len(cities))
        ]
        wins = [means[:, drawn].mean(axis=1).argmax() for drawn in samples]
        share = np.bincount(wins, minlength=len(methods)) / len(samples)
        draws = np.ptp(values.mean(axis=1), axis=1)
        for k, name in enumerate(methods):
            yield (
                "ranking", radius, metric, verified, name,
                f"{means[k].mean():.4f}", "", "", "", best_on[k],
                f"{share[k]:.4f}",
                f"{draws[k]:.4f}" if values.shape[2] > 1 else "",
            )  # fmt: skip


def main(path: Path = ROOT / "docs/notes/declared.csv") -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(_COLUMNS)
        table.writerows(itertools.chain(what_changes(), ranking()))


if __name__ == "__main__":
    main()
