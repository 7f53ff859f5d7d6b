"""What cannot be is in no table and in no figure."""

import math

from matplotlib.figure import Figure
import numpy as np
import pytest

from cns_drake.base import InputError
from evaluation.results import Results, Row, save_figure
from evaluation.results.ranges import check_all, checked, range_of


@pytest.mark.parametrize(
    ("name", "least", "greatest", "is_whole"),
    [
        ("auc", 0.0, 1.0, False),
        ("AUC high", 0.0, 1.0, False),
        ("auc_within_15_m", 0.0, 1.0, False),
        ("R@1%", 0.0, 1.0, False),
        ("paper's F1", 0.0, 1.0, False),
        ("precision", 0.0, 1.0, False),
        ("iou_kept", 0.0, 1.0, False),
        ("mean IoU", 0.0, 1.0, False),
        ("TCR_sym", 0.0, 1.0, False),
        ("kept", 0.0, math.inf, False),
        ("r1_kept_low", 0.0, math.inf, False),
        ("time of a query [ms]", 0.0, math.inf, False),
        ("visible change without parallax", -1.0, 1.0, False),
        ("rank correlation of 1 - auc with tcr_sym", -1.0, 1.0, False),
        ("TP of F1max", 0.0, math.inf, True),
        ("N (with a match)", 0.0, math.inf, True),
    ],
)
def test_a_metric_has_a_range_under_each_of_its_names(
    name, least, greatest, is_whole
):
    assert range_of(name) == (least, greatest, is_whole)


@pytest.mark.parametrize("name", ["years", "database.years", "map", "snow"])
def test_factors_have_none(name):
    assert range_of(name) is None
    assert checked(name, 1e9) == 1e9


def test_rounding_is_cut_off_and_no_more():
    assert checked("auc", 1.0 + 2e-16) == 1.0
    assert checked("auc", -9e-10) == 0.0
    assert checked("auc", 1.0 - 2e-16) == 1.0 - 2e-16
    assert math.isnan(checked("auc", math.nan))
    for name, value in (
        ("auc", 1.0 + 2e-9),
        ("auc", -2.0),
        ("kept", -1e-6),
        ("auc", math.inf),
        ("with_match", 7.5),
        ("visible_change", -1.1),
    ):
        with pytest.raises(InputError, match=f"^{name}: .* cannot be"):
            checked(name, value)
    check_all("auc", [0.0, math.nan, 1.0])
    with pytest.raises(InputError, match=r"auc: 1\.5 cannot be"):
        check_all("auc", [0.5, 1.5])


@pytest.mark.parametrize("end", ["value", "low", "high"])
def test_results_are_not_written_with_it(tmp_path, end):
    place = ("e", "town", "a", "b", 1, {}, "map", "m", False, "fair")
    numbers = {"value": 0.5, "low": 0.25, "high": 0.75, end: 1.5}
    path = tmp_path / "results.csv"
    with pytest.raises(InputError, match=r"results\.csv: miou: 1\.5 cannot be"):
        Results.of([Row(*place, metric="miou", **numbers)]).write_csv(path)
    assert not path.exists()


def draw_line(axes, x, y):
    axes.plot(x, y)


def draw_band(axes, x, y):
    axes.fill_between(x, y, 0.5)


def draw_points(axes, x, y):
    axes.scatter(x, y)


def draw_bars(axes, x, y):
    axes.bar(x, y)


@pytest.mark.parametrize("draw", [draw_line, draw_band, draw_points, draw_bars])
@pytest.mark.parametrize("of_figure", [False, True])
def test_a_figure_is_not_saved_with_it(tmp_path, draw, of_figure):
    for worst, fits in ((1.0, True), (1.5, False)):
        figure = Figure()
        axes = figure.subplots()
        draw(axes, np.array([0.0, 20.0]), np.array([0.25, worst]))
        # Lines beside the data, and text, are no data.
        axes.axhline(0.5)
        axes.axvline(3.0)
        axes.text(1.02, 7.0, "text", transform=axes.get_yaxis_transform())
        axes.set_xlabel("years")
        (figure.supylabel if of_figure else axes.set_ylabel)("AUC")
        if fits:
            save_figure(figure, tmp_path / "good", ("svg",))
            continue
        with pytest.raises(InputError, match=r"AUC: 1\.5 cannot be"):
            save_figure(figure, tmp_path / "bad", ("svg",))
    assert [one.name for one in tmp_path.iterdir()] == ["good.svg"]
