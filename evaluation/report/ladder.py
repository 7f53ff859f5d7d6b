"""The results of a ladder: their numbers, tables, words and figure."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
import itertools
import math
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
import numpy as np

from cns_drake.base.jobs.fingerprint import fingerprint
from evaluation.recognition import metrics
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.rung_outcome import FAULTS, RungOutcome
from evaluation.recognition.survival import Kept, kept_share
from evaluation.report.drawing import plain, save
from evaluation.report.tables import (
    Columns,
    Table,
    in_table_order,
    keyed,
    title,
)

# The options of the protocol that all rungs share.
_OPTIONS = ("query_spacing", "place_spacing", "max_range")
# A kept share of AUC from this one on counts as a small loss.
_MUCH = 0.95
# Least difference of the kept shares with and without the gate that is named.
_DIFFERENT = 0.1
# Rungs with more than one cause.
_NONE, _ALL = "none", "all"
# Told apart by all kinds of colour vision.
_COLOURS = colormaps["RdYlBu"]
# Letters on these shares are black.
_LIGHT = (0.15, 0.85)
_SHARES = Normalize(0.0, 1.0)
_CELL_WIDTH, _CELL_HEIGHT = 0.95, 0.3
_EDGES = (2.4, 1.6)
_FONT_SIZE = 8.5
_TITLES = {False: "without the gate", True: "with the gate"}


@dataclass(frozen=True)
class LadderRung:
    """The change between two drives.

    Levels are 1 to 4; without a change the level is 0 and the cause `none`. The
    radius is the greatest distance of a match [m]; NaN where places do not
    match.
    """

    map_name: str
    database: str
    query: str
    cause: str
    level: int
    strength: str
    radius: float = math.nan


@dataclass(frozen=True)
class MeasuredRung:
    """All methods, without and with the gate, on a rung, with one draw."""

    rung: LadderRung
    seed: int
    drives: str
    outcomes: Sequence[RungOutcome]


@dataclass(frozen=True)
class LadderRow:
    """A method on a rung: means over the draws.

    `drives` is a fingerprint of those of all draws. The unchanged draws are on
    the rung `none` of the same map; a share of their AUC is kept. The 95 %
    interval of AUC is by bootstrap over blocks of the route; a sample has the
    same ones in each draw.
    """

    rung: LadderRung
    drives: str
    draws: Sequence[RungOutcome]
    unchanged: Sequence[RungOutcome]
    auc_interval: metrics.Interval
    kept: Kept

    @property
    def method(self) -> str:
        return self.draws[0].method

    @property
    def is_gated(self) -> bool:
        return self.draws[0].is_gated

    @property
    def outcomes(self) -> QueryOutcomes:
        """The outcomes of the first draw; all have the same queries."""
        return self.draws[0].outcomes

    def mean(self, value: Callable[[RungOutcome], float]) -> float:
        """Returns the mean of a number over the draws."""
        return float(np.mean([value(one) for one in self.draws]))

    def mean_turned(self, *, is_right: bool) -> float:
        """Returns the mean number of queries that turn right, or wrong.

        They are otherwise on the rung `none`; NaN if that has other queries.
        """
        before = self.unchanged[0].outcomes.is_right
        if len(before) != len(self.outcomes):
            return math.nan
        after = [one.outcomes.is_right for one in self.draws]
        turned = [(one != before) & (one == is_right) for one in after]
        return float(np.mean([one.sum() for one in turned]))

    def mean_overlap(self) -> float:
        """Returns the mean of `RungOutcome.overlaps`; NaN if all are."""
        overlaps = np.concatenate([one.overlaps for one in self.draws])
        known = overlaps[~np.isnan(overlaps)]
        return float(known.mean()) if len(known) else math.nan


def ladder_rows(measured: Iterable[MeasuredRung]) -> list[LadderRow]:
    """Returns a row for each rung, method and gate; `none` is a map's first."""
    groups: dict[tuple[LadderRung, str, bool], list[RungOutcome]] = {}
    drives: dict[LadderRung, list[str]] = {}
    for one in measured:
        drives.setdefault(one.rung, []).append(one.drives)
        for outcome in one.outcomes:
            key = one.rung, outcome.method, outcome.is_gated
            groups.setdefault(key, []).append(outcome)
    none: dict[tuple[str, str, bool], list[RungOutcome]] = {}
    rows = []
    for (rung, method, is_gated), draws in groups.items():
        unchanged = none.setdefault((rung.map_name, method, is_gated), draws)
        drawn = fingerprint({"drives": drives[rung]})
        rows.append(_row(rung, drawn, unchanged, draws))
    return rows


