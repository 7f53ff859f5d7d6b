"""Draws the chart of the README from the table of the results.

python docs/survival_chart.py docs/pictures/survival.png
"""

from __future__ import annotations

from pathlib import Path
import re
import sys

import matplotlib
from matplotlib.figure import Figure
import numpy as np

PAGE = Path(__file__).with_name("results.md")
_CELL = re.compile(r"([\d.]*)→([\d.]+)(?:, (\d+) ?%)?")


def read_table(text: str) -> tuple[list[str], list[str], np.ndarray]:
    """Reads the table below `## What survives`.

    Args:
        text: the page.

    Returns:
        Methods; pairs of stages; (P, M, 3) AUC with the change, the kept part,
        NaN where there is none, and 1 where the field is bold, else 0.
    """
    _, _, section = text.partition("\n## What survives\n")
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in section.partition("\n## ")[0].splitlines()
        if line.startswith("|")
    ]
    methods = [re.sub(r"\[(.+)\]\(.+\)", r"\1", cell) for cell in rows[0][2:]]
    pairs = [f"{row[0]} {row[1].replace(', ', ' → ')}" for row in rows[2:]]
    values = np.full((len(pairs), len(methods), 3), np.nan)
    for p, row in enumerate(rows[2:]):
        for m, cell in enumerate(row[2:]):
            _, changed, kept = _CELL.search(cell.replace("**", "")).groups()
            share = float(kept or "nan") / 100.0
            values[p, m] = float(changed), share, "**" in cell
    return methods, pairs, values


def draw(
    methods: list[str], pairs: list[str], values: np.ndarray, path: Path
) -> None:
    """Draws a field for each pair and method; bold ones stay bold."""
    figure = Figure(figsize=(9.2, 4.6), layout="constrained")
    axes = figure.subplots()
    colours = matplotlib.colormaps["viridis"].with_extremes(bad="#d8d8d8")
    image = axes.imshow(
        values[:, :, 1], cmap=colours, vmin=0.0, vmax=1.0, aspect="auto"
    )
    for p, m in np.ndindex(values.shape[:2]):
        auc, kept, is_bold = values[p, m]
        share = "" if np.isnan(kept) else f"   {100 * kept:.0f} %"
        dark = kept < 0.55  # On yellow and grey, black is legible.
        axes.text(
            m, p, f"{auc:.2f}{share}", ha="center", va="center",
            color="white" if dark else "black",
            fontweight="bold" if is_bold else "normal",
        )  # fmt: skip
    axes.set_xticks(range(len(methods)), methods)
    axes.set_yticks(range(len(pairs)), pairs)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_xticks(np.arange(len(methods) - 1) + 0.5, minor=True)
    axes.set_yticks(np.arange(len(pairs) - 1) + 0.5, minor=True)
    axes.grid(which="minor", color="white", linewidth=2)
    axes.tick_params(which="minor", length=0)
    bar = figure.colorbar(image, ax=axes, shrink=0.9)
    bar.set_label("part of the AUC that is kept (grey: not measured)")
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    draw(*read_table(PAGE.read_text(encoding="utf-8")), Path(sys.argv[1]))
