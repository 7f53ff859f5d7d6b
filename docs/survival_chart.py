"""Draws the chart of the README from the tables that the package ships.

python docs/survival_chart.py docs/pictures/survival.png
"""

from __future__ import annotations

import csv
from pathlib import Path
import sys

from matplotlib import rc_context
from matplotlib.figure import Figure
import numpy as np

TABLES = Path(__file__).parents[1] / "evaluation/results/baselines"
NAMES = {
    "ring++": "RING++",
    "btc": "BTC",
    "scan-context++": "Scan Context++",
    "solid": "SOLiD",
    "layered-overlap": "layered overlap",
    "learned": "learned",
}
_NUMBERS = ("No", "One", "Two", "Three", "Four", "Five", "Six")
# A method survives if the median pair keeps this share of its AUC.
SURVIVES = 0.95


def kept_shares(table: str) -> dict[str, list[float]]:
    """Returns the shares of AUC that each method keeps, one for each pair.

    Args:
        table: `stages` or `fresh`, a shipped table.
    """
    found: dict[str, list[float]] = {name: [] for name in NAMES}
    path = TABLES / f"{table}.csv"
    with path.open(newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            if (row["metric"], row["gate"]) == ("kept", "0"):
                found[row["method"]].append(float(row["value"]))
    return found


def draw(
    shipped: dict[str, list[float]], fresh: dict[str, list[float]], path: Path
) -> str:
    """Draws a row for each method, and returns the title, which is the finding.

    Args:
        shipped, fresh: shares kept, by method, of pairs of shipped cities and
            of cities drawn anew, which no method has seen.
        path: the picture, in the format that its name says.
    """
    order = sorted(shipped, key=lambda name: np.median(shipped[name]))
    survive = sum(
        min(np.median(shipped[name]), np.median(fresh[name])) >= SURVIVES
        for name in order
    )
    title = (
        f"{_NUMBERS[survive]} of {_NUMBERS[len(order)].lower()} methods "
        "survive a rebuilt city"
    )
    with rc_context({"font.size": 15, "svg.hashsalt": "survival"}):
        figure = Figure(figsize=(7.0, 4.6), layout="constrained")
        axes = figure.subplots()
        for y, name in enumerate(order):
            for shares, offset, style in (
                (shipped[name], 0.16, {"c": "#17324d"}),
                (fresh[name], -0.16, {"ec": "#c46a00", "fc": "none"}),
            ):
                heights = np.full(len(shares), y + offset)
                axes.scatter(100 * np.array(shares), heights, s=34, **style)
                axes.plot(
                    [100 * np.median(shares)] * 2,
                    [y + offset - 0.15, y + offset + 0.15],
                    color="#17324d" if offset > 0 else "#c46a00",
                    linewidth=3.5,
                )
        axes.set_yticks(range(len(order)), [NAMES[name] for name in order])
        axes.tick_params(axis="y", length=0)
        axes.set_xlim(0.0, 112.0)
        axes.axvline(100.0, color="#888888", linewidth=1, zorder=0)
        axes.grid(axis="x", color="#dddddd")
        axes.set_axisbelow(True)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.set_xlabel("AUC kept when the city is rebuilt [%]")
        counts = len(next(iter(shipped.values()))), len(fresh[order[0]])
        figure.suptitle(
            title, fontsize=19, fontweight="bold", x=0.02, ha="left"
        )
        axes.set_title(
            f"● {counts[0]} pairs of shipped cities   "
            f"○ {counts[1]} of redrawn cities   ┃ median",
            fontsize=13.5, loc="left", x=-0.32,
        )  # fmt: skip
        figure.savefig(path, dpi=150)
    return title


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    draw(kept_shares("stages"), kept_shares("fresh"), Path(sys.argv[1]))