def _row(
    rung: LadderRung,
    drives: str,
    unchanged: Sequence[RungOutcome],
    draws: Sequence[RungOutcome],
) -> LadderRow:
    num_queries = len(draws[0].outcomes)
    weights = metrics.resampled_weights(
        num_queries, blocks=draws[0].outcomes.blocks
    )
    samples = _sampled_auc(draws, weights)
    share = metrics.UNKNOWN
    if len(unchanged[0].outcomes) == num_queries:
        before = _sampled_auc(unchanged, weights)
        share = metrics.percentile_interval(kept_share(samples, before))
    none, changed = (
        float(np.mean([metrics.pr_curve(one.outcomes).auc for one in outcomes]))
        for outcomes in (unchanged, draws)
    )
    return LadderRow(
        rung,
        drives,
        draws,
        unchanged,
        metrics.percentile_interval(samples),
        Kept(none, changed, share),
    )


def _sampled_auc(
    draws: Sequence[RungOutcome], weights: np.ndarray
) -> np.ndarray:
    """Returns the mean AUC over draws, of samples of the queries."""
    return np.mean(
        [metrics.resampled_metrics(one.outcomes, weights)[0] for one in draws],
        axis=0,
    )


class _Answers(NamedTuple):
    """The answers of a method to the queries on a rung, in one draw."""

    rung: LadderRung
    seed: int
    outcome: RungOutcome


# Columns of what has a `LadderRung`.
RUNG_COLUMNS: Columns[Any] = {
    "map": attrgetter("rung.map_name"),
    "db": attrgetter("rung.database"),
    "query": attrgetter("rung.query"),
    "cause": attrgetter("rung.cause"),
    "level": attrgetter("rung.level"),
}


def _keys(path: str = "") -> Columns[Any]:
    """Returns the first columns; the path leads to method and gate."""
    return {
        **RUNG_COLUMNS,
        "method": attrgetter(f"{path}method"),
        "gate": attrgetter(f"{path}is_gated"),
    }


