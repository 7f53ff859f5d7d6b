"""Charts of tables, and the page that shows them."""

from dataclasses import replace
from html.parser import HTMLParser
import math
import re
import warnings

from helpers.result_keys import place_key
import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.results import (
    PALE,
    Answers,
    PrintStyle,
    QueryRows,
    Results,
    Row,
    compare_tables,
    draw_chart,
    draw_comparison,
    draw_track,
    save_figure,
    summary_lines,
    write_page,
)

# Width of a chart on a screen and on a phone [px].
WIDE = 860
NARROW = 358
YEARS = "database.years"
PARTS = {"ring++": 0.9, "solid": 0.5, "mine": 0.7}


def row(value, factors, method="mine", metric="auc", town="town", **changes):
    key = place_key(town, factors=factors, method=method, **changes)
    return Row(**key, metric=metric, value=value)


def aged():
    """The parts fall by a hundredth a year, and differ by 0.02 of seeds."""
    return Results.of(
        row(part - 0.01 * year + 0.01 * seed, {YEARS: year}, name, seed=seed)
        for name, part in PARTS.items()
        for year in (0, 10, 30)
        for seed in (0, 2)
    )


def caused():
    return Results.of(
        row(
            1.0 - 0.1 * level * (name == "solid") * (cause == "parked_cars"),
            {"cause": cause, "level": level},
            name,
            "relative_auc",
        )
        for name in PARTS
        for cause, levels in (("none", (0,)), ("parked_cars", (1, 2, 4)))
        for level in levels
    )


def scattered(number=8):
    rows = []
    for k in range(number):
        version = {"database.version": k}
        rows.append(
            row(0.1 * k, version, "", "tcr_sym", task="change", protocol="")
        )
        rows += [row(0.9 - 0.1 * k, version, name) for name in ("a", "b")]
    return Results.of(rows)


def shown(message):
    return message.replace("\N{NO-BREAK SPACE}", " ")


def test_lines_have_means_and_bands():
    drawn = draw_chart(
        {"kind": "lines", "over": YEARS, "metric": "auc"}, aged()
    )
    (axes,) = drawn.figure.axes
    lines = [line.get_xydata() for line in axes.get_lines()]
    # RING++ and SOLiD, in the order of tables, then the others.
    expected = [PARTS[name] + 0.01 for name in ("solid", "ring++", "mine")]
    for line, part in zip(lines, expected, strict=True):
        assert line[:, 0].tolist() == [0, 10, 30]
        np.testing.assert_allclose(line[:, 1], part - np.array([0.0, 0.1, 0.3]))
    edges = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert edges.max() == pytest.approx(0.5 + 0.02)
    assert drawn.title == "AUC by years"
    assert list(drawn.legend) == ["SOLiD", "RING++", "mine"]
    assert len({colour for colour, _, _ in drawn.legend.values()}) == 3


def test_a_wide_range_is_logarithmic():
    rows = [
        row(0.9, {"database.distractors": number})
        for number in (0, 100, 10_000)
    ]
    chart = {"kind": "lines", "over": "database.distractors", "metric": "auc"}
    (axes,) = draw_chart(chart, Results.of(rows)).figure.axes
    assert axes.get_xscale() == "symlog"
    assert [tick.get_text() for tick in axes.get_xticklabels()] == [
        "0",
        "100",
        "10000",
    ]
    (axes,) = draw_chart(
        {"kind": "lines", "over": YEARS, "metric": "auc"}, aged()
    ).figure.axes
    assert axes.get_xscale() == "linear"


@pytest.mark.parametrize(("last", "whole"), [(3, True), (2.5, False)])
def test_ticks_of_whole_numbers_are_whole(last, whole):
    rows = [row(0.9, {"level": level}) for level in (0, 1, 2, last)]
    chart = {"kind": "lines", "over": "level", "metric": "auc"}
    (axes,) = draw_chart(chart, Results.of(rows)).figure.axes
    low, high = axes.get_xlim()
    ticks = [tick for tick in axes.get_xticks() if low <= tick <= high]
    assert len(ticks) >= 3
    assert all(tick == round(tick) for tick in ticks) is whole


