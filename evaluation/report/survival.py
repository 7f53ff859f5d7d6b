"""The survival of each method under structural change: tables and figure."""

from collections.abc import Callable, Collection, Sequence
import math
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
import numpy as np

from evaluation.recognition.survival import Kept, Survival
from evaluation.report import tables
from evaluation.report.drawing import method_style, plain, save

NO_CONTROL = "no control"
# The width of a phone's screen, on which letters stay legible [inches].
_WIDTH = 3.9
_ROW = 0.17
_EDGES = 0.75
_FONT_SIZE = 8.5
_LEGEND_COLOUR = "#444444"
# Height of a pair's title and the gap above it, in rows.
_TITLE_ROWS = 1.5


def by_pair(
    survivals: Sequence[Survival],
) -> dict[tuple[str, str, str], list[Survival]]:
    """Returns (map, database, query) -> methods in the order of tables."""
    groups: dict[tuple[str, str, str], list[Survival]] = {}
    for one in survivals:
        groups.setdefault(one.pair, []).append(one)
    methods = tables.in_table_order(one.method for one in survivals)
    for group in groups.values():
        group.sort(key=lambda one: methods.index(one.method))
    return groups


def percent(share: float) -> str:
    """Returns a share as text."""
    return tables.MISSING if math.isnan(share) else f"{100.0 * share:.0f} %"


def interval_text(kept: Kept) -> str:
    """Returns the interval of a kept share as text; empty without one."""
    low, high = kept.interval.low, kept.interval.high
    if math.isnan(low):
        return ""
    return f"{100.0 * low:.0f}–{100.0 * high:.0f}"


def survival_numbers(survivals: Sequence[Survival]) -> tables.Table:
    """Returns all numbers, as `survival.csv` has them."""
    return tables.Table.of(
        survivals,
        {
            "map": lambda s: s.pair[0],
            "db": lambda s: s.pair[1],
            "query": lambda s: s.pair[2],
            "method": lambda s: s.method,
            "auc_unchanged": lambda s: s.auc.unchanged,
            "auc_changed": lambda s: s.auc.changed,
            "kept": lambda s: s.auc.share,
            "kept_low": lambda s: s.auc.interval.low,
            "kept_high": lambda s: s.auc.interval.high,
            "r1_unchanged": lambda s: s.recall_at_1.unchanged,
            "r1_changed": lambda s: s.recall_at_1.changed,
            "r1_kept": lambda s: s.recall_at_1.share,
            "r1_kept_low": lambda s: s.recall_at_1.interval.low,
            "r1_kept_high": lambda s: s.recall_at_1.interval.high,
            "recall_at_full_precision": lambda s: s.recall_at_full_precision,
            "control": lambda s: s.control,
            **tables.protocol_columns("protocol"),
            "auc_strict_unchanged": lambda s: s.auc_strict[0],
            "auc_strict_changed": lambda s: s.auc_strict[1],
        },
    )


def survival_table(survivals: Sequence[Survival]) -> tables.Table:
    """Returns the table for print: a row for each pair and method."""
    return tables.Table.of(
        [one for group in by_pair(survivals).values() for one in group],
        {
            "map": lambda s: s.pair[0],
            "DB → query": lambda s: " → ".join(s.pair[1:]),
            "method": lambda s: tables.title(s.method),
            **_shown("AUC", lambda s: s.auc),
            **_strict_columns(),
            **_shown("R@1", lambda s: s.recall_at_1),
            ("recall at full precision", "with change"): lambda s: (
                s.recall_at_full_precision
            ),
        },
        tables.CAPTIONS["survival"],
    )


def _shown(
    group: str, number: Callable[[Survival], Kept]
) -> tables.Columns[Survival]:
    """Returns the columns of a number without change, with it, and kept."""

    def kept(one: Survival) -> str | None:
        if one.unchanged is None:
            return None
        text = percent(number(one).share)
        interval = interval_text(number(one))
        return f"{text} ({interval})" if interval else text

    return {
        (group, "without change"): lambda one: (
            NO_CONTROL if one.unchanged is None else number(one).unchanged
        ),
        (group, "with change"): lambda one: number(one).changed,
        (group, "kept"): kept,
    }


def _strict_columns() -> tables.Columns[Survival]:
    names = "without change", "with change"
    return tables.keyed(
        {("AUC strict", name): k for k, name in enumerate(names)},
        lambda one, k: one.auc_strict[k],
    )