_ROW_COLUMNS: Columns[LadderRow] = {
    **_keys(),
    "auc": lambda row: row.kept.changed,
    "r1": lambda row: row.mean(lambda one: one.outcomes.recall_at(1)),
    "kept": lambda row: row.kept.share,
    "kept_low": lambda row: row.kept.interval.low,
    "kept_high": lambda row: row.kept.interval.high,
    "auc_low": lambda row: row.auc_interval.low,
    "auc_high": lambda row: row.auc_interval.high,
    "auc_none": lambda row: row.kept.unchanged,
    "queries": lambda row: len(row.outcomes),
    "with_match": lambda row: int(row.outcomes.has_match.sum()),
    "places": lambda row: row.outcomes.num_places,
    "draws": lambda row: len(row.draws),
    "drives": lambda row: row.drives,
    "lost": lambda row: row.mean_turned(is_right=False),
    "found": lambda row: row.mean_turned(is_right=True),
    "hidden": lambda row: row.mean(lambda one: one.num_hidden),
    "overlap": lambda row: row.mean_overlap(),
    **keyed(
        {name: name for name in FAULTS},
        lambda row, name: row.mean(
            lambda one: one.faults(row.rung.radius).count(name)
        ),
    ),
    "strength": lambda row: row.rung.strength,
    "radius": lambda row: row.rung.radius,
}
_ANSWER_COLUMNS: Columns[_Answers] = {
    **_keys("outcome."),
    "seed": lambda a: a.seed,
    "query_frame": lambda a: a.outcome.query_frames,
    "query_stamp_ns": lambda a: a.outcome.stamps_ns,
    "query_x": lambda a: a.outcome.p_WQs[:, 0],
    "query_y": lambda a: a.outcome.p_WQs[:, 1],
    "query_z": lambda a: a.outcome.p_WQs[:, 2],
    "correct": lambda a: a.outcome.outcomes.is_right,
    "has_match": lambda a: a.outcome.outcomes.has_match,
    "score": lambda a: a.outcome.outcomes.best_scores,
    "first_right_rank": lambda a: a.outcome.outcomes.known_ranks,
    "why": lambda a: a.outcome.faults(a.rung.radius),
    "match_drive": lambda a: a.outcome.match_drives,
    "match_frame": lambda a: [
        frame if frame >= 0 else None
        for frame in a.outcome.match_frames.tolist()
    ],
    "distance": lambda a: a.outcome.distances,
    "translation_error": lambda a: a.outcome.pose_errors.translation,
    "rotation_error_deg": lambda a: a.outcome.pose_errors.rotation_deg,
    "overlap": lambda a: a.outcome.overlaps,
    "visible_change": lambda a: 1.0 - a.outcome.overlaps,
}


def ladder_table(
    rows: Iterable[LadderRow], protocol: RetrievalProtocol, viewpoint: str
) -> Table:
    """Returns one row for each rung, method and gate.

    The viewpoint names the place of the database beside the queries.
    """
    options: Columns[LadderRow] = keyed(
        {name: name for name in _OPTIONS},
        lambda row, name: getattr(protocol, name),
    )
    options = {
        **options,
        "viewpoint": lambda _: viewpoint,
        "protocol": lambda _: protocol.name,
        "auc_strict": lambda row: row.mean(_strict_auc),
    }
    return Table.of(rows, {**_ROW_COLUMNS, **options})


def _strict_auc(one: RungOutcome) -> float:
    number = int(one.outcomes.has_match.sum())
    return metrics.pr_curve(one.outcomes).strict_auc(number)


def strongest_causes(rows: Sequence[LadderRow]) -> list[str]:
    """Returns the causes, that which leaves the least share of AUC first.

    Means over maps and methods count, without the gate, at the strongest level
    of each cause.
    """
    shares: dict[str, list[float]] = {}
    for row in _strongest(rows).values():
        if not (row.is_gated or math.isnan(row.kept.share)):
            shares.setdefault(row.rung.cause, []).append(row.kept.share)
    means = {cause: float(np.mean(kept)) for cause, kept in shares.items()}
    return sorted(means, key=lambda cause: (means[cause], cause))


@dataclass(frozen=True)
class CrossedRow:
    """A method under two causes at once, and under each alone.

    The excess is what the two cost together beyond the product of what each
    leaves, as a share of the AUC on the rung `none`. Its 95 % interval is from
    the same samples of queries.
    """

    pair: LadderRow
    alone: tuple[LadderRow, LadderRow]
    excess: float
    interval: metrics.Interval

    @property
    def is_more(self) -> bool:
        """Whether both cost more than the two alone, beyond doubt."""
        return self.interval.low > 0.0