def test_a_matrix_has_strips_and_the_last_number():
    chart = {
        "kind": "matrix",
        "over": "cause",
        "strips": "level",
        "metric": "relative_auc",
    }
    drawn = draw_chart(chart, caused())
    axes, _ = drawn.figure.axes
    # Three methods: one box without a cause; with one, three strips above it.
    assert len(axes.patches) == 3 * (1 + 1 + 3)
    said = drawn.figure.get_supxlabel()
    assert said.startswith("strips from the left: level 1, 2, 4; number: the")
    numbers = [text.get_text() for text in axes.texts]
    assert sorted(numbers) == ["100"] * 5 + ["60"]
    assert [t.get_text() for t in axes.get_yticklabels()] == [
        "none",
        "parked cars",
    ]
    assert drawn.title == "relative AUC by cause"
    assert not drawn.legend


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        (("/far/away/kitti.pth",), "mine, weights kitti.pth"),
        (("/far/kitti.pth", "/a/mulran.pth"), "mine, weights mulran.pth"),
        (('["/far/a.pth", "/far/b.pth"]',), 'mine, weights ["a.pth", "b.pth"]'),
        (("/far/kitti.pth", "/a/kitti.pth"), "mine, weights /a/kitti.pth"),
    ],
)
def test_long_settings_leave_room_for_the_matrix(tmp_path, values, shown):
    setting = "methods.mine.weights"
    results = Results.of(
        row(0.5, {"cause": cause, setting: value}, metric="r1")
        for value in values
        for cause in ("none", "age")
    )
    chart = {"kind": "matrix", "over": "cause", "metric": "r1"}
    drawn = draw_chart(chart, results, printed=PrintStyle())
    axes, _ = drawn.figure.axes
    names = [one.get_text() for one in axes.get_xticklabels()]
    assert shown in [name.replace("\n", " ") for name in names]
    assert max(len(line) for name in names for line in name.split("\n")) <= 32
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        save_figure(drawn.figure, tmp_path / "chart", ("png",))
    assert axes.get_window_extent().height > 40


@pytest.mark.parametrize(
    ("chart", "results", "starts"),
    [
        (
            {"kind": "lines", "over": YEARS, "metric": "auc"},
            aged().where(method="ring++"),
            "y",
        ),
        (
            {"kind": "dumbbell", "over": YEARS, "metric": "auc"},
            aged().where(method="ring++"),
            "x",
        ),
        (
            {"kind": "scatter", "x": "tcr_sym", "y": "auc"},
            Results.of(scattered().rows[6:]),
            "xy",
        ),
    ],
)
def test_axes_of_shares_start_at_0(chart, results, starts):
    (axes,) = draw_chart(chart, results).figure.axes
    for name, limits in (("x", axes.get_xlim()), ("y", axes.get_ylim())):
        if name in starts:
            # Markers at 0 are whole.
            assert -0.06 * limits[1] < limits[0] < 0.0


def test_axes_of_differences_keep_their_range():
    rows = [
        row(value, {YEARS: year}, metric="difference")
        for year, value in ((0, -0.5), (10, -0.4))
    ]
    chart = {"kind": "lines", "over": YEARS, "metric": "difference"}
    (axes,) = draw_chart(chart, Results.of(rows)).figure.axes
    assert axes.get_ylim()[1] < -0.3


def test_a_loss_that_is_certain_is_bold():
    ends = {"snow": (0.5, 0.9), "leaves": (0.5, 1.0), "fog": (math.nan,) * 2}
    rows = [
        replace(row(0.7, {"cause": c}, metric=metric), low=low, high=high)
        for c, (low, high) in ends.items()
        for metric in ("relative_auc", "auc")
    ]
    # Of two results of one cause, neither interval is that of the mean.
    twice = {"low": 0.6, "high": 0.8}
    rows += [
        replace(
            row(0.7, {"cause": "rain"}, metric="relative_auc", seed=seed),
            **twice,
        )
        for seed in (1, 2)
    ]

    def weights(metric):
        chart = {"kind": "matrix", "over": "cause", "metric": metric}
        figure = draw_chart(chart, Results.of(rows)).figure
        caption = " ".join(figure.get_supxlabel().split())
        axes, _ = figure.axes
        return caption, [text.get_fontweight() for text in axes.texts]

    caption, found = weights("relative_auc")
    assert found == ["bold", "normal", "normal", "normal"]
    assert caption.endswith("bold: 95 % interval below 100")
    caption, found = weights("auc")
    assert found == ["normal"] * 3
    assert "bold" not in caption


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        # Only a cause has a word of its own.
        (
            "cause",
            {
                "hidden": "occluded sector",
                "lateral": "lateral offset",
                "turn": "random yaw",
                "parked_cars": "parked cars",
            },
        ),
        ("query.kind", {"hidden": "hidden", "own": "own"}),
        ("both.stage", {"own": "with the change"}),
        ("query.origin", {"[0,0,2.8]": "0, 0, 2.8"}),
        ("query.size", {0.30: "0.3", 2.0: "2"}),
        (
            "query.without",
            {
                ",".join(
                    f"tree_{k:03d}" for k in range(450)
                ): "tree 000, tree 001 and 448 more"
            },
        ),
    ],
)
def test_values_of_factors_are_words(factor, words):
    rows = Results.of(row(0.5, {factor: value}) for value in words)
    chart = {"kind": "matrix", "over": factor, "metric": "auc"}
    axes, _ = draw_chart(chart, rows).figure.axes
    found = [label.get_text() for label in axes.get_yticklabels()]
    assert [" ".join(one.split()) for one in found] == list(words.values())