def survival_summary(survivals: Sequence[Survival]) -> str:
    """Returns one or two sentences on the share of AUC that methods keep."""
    known = [one for one in survivals if one.unchanged is not None]
    pairs = {one.pair for one in survivals}
    without = len(pairs) - len({one.pair for one in known})
    shares: dict[str, list[float]] = {}
    for one in known:
        if not math.isnan(one.auc.share):
            shares.setdefault(one.method, []).append(one.auc.share)
    medians = {
        m: float(np.median(shares[m])) for m in tables.in_table_order(shares)
    }
    parts = []
    if medians:
        listed = ", ".join(
            f"{tables.title(method)} {percent(medians[method])}"
            for method in sorted(medians, key=lambda m: -medians[m])
        )
        number = len(pairs) - without
        over = f"median of {number} pairs" if number > 1 else "one pair"
        parts.append(
            f"Each method keeps part of its AUC without change ({over}):"
            f" {listed}."
        )
    if without:
        which = f"For {without} of {len(pairs)} pairs" if known else "Here"
        parts.append(
            f"{which} no control was driven (both routes in one stage), so the"
            " cost of the change alone is not known."
        )
    return " ".join(parts)


def draw_survival(
    survivals: Sequence[Survival],
    stem: Path,
    beaten: Collection[tuple[tuple[str, str, str], str]] = (),
) -> None:
    """Draws AUC without and with the change, for each pair and method.

    A hollow marker is AUC without the change, a full one AUC with it; the kept
    share stands beside them. At least one pair has a control; those without are
    left out. Where others beat some methods of a pair with the change, beyond
    doubt, the names of the rest are bold.
    """
    groups = by_pair([one for one in survivals if one.unchanged is not None])
    rows = sum(_TITLE_ROWS + len(group) for group in groups.values())
    figure = Figure(
        figsize=(_WIDTH, _EDGES + _ROW * rows), layout="constrained"
    )
    axes = figure.subplots()
    height, ticks = 0.0, []
    with_beaten = {pair for pair, _ in beaten}
    leading = []
    for pair, group in groups.items():
        map_name, *stages = pair
        height += _TITLE_ROWS
        axes.text(
            0.0,
            height - 0.8,
            plain(f"{map_name} {' → '.join(stages)}"),
            fontsize=_FONT_SIZE,
            fontweight="bold",
            va="center",
        )
        for one in group:
            _draw_row(axes, one, height)
            ticks.append((height, plain(tables.title(one.method))))
            is_beaten = (pair, one.method) in beaten
            leading.append(pair in with_beaten and not is_beaten)
            height += 1.0
    axes.set_yticks(*zip(*ticks, strict=True), fontsize=_FONT_SIZE)
    axes.set(xlim=(0.0, 1.0), ylim=(height - 0.2, 0.0))
    for label, is_leading in zip(axes.get_yticklabels(), leading, strict=True):
        label.set_fontweight("bold" if is_leading else "normal")
    axes.tick_params(axis="x", labelsize=_FONT_SIZE)
    axes.tick_params(axis="y", length=0, pad=6)
    _write_beside(axes, "kept", 0.0)
    axes.set_xlabel("AUC (all queries)", fontsize=_FONT_SIZE)
    axes.grid(axis="x", alpha=0.3)
    axes.spines[["top", "left", "right"]].set_visible(False)
    axes.legend(
        handles=[
            Line2D(
                [],
                [],
                color=_LEGEND_COLOUR,
                marker="o",
                markerfacecolor=face,
                linestyle="none",
                label=label,
            )
            for face, label in (
                ("white", "without change"),
                (_LEGEND_COLOUR, "with change"),
            )
        ],
        loc="lower center",
        bbox_to_anchor=(0.33, 1.0),
        ncols=2,
        frameon=False,
        fontsize=_FONT_SIZE,
        handletextpad=0.2,
        columnspacing=1.0,
    )
    save(figure, stem)


def _draw_row(axes: Axes, one: Survival, height: float) -> None:
    colour, _, marker = method_style(one.method)
    before, after = one.auc.unchanged, one.auc.changed
    axes.plot(
        [before, after], [height] * 2, color=colour, linewidth=1.5, alpha=0.6
    )
    for value, face in ((before, "white"), (after, colour)):
        axes.plot(
            value,
            height,
            marker,
            color=colour,
            markerfacecolor=face,
            markersize=5,
            clip_on=False,
            zorder=3,
        )
    _write_beside(axes, percent(one.auc.share), height)


def _write_beside(axes: Axes, text: str, height: float) -> None:
    axes.annotate(
        text,
        (1.0, height),
        xytext=(34, 0),
        textcoords="offset points",
        ha="right",
        va="center",
        fontsize=_FONT_SIZE,
        annotation_clip=False,
    )
