"""AUC over TCR_sym: the numbers of `cns-eval pr` and `tcr`, and their line."""

import csv
from types import SimpleNamespace

from helpers import studies
from helpers.small_towns import drive
import numpy as np
import pytest
from scipy.stats import spearmanr

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster
from evaluation.change.drive_change import compare, survey
from evaluation.drives import open_drive
from evaluation.methods import known_methods, make_method
from evaluation.recognition.overlap_truth import overlap_matrix
from evaluation.recognition.place_recognition import run
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.study import surveys, trend, trend_databases
from evaluation.study.trend import smooth, smooth_band, write_trend
from evaluation.study.trend_databases import measure_trend

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    drive(folder / "metropolis_01", "01", "a")
    drive(folder / "metropolis_04_control", "04", "a")
    drive(folder / "metropolis_04", "04", "b")
    return folder


@pytest.fixture(scope="module")
def points(folder, tmp_path_factory):
    databases = [folder / "metropolis_01", folder / "metropolis_04_control"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            trend_databases, "run_jobs", lambda jobs, cluster: studies.do(jobs)
        )
        return measure_trend(
            folder / "metropolis_04",
            databases,
            tmp_path_factory.mktemp("trend"),
            Cluster(),
        )


def test_every_method_on_every_database(points):
    assert [(p.database, p.method) for p in points] == [
        (database, method)
        for database in ("metropolis_01", "metropolis_04_control")
        for method in known_methods()
    ]


def test_the_numbers_are_those_of_the_single_commands(folder, points):
    query = folder / "metropolis_04"
    for name in ("metropolis_01", "metropolis_04_control"):
        change = compare(survey(folder / name), survey(query)).change
        for point in points:
            if point.database == name and point.method != "btc":
                outcome = run(
                    open_drive(folder / name),
                    open_drive(query),
                    make_method(point.method, {}),
                    protocol=FAIR_PROTOCOL,
                )
                assert point.tcr_sym == change.symmetric
                assert point.auc == outcome.metrics.auc
                assert point.recall_at_1 == outcome.metrics.recall_at_1
                assert point.queries == outcome.metrics.num_queries


def test_the_table_holds_what_was_measured(points, tmp_path):
    path = write_trend(points, tmp_path / "new")
    rows = list(csv.DictReader(path.open()))
    assert [row["method"] for row in rows] == [p.method for p in points]
    np.testing.assert_allclose(
        [float(row["tcr_sym"]) for row in rows],
        [p.tcr_sym for p in points],
        atol=1e-6,
    )
    assert (path.parent / "trend.pdf").stat().st_size > 1000


def test_processes_change_nothing_and_are_not_needed_twice(
    folder, points, tmp_path, monkeypatch
):
    databases = [folder / "metropolis_01", folder / "metropolis_04_control"]
    arguments = (folder / "metropolis_04", databases, tmp_path)
    assert measure_trend(*arguments, Cluster(num_workers=2)) == points
    monkeypatch.setattr(
        trend_databases, "run_jobs", lambda jobs, cluster: studies.do(jobs)
    )
    monkeypatch.setattr(
        surveys, "survey_recording", lambda *_: pytest.fail("again")
    )
    assert measure_trend(*arguments, Cluster()) == points