def test_a_dumbbell_joins_both_ends():
    rows = [
        row(value, {"both.stage": stage}, name, town=town)
        for name, before, after in (("ring++", 0.8, 0.6), ("solid", 0.5, 0.1))
        for town in ("x", "y")
        for stage, value in (("last", before), ("own", after))
    ]
    chart = {"kind": "dumbbell", "over": "both.stage", "metric": "auc"}
    drawn = draw_chart(chart, Results.of(rows))
    (axes,) = drawn.figure.axes
    bars = [line for line in axes.get_lines() if len(line.get_xdata()) == 2]
    found = [list(bar.get_xdata()) for bar in bars]
    assert found == 2 * [[0.5, 0.1]] + 2 * [[0.8, 0.6]]
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels == ["SOLiD", "RING++"]
    assert [shown(text.get_text()) for text in axes.texts] == ["20 %", "75 %"]
    assert drawn.title == "AUC by stage"
    assert " ".join(drawn.figure.get_supxlabel().split()).startswith(
        "AUC without the change (hollow) and with the change (filled),"
        " a line for each of 2 pairs of drives"
    )


def test_a_dumbbell_has_a_panel_with_verification():
    rows = [
        replace(
            row(value, {"both.stage": stage}, verified=verified),
            low=value - 0.125,
            high=value + 0.125,
        )
        for verified, after in ((False, 0.25), (True, 0.5))
        for stage, value in (("last", 0.75), ("own", after))
    ]
    chart = {"kind": "dumbbell", "over": "both.stage", "metric": "auc"}
    for width in (WIDE, NARROW):
        drawn = draw_chart(chart, Results.of(rows), width)
        for axes, after in zip(drawn.figure.axes, (0.25, 0.5), strict=True):
            lines = {tuple(line.get_xdata()) for line in axes.get_lines()}
            # The pair, and the interval of each end.
            wide = (after - 0.125, after + 0.125)
            for ends in ((0.75, after), (0.625, 0.875), wide):
                assert ends in lines
        panels = [axes.get_title(loc="left") for axes in drawn.figure.axes]
        assert [name.split()[0] for name in panels] == ["Without", "With"]
    assert "verified 0 or 1" in drawn.source
    (axes,) = draw_chart({**chart, "verified": 1}, Results.of(rows)).figure.axes
    assert (0.75, 0.5) in {tuple(line.get_xdata()) for line in axes.get_lines()}


def test_a_dumbbell_over_a_setting_has_a_row_for_each_value():
    over = "methods.mine.size"
    rows = [row(value, {over: size}) for size, value in ((1, 0.5), (2, 0.75))]
    chart = {"kind": "dumbbell", "over": over, "metric": "auc"}
    drawn = draw_chart(chart, Results.of(rows))
    (axes,) = drawn.figure.axes
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels == ["mine, size 1", "mine, size 2"]
    marks = [line for line in axes.get_lines() if line.get_markersize() == 8]
    drawn_at = [value for mark in marks for value in mark.get_xdata()]
    assert sorted(v for v in drawn_at if not math.isnan(v)) == [0.5, 0.75]


