"""Curves: precision over recall, in a panel for each pair of drives."""

from matplotlib.figure import Figure
import numpy as np

from evaluation.base import InputError, repeated
from evaluation.results.charts.chart import Chart
from evaluation.results.method_names import title
from evaluation.results.table import Row


def draw_curves(chart: Chart) -> Figure:
    """Returns the chart.

    Raises:
        InputError: the answers are unknown, or a pair of drives has several
            conditions.
    """
    asked = {
        answers.identity: answers
        for answers in (chart.queries.answers if chart.queries else ())
    }
    of_pair: dict[str, list[Row]] = {}
    for row in chart.rows:
        of_pair.setdefault(f"{row.database} → {row.query}", []).append(row)
    figure, panels = chart.panels(300.0, of_pair)
    for axes, (pair, rows) in zip(panels, of_pair.items(), strict=True):
        if repeated(row.label for row in rows):
            raise InputError(
                f"charts: curves: {pair}: several conditions; select one"
            )
        for row in rows:
            if row.identity not in asked:
                raise InputError("charts: curves: the answers are unknown")
            curve = asked[row.identity].outcomes.curve
            colour, line, marker = chart.styles[title(row.label)]
            # The curve begins at recall 0 with the precision of its first
            # point. The drawn area is then the AUC.
            precision = np.concatenate([curve.precision[:1], curve.precision])
            recall = np.concatenate([[0.0], curve.recall])
            axes.plot(
                recall[: len(precision)],
                precision,
                linestyle=line,
                color=colour,
                marker=marker,
                markevery=0.2,
            )
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02), xlabel="recall")
        axes.grid()
    figure.supylabel("precision")
    return figure
