"""Figures of localisation."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from matplotlib.figure import Figure
import numpy as np

from evaluation.localisation.localise import (
    RIGHT_TRANSLATION,
    Localisation,
    Starts,
)
from evaluation.localisation.tracking import LOST
from evaluation.report.compared import ComparedRow, draw_compared
from evaluation.report.drawing import save


def draw_track(rows: np.ndarray, stem: Path) -> None:
    """Draws the error over the way, and below it the share without a map.

    Args:
        rows: (K,) of `TRACKED`.
        stem: path to write, without ending.
    """
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for stretch in np.unique(rows["stretch"]):
        some = rows[rows["stretch"] == stretch]
        error = np.maximum(some["translation_error"], 1e-4)
        top.plot(some["way"], error, "-", color="#0072B2", linewidth=1.0)
        bottom.fill_between(
            some["way"], some["unmapped"], color="#E69F00", linewidth=0.0
        )
    for level, style in ((RIGHT_TRANSLATION, "--"), (LOST, ":")):
        top.axhline(level, color="0.4", linestyle=style, linewidth=0.8)
    top.set(yscale="log", ylabel="error of position [m]")
    bottom.set(
        xlabel="way [m]",
        ylabel="scan\nwithout map",
        ylim=(0.0, max(0.1, 1.05 * float(rows["unmapped"].max()))),
    )
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
        axes.margins(x=0.01)
    save(figure, stem, ("png",))


@dataclass(frozen=True)
class LocalisedRow(ComparedRow):
    """An estimator on a pair of drives, from starts of one kind.

    Attributes:
        starts: the draw of starts.
        rows: (K,) of `QUERY`.
    """

    starts: Starts
    rows: np.ndarray

    @cached_property
    def summary(self) -> dict[str, float | int | None]:
        """All numbers."""
        return Localisation(self.rows).to_json()

    @property
    def share(self) -> float:
        """Share of the queries that end right; the colour of the figure."""
        return float(self.summary["success_03m_1deg"] or 0.0)

    @property
    def label(self) -> str:
        """Median error of position [cm]."""
        error = self.summary["translation_median"]
        if error is None:
            return "–"
        return f"{100.0 * error:.1f}" if error < 0.1 else f"{100.0 * error:.0f}"


def draw_localised(rows: Sequence[LocalisedRow], stem: Path) -> None:
    """Draws the share of right ends that each cause leaves.

    A cell has a strip for each level, the weakest at its left; the number is
    the median error at the strongest level [cm].

    Args:
        rows: rows for all maps, causes, methods and starts.
        stem: path to write, without ending.
    """
    panels: dict[str, list[LocalisedRow]] = {}
    for row in rows:
        draw = row.starts
        title = f"start {draw.radius:g} m, {draw.turn_deg:g} deg"
        panels.setdefault(title, []).append(row)
    draw_compared(
        panels,
        lambda _, row: (row.share, row.label),
        "part within 0.3 m and 1 deg; numbers: cm",
        stem,
    )