def test_label_of_a_dumbbell_is_the_mean_of_what_its_pairs_keep():
    """Neither of medians, nor the ratio of means; as in any table of shares."""
    both = {
        "ring++": ((0.9, 0.9), (0.1, 0.09), (0.1, 0.09)),
        "solid": ((0.9, 0.1), (0.1, 0.1), (0.1, 0.1)),
    }
    rows = [
        replace(row(value, {"both.stage": stage}, name, town=town), metric=m)
        for name, pairs in both.items()
        for town, ends in zip("xyz", pairs, strict=True)
        for stage, value in zip(("last", "own"), ends, strict=True)
        for m, value in (("auc", value), ("relative_auc", value / ends[0]))
    ]
    chart = {"kind": "dumbbell", "over": "both.stage", "metric": "auc"}
    (axes,) = draw_chart(chart, Results.of(rows)).figure.axes
    bars = [line for line in axes.get_lines() if len(line.get_xdata()) == 2]
    ends = [tuple(bar.get_xdata()) for bar in bars]
    assert ends == [*both["solid"], *both["ring++"]]
    labels = [shown(text.get_text()) for text in axes.texts]
    assert labels == ["70 %", "93 %"]
    shares = Results.of(rows).where(
        {"both.stage": "own"}, metric="relative_auc"
    )
    table = [line.split() for line in summary_lines(shares)]
    assert table[2:4] == [["SOLiD", "0.70"], ["RING++", "0.93"]]


@pytest.mark.parametrize("number", [5, 8])
def test_a_scatter_of_points_on_a_line(number):
    drawn = draw_chart(
        {"kind": "scatter", "x": "tcr_sym", "y": "auc"}, scattered(number)
    )
    (axes,) = drawn.figure.axes
    # A local linear regression of a line is that line.
    for line in axes.get_lines():
        np.testing.assert_allclose(
            line.get_ydata(), 0.9 - np.asarray(line.get_xdata())
        )
    # Of two methods: points, and a curve without a band.
    assert len(axes.get_lines()) == 4
    assert len(axes.collections) == 0
    assert drawn.title == "AUC over TCR_sym"
    # A line in the legend stands for a curve.
    assert all(style for _, style, _ in drawn.legend.values())


@pytest.mark.parametrize("number", [1, 4])
def test_a_few_points_are_no_scatter(number):
    chart = {"kind": "scatter", "x": "tcr_sym", "y": "auc"}
    words = f"needs 5 pairs of drives or more, not {number}$"
    with pytest.raises(InputError, match=words):
        draw_chart(chart, scattered(number))


def test_other_keys_select_rows():
    rows = [*aged().rows, row(0.01, {YEARS: 0}, "mine", verified=True)]
    chart = {"kind": "lines", "over": YEARS, "metric": "auc", "seed": 2}
    drawn = draw_chart({**chart, "method": ["mine"]}, Results.of(rows))
    (axes,) = drawn.figure.axes
    (line,) = axes.get_lines()
    np.testing.assert_allclose(line.get_ydata(), [0.72, 0.62, 0.42])


def test_maps_may_be_the_lines_of_a_matrix():
    rows = [
        row(value, {}, name, "miou", town, task="map")
        for town, value in (("x", 0.5), ("y", 0.25))
        for name in ("free-space", "distance")
    ]
    chart = {"kind": "matrix", "over": "map", "metric": "miou"}
    drawn = draw_chart(chart, Results.of(rows))
    axes, _ = drawn.figure.axes
    assert [t.get_text() for t in axes.get_yticklabels()] == ["x", "y"]


def test_times_are_on_a_logarithmic_axis():
    rows = [
        row(value, {YEARS: year}, metric="query_time", task="cost")
        for year, value in ((0, 1.0), (5, 100.0))
    ]
    chart = {"kind": "lines", "over": YEARS, "metric": "query_time"}
    (axes,) = draw_chart(chart, Results.of(rows)).figure.axes
    assert axes.get_yscale() == "log"


@pytest.mark.parametrize(
    ("tasks", "share"),
    [(("pose", "place"), 0.9), (("localise", "pose"), 0.8)],
)
def test_the_task_is_place_or_the_first_with_the_metric(tasks, share):
    shares = {"place": 0.9, "localise": 0.8, "pose": 0.7}
    rows = [
        row(shares[task], {YEARS: year}, metric="relative_auc", task=task)
        for task in tasks
        for year in (0, 5)
    ]
    chart = {"kind": "lines", "over": YEARS, "metric": "relative_auc"}
    (axes,) = draw_chart(chart, Results.of(rows)).figure.axes
    (line,) = axes.get_lines()
    np.testing.assert_allclose(line.get_ydata(), share)


