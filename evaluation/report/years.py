"""What is left of each method after years: tables, lifetimes and a chart."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
import math
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from evaluation.recognition.metrics import UNKNOWN, Interval, pr_curve
from evaluation.recognition.pose_errors import pose_success
from evaluation.recognition.rung_outcome import RungOutcome
from evaluation.recognition.survival import kept_share, paired_intervals
from evaluation.report.drawing import method_style, save
from evaluation.report.tables import Table, in_table_order, title

# Shares of a value that are left where a lifetime ends.
_TENTH, _HALF = 0.9, 0.5
# The database is of today, or the query.
FORWARD, BACKWARD = "old_map", "old_query"
# Its values are no share of today's, when nothing is to be found.
MAP_TASK = "map"
# How much of the maps is neither gone nor new.
UNCHANGED_TASK = "unchanged"


@dataclass(frozen=True)
class AgedPair:
    """The outcomes of all methods, with some years between the drives.

    They are without and with the gate. The direction is `FORWARD` or
    `BACKWARD`, and TCR_sym that along the query's way; NaN if unknown. For each
    (task, method), `further` has a value and how many count: the share of the
    queries that end right in the map of the database; mean IoU; or the share of
    the points of both maps that are neither gone nor new.
    """

    map_name: str
    year: int
    seed: int
    direction: str
    tcr_sym: float
    outcomes: Sequence[RungOutcome]
    further: Mapping[tuple[str, str], tuple[float, int]] = field(
        default_factory=dict
    )


@dataclass(frozen=True)
class YearRow:
    """A task of a method after some years, as `years.csv` has it.

    Attributes:
        task: `place`, `pose`, `localise`, `map` or `unchanged`.
        value: AUC, the share of right poses or ends, mean IoU, or the share of
            points.
        kept: share of today's value that is left; NaN for none. Its 95 %
            interval is by bootstrap over blocks of the route.
        visible_change: part of the queries' scans that the best place does not
            show, today's taken off.
        queries: number of queries, or of points that are gone or new.
    """

    map: str
    year: int
    seed: int
    task: str
    method: str
    gate: bool
    value: float
    kept: float
    kept_low: float
    kept_high: float
    r1: float
    direction: str
    tcr_sym: float
    visible_change: float
    queries: int

    @classmethod
    def of(
        cls,
        pair: AgedPair,
        task: str,
        method: str,
        value: float,
        today: float,
        queries: int,
        *,
        gate: bool = False,
        interval: Interval = UNKNOWN,
        r1: float = math.nan,
        visible_change: float = math.nan,
    ) -> YearRow:
        """Returns the row of a value, today's of which is known."""
        return cls(
            pair.map_name,
            pair.year,
            pair.seed,
            task,
            method,
            gate,
            value,
            float(kept_share(value, today)),
            interval.low,
            interval.high,
            r1,
            pair.direction,
            pair.tcr_sym,
            visible_change,
            queries,
        )


def year_rows(pairs: Sequence[AgedPair]) -> list[YearRow]:
    """Returns the rows of pairs, of which each map has one of year 0."""
    none = {
        (pair.map_name, one.method, one.is_gated): one
        for pair in pairs
        if pair.year == 0
        for one in pair.outcomes
    }
    rows = []
    outcomes = [(pair, one) for pair in pairs for one in pair.outcomes]
    for pair, now in outcomes:
        then = none[pair.map_name, now.method, now.is_gated]
        interval, _ = paired_intervals(then.outcomes, now.outcomes)
        auc, auc_then = (pr_curve(one.outcomes).auc for one in (now, then))
        poses = [pose_success(o.pose_errors, o.outcomes) for o in (now, then)]
        values = {"place": (auc, auc_then, interval)}
        if not math.isnan(poses[1]):
            values["pose"] = (poses[0], poses[1], UNKNOWN)
        rows += [
            YearRow.of(
                pair,
                task,
                now.method,
                value,
                today,
                len(now.outcomes),
                gate=now.is_gated,
                interval=kept,
                r1=now.outcomes.recall_at(1),
                visible_change=_hidden(now) - _hidden(then),
            )
            for task, (value, today, kept) in values.items()
        ]
    before = {pair.map_name: pair.further for pair in pairs if pair.year == 0}
    for pair in pairs:
        for (task, method), (value, number) in pair.further.items():
            today = math.nan
            if task != MAP_TASK:
                today = before[pair.map_name][task, method][0]
            rows.append(YearRow.of(pair, task, method, value, today, number))
    return rows


def _hidden(outcome: RungOutcome) -> float:
    known = outcome.overlaps[~np.isnan(outcome.overlaps)]
    return 1.0 - float(known.mean()) if len(known) else math.nan


def year_table(rows: Sequence[YearRow]) -> Table:
    """Returns the table of all rows."""
    return Table.of_rows([asdict(row) for row in rows])


def lifetime(
    years: Sequence[float], kept: Sequence[float], left: float
) -> float:
    """Returns the years until a share is left; infinite if more is left.

    The years ascend from 0, where the share is 1. Between two it falls evenly.
    """
    for k in range(1, len(years)):
        if kept[k] <= left:
            fall = kept[k - 1] - kept[k]
            part = (kept[k - 1] - left) / fall if fall > 0.0 else 0.0
            return years[k - 1] + part * (years[k] - years[k - 1])
    return math.inf