def crossed_rows(
    rows: Sequence[LadderRow], pairs: Iterable[LadderRow]
) -> list[CrossedRow]:
    """Compares pairs of causes, with names joined by "+", with each alone."""
    strongest = _strongest(rows)
    found = []
    for pair in pairs:
        drive = pair.rung.map_name, pair.method, pair.is_gated
        one, other = (
            strongest[(*drive, cause)] for cause in pair.rung.cause.split("+")
        )
        draws = (pair.unchanged, one.draws, other.draws, pair.draws)
        weights = metrics.resampled_weights(
            len(pair.outcomes), blocks=pair.outcomes.blocks
        )
        interval = metrics.UNKNOWN
        if len({len(part[0].outcomes) for part in draws}) == 1:
            none, *kept = (_sampled_auc(part, weights) for part in draws)
            first, second, both = (kept_share(part, none) for part in kept)
            interval = metrics.percentile_interval(first * second - both)
        excess = one.kept.share * other.kept.share - pair.kept.share
        found.append(CrossedRow(pair, (one, other), excess, interval))
    return found


def pair_table(rows: Sequence[LadderRow], pairs: Iterable[LadderRow]) -> Table:
    """Returns a row for each pair of causes, method and gate."""
    keys: Columns[CrossedRow] = keyed(
        {
            name: value
            for name, value in _keys().items()
            if name not in ("cause", "level")
        },
        lambda crossed, value: value(crossed.pair),
    )
    return Table.of(
        crossed_rows(rows, pairs),
        {
            **keys,
            "cause_a": lambda crossed: crossed.alone[0].rung.cause,
            "cause_b": lambda crossed: crossed.alone[1].rung.cause,
            "kept_a": lambda crossed: crossed.alone[0].kept.share,
            "kept_b": lambda crossed: crossed.alone[1].kept.share,
            "kept": lambda crossed: crossed.pair.kept.share,
            "excess": lambda crossed: crossed.excess,
            "excess_low": lambda crossed: crossed.interval.low,
            "excess_high": lambda crossed: crossed.interval.high,
            "more": lambda crossed: crossed.is_more,
        },
    )


def pair_text(rows: Sequence[LadderRow], pairs: Iterable[LadderRow]) -> str:
    """Returns the pairs that cost more than both causes alone, as a list."""
    crossed = [
        one for one in crossed_rows(rows, pairs) if not one.pair.is_gated
    ]
    lines = [
        f"Two causes at once, without the gate. {len(crossed)} pairs of causes"
        " and methods; together they cost more than the product of what each"
        " leaves (95 % intervals) in these:"
    ]
    for one in sorted(crossed, key=lambda one: -one.excess):
        if one.is_more:
            first, second = one.alone
            lines.append(
                f"{one.pair.rung.map_name.capitalize()},"
                f" {title(one.pair.method)}: {_cause(first)}"
                f" ({_percent(first.kept.share)} kept) and {_cause(second)}"
                f" ({_percent(second.kept.share)}) leave {_kept(one.pair)}."
            )
    if len(lines) == 1:
        lines.append("None.")
    return "\n- ".join(lines)


def ladder_query_table(
    measured: Iterable[MeasuredRung], protocol: RetrievalProtocol
) -> Table:
    """Returns one row for each rung, draw, method, gate and query."""
    answers = (
        _Answers(one.rung, one.seed, outcome)
        for one in measured
        for outcome in one.outcomes
    )
    named: Columns[_Answers] = {"protocol": lambda answers: protocol.name}
    return Table.of(answers, {**_ANSWER_COLUMNS, **named})


def ladder_text(rows: Sequence[LadderRow]) -> str:
    """Returns the findings of each map: a heading and a list."""
    maps = dict.fromkeys(row.rung.map_name for row in rows)
    return "\n\n".join(
        _findings([row for row in rows if row.rung.map_name == name])
        for name in maps
    )


def _findings(rows: Sequence[LadderRow]) -> str:
    first = rows[0].rung
    heading = (
        f"{first.map_name.capitalize()}, {len(rows[0].outcomes)} queries of"
        f" drive {first.query}. What each cause of change, at its strongest"
        " level, leaves of the AUC without a change (without the gate, 95 %"
        " intervals):"
    )
    strongest = _strongest(rows).values()
    ungated, gated = (
        [row for row in strongest if row.is_gated == is_gated]
        for is_gated in (False, True)
    )
    lines = [
        _loss([row for row in ungated if row.method == method])
        for method in in_table_order(row.method for row in ungated)
    ]
    if any(lines):
        lines += [_mildest(ungated), *_differences(ungated, gated)]
    return "\n- ".join((heading, *filter(None, lines)))