@pytest.mark.parametrize(
    ("chart", "words"),
    [
        ({"kind": "pie"}, "charts: kind: no kind 'pie' (there are: curves"),
        ({"metric": "auc"}, "kind: no kind None"),
        ({"kind": "lines", "metric": "auc"}, "lines: over: a name"),
        ({"kind": "lines", "over": 3, "metric": "auc"}, "lines: over"),
        (
            {"kind": "lines", "over": "query.snow", "metric": "auc"},
            "query.snow: the table has none",
        ),
        ({"kind": "lines", "over": YEARS, "metric": "miou"}, "no miou"),
        (
            {"kind": "lines", "over": YEARS, "metric": "auc", "colour": 1},
            "colour: the table has none",
        ),
        (
            {"kind": "lines", "over": "method", "metric": "auc"},
            "method: 'ring",
        ),
        ({"kind": "scatter", "x": "tcr_sym", "y": "auc"}, "no auc has a tcr"),
        (
            {"kind": "dumbbell", "over": "map", "metric": "auc"},
            "map: the table has one value",
        ),
        (
            {"kind": "matrix", "over": YEARS, "metric": "auc", "strips": 3},
            "strips: a name",
        ),
    ],
)
def test_faults_of_a_chart_are_named(chart, words):
    with pytest.raises(InputError, match=re.escape(words)):
        draw_chart(chart, aged())


@pytest.mark.parametrize("width", [WIDE, NARROW])
@pytest.mark.parametrize(
    ("chart", "results"),
    [
        ({"kind": "lines", "over": YEARS, "metric": "auc"}, aged()),
        (
            {"kind": "matrix", "over": "cause", "metric": "relative_auc"},
            caused(),
        ),
        ({"kind": "scatter", "x": "tcr_sym", "y": "auc"}, scattered()),
        ({"kind": "dumbbell", "over": YEARS, "metric": "auc"}, aged()),
    ],
)
def test_all_letters_can_be_read(chart, results, width):
    figure = draw_chart(chart, results, width).figure
    FigureCanvasAgg(figure).draw()
    assert figure.get_figwidth() * 96 == pytest.approx(width)
    # Nothing that is drawn is cut off. Letters have 12 px, also on a phone of
    # 360 px with margins of 16 px.
    box = figure.get_tightbbox()
    assert box.x0 >= -0.01
    assert box.x1 <= figure.get_figwidth() + 0.01
    shown = 1.0 if width == WIDE else 328.0 / width
    sizes = [
        text.get_fontsize() * 96.0 / 72.0 * shown
        for text in figure.findobj(Text)
        if text.get_text()
    ]
    assert len(sizes) > 4
    assert min(sizes) >= 12.0


class _Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.ids = []
        self.links = []
        self.tables = []
        self.open = []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if "id" in values:
            self.ids.append(values["id"])
        for name in ("href", "xlink:href", "src"):
            if name in values:
                self.links.append(values[name])
        if tag == "table":
            self.tables.append([])
        if tag == "tr" and self.tables:
            self.tables[-1].append([])
        if tag in ("td", "th"):
            self.tables[-1][-1].append("")
        self.open.append(tag)

    def handle_endtag(self, tag):
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, data):
        if {"td", "th"} & {*self.open} and self.tables:
            self.tables[-1][-1][-1] += data.strip()


@pytest.mark.sampled(2)
@pytest.mark.parametrize("width", [358, 480, 900])
@pytest.mark.parametrize(
    "keys",
    [
        {"kind": "lines", "over": YEARS, "metric": "auc"},
        {"kind": "scatter", "x": YEARS, "y": "auc"},
    ],
)
def test_a_legend_covers_nothing(keys, width):
    names = [*PARTS, "btc", "learned", "a-method-with-a-long-name"]
    rows = [
        row(0.5, {YEARS: year}, name, town=town)
        for name in names
        for year in (0, 10)
        for town in ("a", "b", "c")
    ]
    look = PrintStyle(width / 120)
    figure = draw_chart(keys, Results.of(rows), printed=look).figure
    FigureCanvasAgg(figure).draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.x1
    for axes in figure.axes:
        if axes.axison:
            assert axes.get_xlabel() == "years"
            assert axes.get_tightbbox().y0 >= box.y1
            assert axes.get_window_extent().height > 100.0


@pytest.mark.parametrize(
    ("chart", "results"),
    [
        ({"kind": "lines", "over": YEARS, "metric": "auc"}, aged()),
        ({"kind": "matrix", "over": YEARS, "metric": "auc"}, aged()),
        ({"kind": "scatter", "x": "tcr_sym", "y": "auc"}, scattered()),
        ({"kind": "dumbbell", "over": YEARS, "metric": "auc"}, aged()),
    ],
)
@pytest.mark.parametrize("value", [1.0, 1.5])
def test_no_chart_shows_what_cannot_be(tmp_path, chart, results, value):
    """Each kind of chart passes the check, and none with an AUC of 1.5."""
    rows = [
        replace(row, value=value) if row.metric == "auc" and k % 3 == 1 else row
        for k, row in enumerate(results.rows)
    ]
    results = Results.of(rows)

    def draw_and_save():
        save_figure(
            draw_chart(chart, results).figure, tmp_path / "chart", ("svg",)
        )

    if value == 1.0:
        draw_and_save()
        return
    with pytest.raises(InputError, match=r"(auc|AUC)\b.* cannot be"):
        draw_and_save()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("width", ["3.5in", "8.89cm", "88.9 mm", "252.945pt"])