def lifetime_table(rows: Sequence[YearRow]) -> Table:
    """Returns how long each method lives, over seeds.

    `tenth` and `half` are of the mean over seeds; `_low` and `_high` the
    shortest and the longest of a seed.
    """
    found = []
    for key, some in _grouped(rows).items():
        last = max(row.year for row in some)
        values: list[object] = [*key]
        for left in (_TENTH, _HALF):
            single = [
                lifetime(*_curve([r for r in some if r.seed in (0, s)]), left)
                for s in sorted({r.seed for r in some} - {0})
            ] or [math.inf]
            mean = lifetime(*_curve(some), left)
            values += [
                f"over {last}" if math.isinf(one) else f"{one:.1f}"
                for one in (mean, min(single), max(single))
            ]
        found.append(tuple(values))
    header = ("map", "task", "method", "gate", "direction")
    ends = ("tenth", "tenth_low", "tenth_high", "half", "half_low", "half_high")
    return Table((*header, *ends), tuple(found))


def _key(row: YearRow) -> tuple[object, ...]:
    """Returns what a lifetime is of."""
    return row.map, row.task, row.method, row.gate, row.direction


def _grouped(rows: Sequence[YearRow]) -> dict[tuple, list[YearRow]]:
    """Returns the rows of each lifetime; those of today belong to all."""
    groups: dict[tuple, list[YearRow]] = {}
    for row in rows:
        if row.year > 0 and row.task != MAP_TASK:
            groups.setdefault(_key(row), []).append(row)
    for key, some in groups.items():
        some += [
            row for row in rows if row.year == 0 and _key(row)[:4] == key[:4]
        ]
    return groups


def _curve(rows: Sequence[YearRow]) -> tuple[list[float], list[float]]:
    """Returns years, and the mean share that is left."""
    years = sorted({row.year for row in rows})
    means = [
        float(np.mean([row.kept for row in rows if row.year == year]))
        for year in years
    ]
    return [float(year) for year in years], means


def _shown(rows: Iterable[YearRow]) -> list[YearRow]:
    """Returns what findings and chart show: places on older maps, ungated."""
    return [
        row
        for row in rows
        if row.task == "place"
        and not row.gate
        and row.direction == FORWARD
        and row.year > 0
    ]


def year_text(rows: Sequence[YearRow]) -> str:
    """Returns the findings: what the city of each year costs the methods."""
    lines = []
    for name in dict.fromkeys(row.map for row in rows):
        mine = _shown(row for row in rows if row.map == name)
        for year in sorted({r.year for r in mine}):
            then = [row for row in mine if row.year == year]
            words = [
                f"{title(method)} "
                f"{np.mean([r.kept for r in then if r.method == method]):.0%}"
                for method in in_table_order(r.method for r in then)
            ]
            tcr = np.mean([row.tcr_sym for row in then])
            seen = np.mean([row.visible_change for row in then])
            lines.append(
                f"{name}, {year} years: TCR_sym {tcr:.3f}, visible change "
                f"{seen:.1%}; of AUC is left: {', '.join(words)}"
            )
    return "\n".join(lines)


def draw_years(rows: Sequence[YearRow], stem: Path) -> None:
    """Draws the share of today's AUC that is left over the years."""
    maps = list(dict.fromkeys(row.map for row in rows))
    columns = min(len(maps), 2)
    lines = math.ceil(len(maps) / columns)
    figure = Figure((4.2 * columns, 0.6 + 3.0 * lines), layout="constrained")
    panels = figure.subplots(lines, columns, sharey=True, squeeze=False).ravel()
    for axes, name in zip(panels, maps, strict=False):
        _draw_map(axes, _shown(r for r in rows if r.map == name))
        axes.set_title(name.capitalize())
    panels[0].legend(fontsize=7, loc="lower left")
    for axes in panels[len(maps) :]:
        axes.axis("off")
    figure.supylabel("share of today's AUC that is left", fontsize="medium")
    save(figure, stem)


def _draw_map(axes: Axes, mine: Sequence[YearRow]) -> None:
    years = sorted({row.year for row in mine})
    for method in in_table_order(row.method for row in mine):
        shares = [
            [r.kept for r in mine if r.method == method and r.year == y]
            for y in years
        ]
        colour, _, marker = method_style(method)
        means = [float(np.mean(one)) for one in shares]
        axes.plot(
            years, means, marker=marker, color=colour, label=title(method)
        )
        axes.fill_between(
            years,
            [min(one) for one in shares],
            [max(one) for one in shares],
            color=colour,
            alpha=0.15,
            linewidth=0,
        )
    seen = [
        1.0 - float(np.mean([r.visible_change for r in mine if r.year == y]))
        for y in years
    ]
    axes.plot(years, seen, "--", color="0.3", label="visible as before")
    axes.set_xscale("log")
    axes.set_xticks(years, [str(year) for year in years])
    axes.minorticks_off()
    axes.set_xlabel("age of the map [years]")
    axes.set_ylim(0.0, 1.1)
    axes.grid(alpha=0.3)