def _loss(rows: Sequence[LadderRow]) -> str:
    """Returns the losses of one method; "" if its AUC without a change is 0."""
    known = {
        row.rung.cause: row for row in rows if not math.isnan(row.kept.share)
    }
    together = known.pop(_ALL, None)
    known.pop(_NONE, None)
    parts = []
    if known:
        worst = min(known.values(), key=lambda row: row.kept.share)
        parts.append(
            f"keeps {_kept(worst)} even under its worst cause"
            if worst.kept.share >= _MUCH
            else f"loses most by {_cause(worst)} ({worst.rung.strength}), which"
            f" leaves {_kept(worst)}"
        )
    if together is not None:
        parts.append(f"keeps {_kept(together)} under all causes together")
    return f"{title(rows[0].method)} {', and '.join(parts)}." if parts else ""


def _mildest(rows: Sequence[LadderRow]) -> str:
    """Returns the causes that cost no method much."""
    shares: dict[str, list[float]] = {}
    for row in rows:
        is_single = row.rung.cause not in (_NONE, _ALL)
        if is_single and not math.isnan(row.kept.share):
            shares.setdefault(_cause(row), []).append(row.kept.share)
    if not shares:
        return ""
    mild = [name for name, kept in shares.items() if min(kept) >= _MUCH]
    if not mild:
        return (
            f"Under each cause some method keeps less than {_percent(_MUCH)}."
        )
    return (
        f"Every method keeps {_percent(_MUCH)} or more under {', '.join(mild)}."
    )


def _differences(
    ungated: Sequence[LadderRow], gated: Sequence[LadderRow]
) -> Iterator[str]:
    """Yields what the gate changes."""
    before = {(row.rung.cause, row.method): row for row in ungated}
    much, other = f"{100.0 * _DIFFERENT:.0f} points", "nothing"
    for row in gated:
        one = before.get((row.rung.cause, row.method))
        if (
            one is not None
            and abs(row.kept.share - one.kept.share) >= _DIFFERENT
        ):
            other = "nothing else"
            yield (
                f"With the gate, {title(row.method)} under {_cause(row)} keeps"
                f" {_percent(row.kept.share)} instead of"
                f" {_percent(one.kept.share)}."
            )
    yield f"The gate changes {other} by {much} or more."


def _strongest(
    rows: Iterable[LadderRow],
) -> dict[tuple[str, str, bool, str], LadderRow]:
    """Returns (map, method, gate, cause) -> row of its strongest level."""
    found: dict[tuple[str, str, bool, str], LadderRow] = {}
    for row in rows:
        key = row.rung.map_name, row.method, row.is_gated, row.rung.cause
        if key not in found or found[key].rung.level < row.rung.level:
            found[key] = row
    return found


def _cause(row: LadderRow) -> str:
    cause = row.rung.cause
    return "all causes" if cause == _ALL else cause.replace("_", " ")


def _kept(row: LadderRow) -> str:
    low, high = row.kept.interval.low, row.kept.interval.high
    text = _percent(row.kept.share)
    if math.isnan(low):
        return text
    return f"{text} ({100.0 * low:.0f} to {100.0 * high:.0f})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


class CauseCell(NamedTuple):
    """One level of a cell of a figure of methods over causes.

    Each map has a line of two panels with different titles. The share, from 0
    to 1 or NaN for none, is the colour; the strongest level's label is shown.
    """

    map_name: str
    title: str
    method: str
    cause: str
    level: int
    share: float
    label: str