def test_a_chart_for_a_paper_has_its_width_its_font_and_no_title(
    tmp_path, width
):
    look = PrintStyle.checked(width, "serif", False)
    keys = {"kind": "lines", "over": YEARS, "metric": "auc"}
    drawn = draw_chart(keys, aged(), printed=look)
    drawn.save(tmp_path / "chart")
    figure = drawn.figure
    assert figure.get_figwidth() == pytest.approx(3.5)
    assert not figure.get_suptitle()
    texts = [text for text in figure.findobj(Text) if text.get_text()]
    assert len(texts) > 8
    for text in texts:
        assert text.get_fontsize() >= 8.0
        assert text.get_fontfamily()[0] == "STIXGeneral"
    box = figure.get_tightbbox()
    assert box.x0 >= -0.01
    assert box.x1 <= 3.51
    fonts = set(
        re.findall(rb"/BaseFont /(\S+)", (tmp_path / "chart.pdf").read_bytes())
    )
    assert fonts
    assert all(b"STIX" in name for name in fonts)


@pytest.mark.parametrize(
    ("width", "font", "words"),
    [
        ("3.5", None, "--width: '3.5': a number and in, cm"),
        ("1e9in", None, "--width: '1e9in': a number"),
        ("1in", None, "--width: 1in: not from 2in to 20in"),
        (None, "Sanserif", "--font: 'Sanserif': not installed"),
    ],
)
def test_faults_of_a_style_are_named(width, font, words):
    with pytest.raises(InputError, match=re.escape(words)):
        PrintStyle.checked(width, font, True)


def test_a_picture_for_print_has_its_legend(tmp_path):
    keys = {"kind": "lines", "over": YEARS, "metric": "auc"}
    figure = draw_chart(keys, aged(), printed=PrintStyle()).figure
    save_figure(figure, tmp_path / "chart", ("pdf", "png"))
    assert figure.legends[0].get_visible()


def test_a_page_shows_the_markers_of_its_charts(tmp_path):
    """The legend of the page has the outlines of matplotlib's markers."""
    rows = [
        row(0.5, {YEARS: year}, name)
        for name in ("btc", "scan-context++", "mine")
        for year in (0, 10)
    ]
    chart = {"kind": "lines", "over": YEARS, "metric": "auc"}
    page = write_page(
        Results.of(rows), None, tmp_path, title="age", charts=[chart]
    ).read_text()
    corners = [
        np.array([c.split(",") for c in points.split()], float)
        for points in re.findall(r'<polygon[^>]*points="([^"]+)"', page)
    ]
    triangle, square, cross = sorted(corners, key=len)[-3:]
    # Closed polygons; the triangle points up.
    np.testing.assert_allclose(np.ptp(square, axis=0), 8.0)
    assert {*map(tuple, square.tolist())} == {
        (x, y) for x in (14.0, 22.0) for y in (2.0, 10.0)
    }
    assert {*map(tuple, triangle.tolist())} == {(18, 2), (14, 10), (22, 10)}
    assert len({*map(tuple, cross.tolist())}) == 12


def test_a_method_has_one_style_in_all_charts():
    """Also a method of the user, in a chart that shows some of the methods."""
    names = {"solid": "yours"}
    rows = [
        replace(row, method=names.get(row.method, row.method))
        for row in aged().rows
    ]
    results = Results.of(rows)
    chart = {"kind": "lines", "over": YEARS, "metric": "auc"}
    everything = draw_chart(chart, results).legend
    for name in ("mine", "yours"):
        (alone,) = draw_chart({**chart, "method": name}, results).legend.items()
        assert alone == (name, everything[name])
    assert len(set(everything.values())) == len(everything)


def test_many_methods_have_different_styles():
    results = Results.of(
        replace(row, method=f"mine_{number}")
        for number in range(20)
        for row in aged().where(method="solid").rows
    )
    chart = {"kind": "lines", "over": YEARS, "metric": "auc"}
    styles = draw_chart(chart, results).legend
    assert len(set(styles.values())) == 20


