"""Four kinds of charts, each described by a mapping in an experiment's file.

- `dumbbell` (`over`, `metric`): a metric at the first and the last value of a
  factor.
- `lines` (`over`, `metric`): a metric over a numeric factor, with a band from
  the least to the greatest result of a single seed.
- `matrix` (`over`, `metric`, `strips`): a metric for each method and each value
  of a factor. With `strips`, each cell is divided by the values of a second
  factor. A retained share is bold if its 95 % interval lies below 1.
- `scatter` (`x`, `y`): a metric over a metric or a numeric factor, with a
  smooth curve and its 95 % band where there are enough points.

The names in brackets are keys of the mapping; `kind` names the kind of chart.
All other keys select rows: each is a column of the table with the values to
show. By default, the task is `place`, or else the only task with the metric,
and `gate` is 0 (without geometric verification). Each method has the same
colour in all charts. The title says in words what the chart shows. If the
answers to all queries are known, the title also says which methods differ by
the test of `evaluation.recognition.metrics`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import math
import re
import textwrap
from typing import Any, TypeVar

from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
import numpy as np

from cns_drake.base.errors import InputError
from evaluation.recognition.place_numbers import kept_share
from evaluation.results.drawing import METHOD_STYLES, escape_dollars
from evaluation.results.headlines import (
    from_least_to_greatest,
    greatest_auc,
    listed,
)
from evaluation.results.ranges import checked, range_of
from evaluation.results.smoothing import curves
from evaluation.results.summaries import (
    LEAST_POINTS,
    correlations,
    means,
    median_kept,
    paired_values,
)
from evaluation.results.table import (
    CAUSE,
    COSTS,
    LAST,
    OWN,
    SETTINGS,
    STAGE,
    Answers,
    QueryRows,
    Results,
    Row,
)
from evaluation.results.table_forms import in_table_order, title

_Measured = TypeVar("_Measured", Row, Answers)
# Width of a chart on a screen [px].
WIDE = 860
# Width of a chart on a phone [px].
NARROW = 358
# A pixel of a page [inches].
_PX = 1.0 / 96.0
# [pt]; more than 12 px, on a phone of 360 px as well.
_FONT = 10.0
_ROW = 22.0
_BELOW = 220.0
# Width for a name in a legend [px].
_LEGEND_COLUMN = 220
# Styles of methods that are not shipped; the first are those of reports.
_OTHERS = (
    ("#000000", "-.", "X"),
    ("#8C564B", ":", "p"),
    ("#882255", "-", "<"),
    ("#44AA99", "--", ">"),
    ("#999933", "-.", "h"),
    ("#6F6F6F", ":", "*"),
)
# Metrics and factors in words.
_IN_WORDS = {
    "auc": "AUC",
    "auc_strict": "AUC strict",
    "r1": "R@1",
    "kept": "retained share",
    "tcr_sym": "TCR_sym",
    "miou": "mean IoU",
    "visible_change_added": "visible change without parallax",
    "query_time": "time of a query [s]",
    "build_time": "time to build the database [s]",
    "memory": "memory of the descriptors [bytes]",
    "success_03m_1deg": "success within 0.3 m and 1 deg",
    "success_2m_5deg": "success within 2 m and 5 deg",
    "protocol.turn_queries": "random yaw",
}
# The sign of per cent never begins a line.
_PERCENT = "{:.0f}\N{NO-BREAK SPACE}%"
# Values of the factor `both.stage`, in words.
_STAGES = {LAST: "without the change", OWN: "with the change"}
# Causes in words, where these differ from the values in tables.
_CAUSES = {
    "hidden": "occluded sector",
    "lateral": "lateral offset",
    "turn": "random yaw",
}
# Told apart by all kinds of colour vision, and light enough for letters.
_COLOURS = LinearSegmentedColormap.from_list(
    "shares", colormaps["RdYlBu"](np.linspace(0.15, 0.8, 64))
)
# Height of the titles and the caption of a matrix [px].
_CAPTIONS = 130.0
# Height of a letter of a slanted name [px].
_LETTER = 6.0
# Characters in a line of a method's name below a chart.
_NAME_WIDTH = 32
# Columns that say which drives are compared.
_PAIR = ("map", "database", "query")
# Beyond this ratio of its values, an axis is logarithmic.
_WIDE_RANGE = 50.0


@dataclass(frozen=True)
class Drawn:
    """A chart.

    Attributes:
        message: sentence that says what the chart shows.
        figure: the drawing.
        legend: name -> colour, line style (empty if no line has this name) and
            marker; the mapping is empty if the drawing itself contains the
            names.
    """

    message: str
    figure: Figure
    legend: Mapping[str, tuple[str, str, str]]


@dataclass(frozen=True)
class _Chart:
    """The inputs from which a chart is drawn."""

    keys: Mapping[str, str]
    results: Results
    rows: Sequence[Row]
    styles: Mapping[str, tuple[str, str, str]]
    width: int
    queries: QueryRows | None

    def tested(self, message: str, last: object) -> str:
        """Adds to a message which methods differ at the last value."""
        if self.metric != "auc":
            return message
        rows = [row for row in self.rows if row[self.keys["over"]] == last]
        clause = greatest_auc(rows, self.queries)
        return f"{message}; {clause}" if clause else message

    @property
    def metric(self) -> str:
        return self.keys.get("metric", self.keys.get("y", ""))

    @property
    def panes(self) -> dict[str, list[Row]]:
        """Title of each panel -> its rows.

        There is one panel per map. If the chart itself compares maps (`over` is
        `map`), it has a single panel without a title.
        """
        found: dict[str, list[Row]] = {}
        for row in self.rows:
            name = "" if self.keys.get("over") == "map" else row.map
            found.setdefault(name, []).append(row)
        return found

    def panels(self, height: float) -> tuple[Figure, list[Axes]]:
        """Returns a figure and its panels, which have a given height [px]."""
        panes = self.panes
        columns = 1 if self.width < WIDE else min(2, len(panes))
        lines = math.ceil(len(panes) / columns)
        figure = self.figure(lines * height)
        grid = figure.subplots(lines, columns, squeeze=False, sharey=True)
        for axes in grid.flat[len(panes) :]:
            axes.axis("off")
        for axes, name in zip(grid.flat, panes, strict=False):
            axes.set_title(escape_dollars(name), loc="left")
        return figure, list(grid.flat[: len(panes)])

    def figure(self, height: float) -> Figure:
        size = self.width * _PX, height * _PX
        return Figure(figsize=size, layout="constrained")


def draw(
    chart: Mapping[str, Any],
    results: Results,
    width: int = WIDE,
    *,
    alone: bool = False,
    queries: QueryRows | None = None,
) -> Drawn:
    """Returns a chart, drawn from a table of results.

    Args:
        chart: description of the chart, as in an experiment's file.
        results: the table.
        width: width of the drawing [px].
        alone: whether the drawing is shown without a page, and therefore
            includes its message and legend.
        queries: the answers from which the table was made, for the message on
            significant differences; None if they are unknown.

    Raises:
        InputError: the chart has an unknown kind or column, or selects no rows.
    """
    keys = check(chart)
    if names_of := _file_names(results.rows):
        results = Results.of(_renamed(results.rows, names_of))
        if queries is not None:
            queries = QueryRows.of(_renamed(queries.answers, names_of))
    kind = chart["kind"]
    metric = keys.get("metric", keys.get("y"))
    chosen = {n: v for n, v in chart.items() if n != "kind" and n not in keys}
    for name in (*chosen, *(keys[n] for n in keys if n in ("over", "strips"))):
        if not any(row[name] is not None for row in results.rows):
            raise InputError(f"charts: {kind}: {name}: the table has none")
    tasks = results.where(metric=metric).distinct("task")
    task = "place" if "place" in tasks else tasks[:1]
    chosen = {"task": task, "gate": 0, **chosen}
    rows = results.where(chosen, metric=metric).rows
    rows = tuple(row for row in rows if not math.isnan(row.value))
    if not rows:
        raise InputError(f"charts: {kind}: the table has no {metric} like that")
    names = in_table_order(row.label for row in rows)
    drawn = _Chart(keys, results, rows, styles(names), width, queries)
    with rc_context({"font.size": _FONT, "axes.titlesize": "medium"}):
        message, figure = _KINDS[kind][0](drawn)
        legend = {}
        if kind in ("lines", "scatter"):
            legend = _legend(figure, drawn.styles)
        if alone:
            figure.suptitle(escape_dollars(textwrap.fill(message, width // 9)))
        if alone and legend:
            handles = []
            for one, (colour, style, marker) in legend.items():
                options: dict = {"linestyle": style, "marker": marker}
                options["label"] = escape_dollars(one)
                handles.append(Line2D([], [], color=colour, **options))
            columns = max(1, width // _LEGEND_COLUMN)
            lines = math.ceil(len(handles) / columns)
            figure.set_figheight(figure.get_figheight() + lines * _ROW * _PX)
            figure.legend(
                handles=handles, loc="outside lower center", ncols=columns
            )
    return Drawn(message, figure, legend)


def _file_names(rows: Sequence[Row]) -> dict[tuple[str, object], str]:
    """Returns settings of methods that name files, without their folders.

    Paths are too long for a chart. If two paths of a table end alike, all paths
    stay whole.

    Returns:
        (Column, value) -> the value without folders; empty if nothing changes.
    """
    found = {
        (name, value): re.sub(r"[^\s\"',\[\]]*/", "", value)
        for row in rows
        for name, value in row.factors.items()
        if name.startswith(SETTINGS) and isinstance(value, str)
    }
    different = {(name, short) for (name, _), short in found.items()}
    if len(different) < len(found):
        return {}
    return {key: short for key, short in found.items() if key[1] != short}


def _renamed(
    items: Iterable[_Measured], names_of: Mapping[tuple[str, object], str]
) -> list[_Measured]:
    return [
        replace(
            one,
            factors={
                name: names_of.get((name, value), value)
                for name, value in one.factors.items()
            },
        )
        for one in items
    ]


def _legend(
    figure: Figure, looks: Mapping[str, tuple[str, str, str]]
) -> dict[str, tuple[str, str, str]]:
    """Returns the looks of methods, without a line style if none is drawn."""
    with_line = {
        line.get_color()
        for axes in figure.axes
        for line in axes.get_lines()
        if line.get_linestyle() != "None"
    }
    return {
        name: (colour, style if colour in with_line else "", marker)
        for name, (colour, style, marker) in looks.items()
    }


def check(chart: Mapping[str, Any]) -> dict[str, str]:
    """Checks the description of a chart before there are results.

    Returns:
        The fields of the description that this kind of chart uses.

    Raises:
        InputError: the kind is unknown, or the description lacks a key.
    """
    kind = chart.get("kind")
    if not isinstance(kind, str) or kind not in _KINDS:
        raise InputError(
            f"charts: kind: {kind!r} is none of {', '.join(_KINDS)}"
        )
    _, needed, optional = _KINDS[kind]
    keys = {n: chart[n] for n in (*needed, *optional) if n in chart}
    for name in (*needed, *keys):
        if not isinstance(keys.get(name), str):
            raise InputError(f"charts: {kind}: {name}: a name is needed")
    return keys


def styles(labels: Sequence[str]) -> dict[str, tuple[str, str, str]]:
    """Returns the colour, line style and marker of each method in charts.

    Args:
        labels: names of the methods, with their settings.

    Returns:
        Method as written in the legend (see `title`) -> the three values.
    """
    others = [name for name in labels if name not in METHOD_STYLES]
    return {
        title(name): METHOD_STYLES.get(name)
        or _OTHERS[others.index(name) % len(_OTHERS)]
        for name in labels
    }


def in_words(name: str) -> str:
    """Returns the name of a metric or a factor in words."""
    return _IN_WORDS.get(name, name.rpartition(".")[2].replace("_", " "))


def _dumbbell(chart: _Chart) -> tuple[str, Figure]:
    over = chart.keys["over"]
    values = chart.results.distinct(over)
    if len(values) < 2:
        raise InputError(f"charts: dumbbell: {over}: the table has one value")
    before, after = values[0], values[-1]
    found = {
        (title(one.key[0]), *one.key[1:]): one.value
        for one in means(chart.rows, "label", *_PAIR, over)
    }
    ends_of = [
        {key[1:4]: None for key in found if key[4] == v}
        for v in (before, after)
    ]
    pairs = [pair for pair in ends_of[0] if pair in ends_of[1]]
    of_map = Counter(name for name, *_ in pairs)
    places: list[tuple[str, float]] = []
    kept: dict[str, list[float]] = {}
    figure = chart.figure((len(chart.styles) * (len(pairs) + 1) + 3) * _ROW)
    axes = figure.subplots()
    for name, (colour, _, marker) in chart.styles.items():
        places.append((name, len(places)))
        for pair in pairs:
            y = float(len(places))
            label = pair[0]
            if of_map[label] > 1:
                ways = (n.removeprefix(f"{label}_") for n in pair[1:])
                label = f"{label} {' → '.join(ways)}"
            places.append((label, y))
            ends = [
                found.get((name, *pair, v), math.nan) for v in (before, after)
            ]
            axes.plot(ends, [y, y], color=colour, lw=2.5, alpha=0.5)
            axes.plot(ends[0], y, marker, color=colour, mfc="white", ms=7)
            axes.plot(ends[1], y, marker, color=colour, ms=7)
            share = float(kept_share(ends[1], ends[0]))
            kept.setdefault(name, []).append(share)
            if not math.isnan(share):
                side = axes.get_yaxis_transform()
                text = f"{100.0 * share:.0f} %"
                axes.text(1.02, y, text, transform=side, va="center")
    axes.set_yticks(
        [y for _, y in places], [escape_dollars(one) for one, _ in places]
    )
    for label in axes.get_yticklabels():
        if label.get_text() in map(escape_dollars, chart.styles):
            label.set_fontweight("bold")
    axes.set_ylim(len(places) - 0.4, -0.7)
    first, last = (
        value_words(v, over)
        if over == STAGE
        else f"at {in_words(over)} {value_words(v)}"
        for v in (before, after)
    )
    text = f"{in_words(chart.metric)} {first} (hollow) and {last} (filled)"
    text = textwrap.fill(text, chart.width // 9)
    figure.supxlabel(escape_dollars(text), fontsize=_FONT)
    axes.grid(axis="x", alpha=0.3)
    axes.tick_params(length=0)
    _start_at_zero(axes, x=chart.metric)
    shares = {name: 100.0 * median_kept(kept[name]) for name in kept}
    number = f"median of {len(pairs)} pairs" if len(pairs) > 1 else "one pair"
    message = (
        f"Share of the {in_words(chart.metric)} that is retained, {number}:"
        f" {from_least_to_greatest(shares, _PERCENT)}"
    )
    return chart.tested(message, after), figure


def _lines(chart: _Chart) -> tuple[str, Figure]:
    over = chart.keys["over"]
    figure, panels = chart.panels(280.0)
    last: dict[str, list[float]] = {}
    at = sorted({_number(row, over) for row in chart.rows})
    for axes, rows in zip(panels, chart.panes.values(), strict=True):
        for label, (colour, style, marker) in chart.styles.items():
            some = [row for row in rows if title(row.label) == label]
            points = sorted(means(some, over), key=lambda one: one.key)
            x = [one.key[0] for one in points]
            y, low, high = (
                [getattr(one, end) for one in points]
                for end in ("value", "least", "greatest")
            )
            axes.fill_between(x, low, high, color=colour, alpha=0.15, lw=0)
            axes.plot(x, y, linestyle=style, marker=marker, color=colour, ms=5)
            if x[-1:] == at[-1:]:
                last.setdefault(label, []).append(y[-1])
        _spread_axis(axes, at)
        if chart.metric in COSTS:
            axes.set_yscale("log")
        else:
            _start_at_zero(axes, y=chart.metric)
        axes.grid(alpha=0.3)
        # A label of the whole figure would lie below its legend.
        axes.set_xlabel(escape_dollars(in_words(over)))
    figure.supylabel(escape_dollars(in_words(chart.metric)), fontsize=_FONT)
    found = {name: float(np.mean(some)) for name, some in last.items()}
    message = (
        f"{in_words(chart.metric)} at {at[-1]:g} {in_words(over)}:"
        f" {from_least_to_greatest(found)}"
    )
    return chart.tested(message, at[-1]), figure


def _number(row: Row, column: str) -> float:
    value = row[column]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"charts: {column}: {value!r} is no number")
    return float(value)


def _spread_axis(axes: Axes, at: Sequence[float]) -> None:
    """Makes the x axis logarithmic if its values span a wide range."""
    above = [one for one in at if one > 0.0]
    if min(at) >= 0.0 and above and max(above) / min(above) > _WIDE_RANGE:
        axes.set_xscale("symlog", linthresh=min(above))
        axes.set_xticks(list(at), [f"{one:g}" for one in at])
        axes.minorticks_off()


def _start_at_zero(axes: Axes, x: str = "", y: str = "") -> None:
    """Makes axes start at 0 whose metric cannot be negative.

    Args:
        axes: a panel in which everything is drawn.
        x, y: name of what the axis shows; empty for an axis that stays.
    """
    limits = [range_of(name) for name in (x, y)]
    is_least = [limit is not None and limit.least == 0.0 for limit in limits]
    # Markers at 0 are whole.
    axes.update_datalim([(0.0, 0.0)], *is_least)
    axes.autoscale_view()


def _matrix(chart: _Chart) -> tuple[str, Figure]:
    over = chart.keys["over"]
    strips = chart.keys.get("strips")
    values = list(dict.fromkeys(row[over] for row in chart.rows))
    names = list(chart.styles)
    below = [textwrap.fill(name, _NAME_WIDTH) for name in names]
    longest = max(len(line) for name in below for line in name.split("\n"))
    # Names of methods and the caption stand below.
    height = max(_BELOW, _CAPTIONS + _LETTER * longest)
    figure, panels = chart.panels(height + len(values) * _ROW)
    weakest: list[tuple[float, str, str]] = []
    most = 1
    columns = "label", over, strips or over
    # What of a retained share is told from 1.
    losses = {
        (row.map, *(row[name] for name in columns))
        for row in chart.rows
        if chart.metric.startswith("kept") and row.high < 1.0
    }
    for axes, rows in zip(panels, chart.panes.values(), strict=True):
        cells: dict[tuple[int, int], list[tuple[Any, float, bool]]] = {}
        for mean in means(rows, *columns):
            x = names.index(title(mean.key[0]))
            is_loss = mean.number == 1 and (rows[0].map, *mean.key) in losses
            value = checked(chart.metric, mean.value)
            cell = cells.setdefault((x, values.index(mean.key[1])), [])
            cell.append((mean.key[2], value, is_loss))
        for (x, y), some in cells.items():
            _, shares, are_losses = zip(*sorted(some, key=_level), strict=True)
            for k, share in enumerate(shares):
                axes.add_patch(
                    Rectangle(
                        (x + k / len(shares), y),
                        1.0 / len(shares),
                        1.0,
                        color=_COLOURS(min(share, 1.0)),
                        lw=0,
                    )
                )
            text = f"{100.0 * shares[-1]:.0f}"
            weight = "bold" if are_losses[-1] else "normal"
            axes.text(
                x + 0.5, y + 0.5, text, weight=weight, ha="center", va="center"
            )
            most = max(most, len(shares))
            worst = value_words(values[y], over)
            if not isinstance(values[y], str) or over == "map":
                worst = f"{in_words(over)} {worst}"
            weakest.append((shares[-1], names[x], worst))
        axes.set(xlim=(0, len(names)), ylim=(len(values), 0))
        middles = np.arange(len(names)) + 0.5
        axes.set_xticks(
            middles,
            [escape_dollars(name) for name in below],
            rotation=45,
            ha="right",
        )
        for label in axes.get_xticklabels():
            label.set_rotation_mode("anchor")
        axes.set_yticks(
            np.arange(len(values)) + 0.5,
            [escape_dollars(value_words(v, over)) for v in values],
        )
        axes.tick_params(length=0)
        axes.vlines(range(1, len(names)), 0, len(values), "white", lw=2)
        axes.hlines(range(1, len(values)), 0, len(names), "white", lw=2)
        axes.spines[:].set_visible(False)
    text = f"{in_words(chart.metric)} in per cent"
    if strips is not None and most > 1:
        text += (
            f"; a strip for each value of {in_words(strips)}, the number is of"
            " the last"
        )
    if losses:
        text += "; bold where its 95 % interval lies below 100"
    text = textwrap.fill(text, chart.width // 8)
    figure.supxlabel(escape_dollars(text), fontsize=_FONT)
    share, name, worst = min(weakest)
    message = f"Least {in_words(chart.metric)}: {share:.2f}"
    number = sum(f"{one:.2f}" == f"{share:.2f}" for one, *_ in weakest)
    if number > 1:
        return f"{message}, in {number} of {len(weakest)} cells", figure
    return f"{message} ({name}; {worst})", figure


def _level(cell: tuple[Any, float, bool]) -> tuple[bool, Any]:
    return isinstance(cell[0], str), cell[0]


def value_words(value: object, factor: str = "") -> str:
    """Returns the value of a factor in words; lists have no brackets."""
    if factor == STAGE:
        return _STAGES.get(str(value), str(value))
    if factor == CAUSE and value in _CAUSES:
        return _CAUSES[str(value)]
    if isinstance(value, float):
        return f"{value:g}"
    text = re.sub(r"[\[\]]", "", str(value).replace("_", " "))
    return re.sub(r",(?! )", ", ", text)


def _scatter(chart: _Chart) -> tuple[str, Figure]:
    x_name, y_name = chart.keys["x"], chart.keys["y"]
    shown = {row.but() for row in chart.rows}
    points = [
        (row, at)
        for row, at in paired_values(chart.results, x_name, y_name)
        if row.but() in shown
    ]
    if not points:
        raise InputError(f"charts: scatter: no {y_name} has a {x_name}")
    figure = chart.figure(380.0)
    axes = figure.subplots()
    for label, (colour, style, marker) in chart.styles.items():
        known = sorted(
            (at, row.value) for row, at in points if title(row.label) == label
        )
        if not known:
            continue
        x, y = np.array(known).T
        few = len(x) < LEAST_POINTS
        size, alpha = (8.0, 0.9) if few else (5.0, 0.55)
        axes.plot(x, y, marker, color=colour, mew=0, ms=size, alpha=alpha)
        for one in curves(x, y):
            axes.fill_between(
                one.x, one.low, one.high, color=colour, alpha=0.18, lw=0
            )
            axes.plot(one.x, one.y, style, color=colour)
    axes.set(
        xlabel=escape_dollars(in_words(x_name)),
        ylabel=escape_dollars(in_words(y_name)),
    )
    _start_at_zero(axes, x=x_name, y=y_name)
    # On a phone there is room for a few numbers.
    axes.locator_params(axis="x", nbins=6)
    axes.grid(alpha=0.3)
    # The sign of a correlation with the metric itself, not with its failure.
    selected = Results.of(
        [row for row in chart.results.rows if row.metric != y_name]
        + list(chart.rows)
    )
    found = [
        one._replace(value=-one.value, low=-one.high, high=-one.low)
        for one in correlations(selected, x_name, y_name)
        if not math.isnan(one.value)
    ]
    message = f"{in_words(y_name)} over {in_words(x_name)}"
    if not found:
        number = len({row.but("method") for row, _ in points})
        if number < LEAST_POINTS:
            message += ", too few points for a trend"
        return message, figure
    shares = {title(one.method): one.value for one in found}
    text = from_least_to_greatest(shares, "{:+.2f}")
    names = f"{in_words(y_name)} with {in_words(x_name)}"
    message = f"Rank correlation of {names}: {text}"
    doubtful = [title(one.method) for one in found if one.low <= 0 <= one.high]
    if doubtful:
        message += (
            f"; not significantly different from 0 with {listed(doubtful)}"
        )
    return message, figure


# Kind -> how it is drawn, names that it needs, and others.
_KINDS: Mapping[
    Any,
    tuple[
        Callable[[_Chart], tuple[str, Figure]],
        tuple[str, ...],
        tuple[str, ...],
    ],
] = {
    "dumbbell": (_dumbbell, ("over", "metric"), ()),
    "lines": (_lines, ("over", "metric"), ()),
    "matrix": (_matrix, ("over", "metric"), ("strips",)),
    "scatter": (_scatter, ("x", "y"), ()),
}