def draw_ladder(rows: Sequence[LadderRow], stem: Path) -> None:
    """Draws the share of the AUC without a change that each cause leaves.

    The numbers are in per cent. Without a change they are AUC itself.
    """
    cells = [
        CauseCell(
            row.rung.map_name,
            _TITLES[row.is_gated],
            row.method,
            row.rung.cause,
            row.rung.level,
            row.kept.share,
            _label(row),
        )
        for row in rows
    ]
    draw_cells(cells, "part of AUC that is kept", stem)


def draw_cells(cells: Sequence[CauseCell], meaning: str, stem: Path) -> None:
    """Draws methods over causes, two panels for each map.

    A cell has a strip for each level, the weakest at its left; the number is
    that of the strongest level.
    """
    maps = list(dict.fromkeys(cell.map_name for cell in cells))
    titles = dict.fromkeys(cell.title for cell in cells)
    methods = in_table_order(cell.method for cell in cells)
    causes = list(dict.fromkeys(cell.cause for cell in cells))
    size = (
        _EDGES[0] + 2 * _CELL_WIDTH * len(methods),
        len(maps) * (_EDGES[1] + _CELL_HEIGHT * len(causes)),
    )
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(maps), 2, squeeze=False, sharey=True)
    panels = itertools.product(maps, titles)
    for axes, panel in zip(grid.flat, panels, strict=True):
        of_panel = [one for one in cells if (one.map_name, one.title) == panel]
        _draw_panel(axes, of_panel, methods, causes)
        axes.set_title(plain(", ".join(panel)), fontsize=_FONT_SIZE + 1)
    bar = figure.colorbar(
        ScalarMappable(_SHARES, _COLOURS), ax=grid[:, 1], shrink=0.8, aspect=30
    )
    bar.set_label(meaning, fontsize=_FONT_SIZE)
    bar.ax.tick_params(labelsize=_FONT_SIZE)
    save(figure, stem)


def _draw_panel(
    axes: Axes,
    panel: Sequence[CauseCell],
    methods: Sequence[str],
    causes: Sequence[str],
) -> None:
    cells: dict[tuple[str, str], list[CauseCell]] = {}
    for cell in panel:
        cells.setdefault((cell.method, cell.cause), []).append(cell)
    for (method, cause), levels in cells.items():
        x, y = methods.index(method), causes.index(cause)
        levels.sort(key=lambda cell: cell.level)
        width = 1.0 / len(levels)
        for k, cell in enumerate(levels):
            share = cell.share
            colour = "lightgray" if math.isnan(share) else _COLOURS(share)
            axes.add_patch(
                Rectangle((x + k * width, y), width, 1.0, color=colour, lw=0)
            )
        share = levels[-1].share
        is_light = math.isnan(share) or _LIGHT[0] < share < _LIGHT[1]
        axes.text(
            x + 0.5,
            y + 0.5,
            levels[-1].label,
            ha="center",
            va="center",
            color="black" if is_light else "white",
            fontsize=_FONT_SIZE,
        )
    axes.set(xlim=(0, len(methods)), ylim=(len(causes), 0))
    axes.set_xticks(
        [k + 0.5 for k in range(len(methods))],
        [plain(title(method)) for method in methods],
        fontsize=_FONT_SIZE,
    )
    axes.set_yticks(
        [k + 0.5 for k in range(len(causes))],
        [plain(cause.replace("_", " ")) for cause in causes],
        fontsize=_FONT_SIZE,
    )
    axes.tick_params(length=0)
    for k in range(1, len(methods)):
        axes.axvline(k, color="white", linewidth=2)
    for k in range(1, len(causes)):
        axes.axhline(k, color="white", linewidth=2)
    axes.spines[:].set_visible(False)


def _label(row: LadderRow) -> str:
    if row.rung.level == 0:
        return f"AUC {row.kept.changed:.2f}"
    share = row.kept.share
    return "–" if math.isnan(share) else f"{100.0 * share:.0f}"