def test_a_page_stands_alone(tmp_path):
    chart = {"kind": "lines", "over": YEARS, "metric": "auc"}
    told = []
    path = write_page(
        aged(),
        None,
        tmp_path / "page",
        title="Age & <years>",
        about="How old?",
        charts=[chart, {**chart, "metric": "r1"}],
        experiment_text="name: <age>\n",
        notes=["seeds 0 & 2"],
        on_note=told.append,
    )
    text = path.read_text()
    page = _Page()
    page.feed(text)
    assert len(page.ids) == len(set(page.ids))
    wanted = {link[1:] for link in page.links if link.startswith("#")}
    assert wanted <= set(page.ids)
    outside = {link for link in page.links if not link.startswith("#")}
    assert outside == {"results.csv", "data:,"}
    assert "name: &lt;age&gt;" in text
    (note,) = told
    assert note.startswith(
        "Chart 2 is left out: charts: lines: the table has no r1"
    )
    assert note in text
    assert "Age &amp; &lt;years&gt;" in text
    assert "<h1>How old?</h1>" in text
    assert "<h2>AUC by years</h2>" in text
    summary, whole = page.tables
    header, *lines = summary
    assert header == ["method", "0", "10", "30"]
    # The mean of both seeds, and their range: 0.01 less a year.
    means = [f"{0.91 - 0.01 * year:.2f}" for year in (0, 10, 30)]
    assert lines[1][0] == "RING++"
    assert [cell[:4] for cell in lines[1][1:]] == means
    header, *lines = whole
    assert header == ["seed", "method", YEARS, "auc"]
    assert len(lines) == 3 * 3 * 2
    assert ["2", "solid", "30", "0.22"] in lines
    names = sorted(one.name for one in path.parent.iterdir())
    charts = [f"chart_1.{kind}" for kind in ("pdf", "png", "svg")]
    assert names == [*charts, "index.html"]


@pytest.mark.parametrize(
    ("ends", "seeds", "cell"),
    [
        ((0.4, 0.6), (0,), "0.5095\N{NO-BREAK SPACE}% 0.40 to 0.60"),
        # An interval that is unknown, and results of several seeds.
        ((math.nan, math.nan), (0,), "0.50"),
        (
            (0.4, 0.6),
            (0, 1),
            "0.50least\N{NO-BREAK SPACE}0.50, greatest\N{NO-BREAK SPACE}0.50",
        ),
    ],
)
def test_a_single_result_has_its_interval(tmp_path, ends, seeds, cell):
    low, high = ends
    results = Results.of(
        replace(row(0.5, {YEARS: year}, seed=seed), low=low, high=high)
        for year in (0, 10)
        for seed in seeds
    )
    page = _Page()
    page.feed(write_page(results, None, tmp_path, title="one").read_text())
    assert page.tables[0][1] == ["mine", cell, cell]


def test_counts_are_whole_on_a_page(tmp_path):
    values = {
        "lost": (29.0, 106.0),
        # Whole by chance: a share, and a time.
        "r1": (0.0, 1.0),
        "query_time": (2.0, 3.0),
    }
    results = Results.of(
        row(value, {YEARS: year}, metric=metric)
        for metric, both in values.items()
        for year, value in zip((0, 10), both, strict=True)
    )
    path = write_page(results, None, tmp_path, title="counts")
    page = _Page()
    page.feed(path.read_text())
    header, *lines = page.tables[-1]
    columns = dict(zip(header, zip(*lines, strict=True), strict=True))
    assert columns["lost"] == ("29", "106")
    assert columns["r1"] == ("0.00", "1.00")
    assert columns["query_time"] == ("2.00", "3.00")
    assert columns[YEARS] == ("0", "10")


def test_a_page_without_a_chart_or_a_value(tmp_path):
    results = Results.of([row(math.nan, {YEARS: 0}, metric="relative_auc")])
    chart = {"kind": "lines", "over": YEARS, "metric": "relative_auc"}
    path = write_page(results, None, tmp_path, title="none", charts=[chart])
    assert "<h1>none</h1>" in path.read_text()
    assert "Chart 1 is left out" in path.read_text()
    assert "as undefined: relative_auc (1 of 1)." in path.read_text()
    header, first, _ = (tmp_path / "summaries.csv").read_text().splitlines()
    assert header == "what,map,task,method,verified,value,low,high,n"
    # A single year without a share has no lifetime.
    assert first.endswith("left (of 0),town,place,mine,0,,,,")