@pytest.mark.usefixtures("few_methods")
def test_the_kept_share_comes_from_the_control(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(
        trend_databases, "run_jobs", lambda jobs, cluster: studies.do(jobs)
    )
    control = folder / "metropolis_04_control"
    found = measure_trend(
        folder / "metropolis_04",
        [folder / "metropolis_01"],
        tmp_path,
        Cluster(),
        protocol=RetrievalProtocol(radius=6.0),
        controls=[control],
    )
    for point in found:
        if point.method == "btc":
            continue
        unchanged = run(
            open_drive(control),
            open_drive(folder / "metropolis_04"),
            make_method(point.method, {}),
            protocol=RetrievalProtocol(radius=6.0),
        )
        assert point.auc_unchanged == unchanged.metrics.auc
        assert point.kept == point.auc / point.auc_unchanged
        assert point.protocol == unchanged.protocol
    rows = list(csv.DictReader(write_trend(found, tmp_path).open()))
    assert {row["radius"] for row in rows} == {"6.0"}
    for row, point in zip(rows, found, strict=True):
        kept = "" if np.isnan(point.kept) else f"{point.kept:.6f}"
        assert row["kept"] == kept


def test_a_control_that_serves_none(folder, tmp_path):
    drive(tmp_path / "metropolis_04_b", "04", "b")
    with pytest.raises(InputError, match=r"--control: .*_b: no database has"):
        measure_trend(
            folder / "metropolis_04",
            [folder / "metropolis_01"],
            tmp_path,
            Cluster(),
            controls=[tmp_path / "metropolis_04_b"],
        )


def test_a_drive_given_twice_is_named(folder, tmp_path):
    path = folder / "metropolis_04"
    with pytest.raises(InputError, match="metropolis_04 is there twice"):
        measure_trend(path, [path], tmp_path, Cluster())


@pytest.mark.parametrize("number", [3, 4, 5])
def test_few_versions_are_joined_by_lines(number, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(trend, "save", lambda figure, _: drawn.append(figure))
    changes = np.linspace(0.0, 0.3, number)[::-1]
    trend.draw_trend(
        [
            SimpleNamespace(tcr_sym=x, method=method, auc=1.0 - x, kept=1.0 - x)
            for method in ("solid", "btc")
            for x in changes
        ],
        tmp_path,
    )
    (figure,) = drawn
    for axes in figure.axes:
        lines = [one for one in axes.lines if one.get_linestyle() != "None"]
        falling = [
            one.get_xydata() for one in lines if len(one.get_xdata()) > 2
        ]
        assert len(falling) == 2
        for line in falling:
            assert (line[0, 0], line[-1, 0]) == (0.0, 0.3)
            np.testing.assert_allclose(line.sum(axis=1), 1.0)


def test_visible_change_is_what_matches_do_not_show(folder, points):
    database, query = (
        open_drive(folder / name) for name in ("metropolis_01", "metropolis_04")
    )
    protocol = RetrievalProtocol(place="first")
    found = run(
        database, query, make_method("solid", {}), protocol=protocol
    ).retrieval
    overlaps = overlap_matrix(database, query, protocol)
    best = np.where(found.matches, overlaps, np.nan)[found.matches.any(axis=1)]
    expected = 1.0 - np.nanmax(best, axis=1).mean()
    changes = {
        point.visible_change
        for point in points
        if point.database == "metropolis_01"
    }
    assert len(changes) == 1
    assert changes.pop() == pytest.approx(expected, abs=1e-9)
    assert expected > 0.01


def test_correlations_are_those_of_scipy(tmp_path):
    rng = np.random.default_rng(5)
    points = [
        SimpleNamespace(
            method=method,
            tcr_sym=float(x),
            visible_change=float(x + 0.3 * z),
            failure=float(round(x + z, 1)),
        )
        for method in ("solid", "btc")
        for x, z in rng.uniform(size=(30, 2))
    ]
    points.append(
        SimpleNamespace(
            method="btc", tcr_sym=np.nan, visible_change=0.0, failure=0.0
        )
    )
    table = trend.correlation_table(points)
    for values in table.rows:
        row = dict(zip(table.header, values, strict=True))
        mine = [p for p in points if p.method == row["method"]][:30]
        assert row["databases"] == 30
        failures = [p.failure for p in mine]
        for name in ("tcr_sym", "visible_change"):
            expected = spearmanr(failures, [getattr(p, name) for p in mine])
            value = float(row[f"rho_{name}"])
            assert value == pytest.approx(expected.statistic, abs=1e-6)
            low, high = (
                float(row[f"rho_{name}_{end}"]) for end in ("low", "high")
            )
            assert low < value < high
        both = float(row["rho_visible_change"]) - float(row["rho_tcr_sym"])
        assert float(row["difference"]) == pytest.approx(both, abs=2e-6)


def test_constant_measures_have_no_correlation():
    points = [
        SimpleNamespace(
            method="btc", tcr_sym=0.1, visible_change=float(k), failure=0.1 * k
        )
        for k in range(6)
    ]
    ((_, number, rho, *_, other, _, _, _, _, _),) = trend.correlation_table(
        points
    ).rows
    assert (number, float(other)) == (6, 1.0)
    assert np.isnan(rho)


def test_a_line_stays_a_line():
    rng = np.random.default_rng(2)
    x = rng.uniform(-1, 3, 40)
    grid = np.linspace(-1, 3, 11)
    np.testing.assert_allclose(
        smooth(x, 2.0 - 0.7 * x, grid), 2.0 - 0.7 * grid, atol=1e-9
    )


def test_points_at_one_place_give_their_mean():
    x, y = np.full(4, 0.3), np.array([1.0, 2.0, 3.0, 6.0])
    np.testing.assert_allclose(smooth(x, y, np.array([0.2, 0.3])), 3.0)


def test_the_band_covers_the_truth_at_its_level():
    rng = np.random.default_rng(8)
    grid = np.array([0.2, 0.5, 0.8])
    held = []
    for _ in range(40):
        x = rng.uniform(0, 1, 50)
        y = 0.8 - 0.5 * x + rng.normal(0, 0.05, 50)
        low, high = smooth_band(x, y, grid)
        truth = 0.8 - 0.5 * grid
        held += list((low <= truth) & (truth <= high))
    assert 0.85 < np.mean(held) < 1.0
