"""Writes which methods survive in twelve cities: `notes/survival.csv`.

    python docs/survival.py

The losses are those of the shipped tables (source `tables`: a query every 10 m,
one draw of the random yaw), of `notes/yaw_draws.csv` (source `draws`:
a query every 30 m, each draw and the mean of all, at four radii of a match),
and of `notes/new_plans.csv` (source `extracts` of OpenStreetMap, and `towns` of
CARLA's; a method counts where its control finds anything). Verdicts by road
networks are in `notes/network_survival.csv`.
"""

from __future__ import annotations

from collections.abc import Iterator
import csv
from pathlib import Path
import sys

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
# As a program, this file is not in the package `docs`.
sys.path.insert(0, str(ROOT))

from docs.fill_numbers import csv_rows  # noqa: E402
from evaluation.results import (  # noqa: E402
    OWN,
    STAGE,
    Results,
    Row,
    Survival,
    judge_survival,
)

_COLUMNS = (
    "source", "radius", "draw", "verified", "method", "loss", "low", "high",
    "cities", "verdict",
)  # fmt: skip


def retained_in_cities(verified: bool) -> list[Row]:
    """Returns retained shares of AUC strict in the shipped and fresh cities.

    A fresh city counts as a city of its own: it has the streets of a shipped
    city, but no building of it. Methods that were not measured in fresh cities
    are left out.
    """
    fresh, shipped = (
        Results.read(ROOT / f"evaluation/results/baselines/{name}.csv")
        .where({STAGE: OWN}, metric="relative_auc_strict", verified=verified)
        .rows
        for name in ("fresh", "stages")
    )
    methods = {row.method for row in fresh}
    return [*(row for row in shipped if row.method in methods), *fresh]


def lines() -> Iterator[tuple[object, ...]]:
    """Yields the lines of the file."""
    for verified in (False, True):
        rows = retained_in_cities(verified)
        for one in judge_survival(rows):
            yield "tables", "7.5", "0", *_cells(verified, one)
        yield from _on_networks(verified)
    # The lost shares of the pairs of each city.
    losses: dict[tuple[str, ...], dict[str, dict[str, list[float]]]] = {}
    for row in csv_rows("yaw_draws.csv"):
        kept = float(row["auc_strict"]) / float(row["unchanged_auc_strict"])
        of_method = losses.setdefault(
            (row["radius"], row["verified"], row["method"]), {}
        )
        of_city = of_method.setdefault(f"{row['map']} {row['version']}", {})
        of_city.setdefault(row["draw"], []).append(max(0.0, 1.0 - kept))
    for (radius, verified, method), cities in losses.items():
        table = np.array(
            [
                [np.mean(by_draw[draw]) for draw in sorted(by_draw)]
                for by_draw in cities.values()
            ]
        )
        means = {"mean": table.mean(axis=1), **dict(enumerate(table.T))}
        for draw, of_cities in means.items():
            one = Survival.of(
                method, dict(zip(cities, of_cities.tolist(), strict=True))
            )
            yield "draws", radius, draw, *_cells(verified == "1", one)


def _on_networks(verified: bool) -> Iterator[tuple[object, ...]]:
    rows = (
        Results.read(ROOT / "docs/notes/new_plans.csv")
        .where({STAGE: OWN}, metric="relative_auc_strict", verified=verified)
        .rows
    )
    for method in sorted({row.method for row in rows}):
        of_method = [row for row in rows if row.method == method]
        towns = [row for row in of_method if row.map.startswith("town")]
        extracts = [row for row in of_method if row not in towns]
        for source, some in (("extracts", extracts), ("towns", towns)):
            for one in judge_survival(some):
                yield source, "7.5", "0", *_cells(verified, one)


def _cells(verified: bool, one: Survival) -> tuple[object, ...]:
    limits = (
        "" if np.isnan(limit) else f"{limit:.6f}"
        for limit in (one.interval.low, one.interval.high)
    )  # fmt: skip
    return (
        int(verified), one.method, f"{one.loss:.6f}", *limits, one.cities,
        one.verdict,
    )  # fmt: skip


def main(path: Path = ROOT / "docs/notes/survival.csv") -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(_COLUMNS)
        table.writerows(lines())


if __name__ == "__main__":
    main()