def curve_tables(levels=(0,)):
    """Returns the tables of a method on a pair of drives, by hand."""
    rows, answers = [], []
    for level in levels:
        key = {
            "experiment": "e", "map": "town", "database": "a", "query": "b",
            "seed": 1, "factors": {YEARS: level}, "task": "place",
            "method": "solid", "verified": False, "protocol": "random-yaw",
        }  # fmt: skip
        rows.append(Row(**key, metric="auc", value=0.5))
        columns = {
            "query_frame": np.arange(4),
            "score": np.array([0.9, 0.8, 0.7, math.nan]),
            "correct": np.array([True, False, True, False]),
            "has_match": np.array([True, True, True, True]),
        }
        answers.append(Answers(**key, columns=columns))
    return Results.of(rows), QueryRows.of(answers)


def test_curves_show_precision_over_recall():
    results, queries = curve_tables()
    drawn = draw_chart({"kind": "curves"}, results, queries=queries)
    (axes,) = drawn.figure.axes
    assert axes.get_title(loc="left") == "a → b"
    (line,) = axes.get_lines()
    # Each accepted answer moves the threshold; the fourth query has none.
    recall, precision = line.get_data()
    np.testing.assert_allclose(recall, [0.0, 1 / 4, 1 / 3, 2 / 3])
    np.testing.assert_allclose(precision, [1.0, 1.0, 1 / 2, 2 / 3])
    assert list(drawn.legend) == ["SOLiD"]


def test_curves_need_answers_of_one_condition():
    results, queries = curve_tables()
    with pytest.raises(InputError, match="the answers are unknown"):
        draw_chart({"kind": "curves"}, results)
    results, queries = curve_tables(levels=(0, 5))
    with pytest.raises(InputError, match="a → b: several conditions"):
        draw_chart({"kind": "curves"}, results, queries=queries)
    draw_chart({"kind": "curves", YEARS: 5}, results, queries=queries)


# What the file matplotlibrc of a user can say.
SETTINGS = {
    "text.usetex": True,
    "font.size": 31.0,
    "axes.facecolor": "red",
    "axes.formatter.use_locale": True,
    "lines.linewidth": 9.0,
    "savefig.bbox": "tight",
    "svg.fonttype": "none",
    "figure.autolayout": True,
}


def draw_all(folder):
    """Writes a figure of each kind of chart, and of a tracked drive."""
    rows = np.zeros(
        9,
        [
            (name, "<f8")
            for name in ("stretch", "way", "track_error", "unmapped")
        ],
    )
    rows["way"] = np.arange(9.0)
    draw_track(rows, folder / "track", "town_02, tracked")
    for chart, results in (
        ({"kind": "lines", "over": YEARS, "metric": "auc"}, aged()),
        ({"kind": "dumbbell", "over": YEARS, "metric": "auc"}, aged()),
        (
            {"kind": "matrix", "over": "cause", "metric": "relative_auc"},
            caused(),
        ),
        ({"kind": "scatter", "x": "tcr_sym", "y": "auc"}, scattered()),
    ):
        drawn = draw_chart(chart, results, printed=PrintStyle())
        save_figure(drawn.figure, folder / chart["kind"], ("svg", "png"))


@pytest.mark.night
@pytest.mark.slow
def test_settings_of_the_user_do_not_reach_our_figures(tmp_path):
    for name, settings in (("plain", {}), ("changed", SETTINGS)):
        (tmp_path / name).mkdir()
        with matplotlib.rc_context(settings):
            draw_all(tmp_path / name)
            assert matplotlib.rcParams["font.size"] == settings.get(
                "font.size", 10.0
            )
    files = sorted((tmp_path / "plain").iterdir())
    assert len(files) == 9
    for file in files:
        other = tmp_path / "changed" / file.name
        assert file.read_bytes() == other.read_bytes(), file.name


def test_a_comparison_has_a_row_for_each_method_and_marks_a_city():
    found = compare_tables([], "relative_auc_strict", verified=True)
    figure = draw_comparison(found, PrintStyle(3.5), ["suburbia"])
    (axes,) = figure.axes
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names[0] == "Layered overlap"
    assert len(names) == len(found.survival)
    ticks = [line for line in axes.get_lines() if line.get_marker() == "|"]
    assert len(ticks) == 12 * len(names)
    marked = [float(t.get_xdata()[0]) for t in ticks if t.get_color() != PALE]
    np.testing.assert_allclose(
        marked, [100 * (1 - o.of_cities["suburbia"]) for o in found.survival]
    )
