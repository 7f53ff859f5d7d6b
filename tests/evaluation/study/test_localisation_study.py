"""Localisation of many pairs of drives: its files, and that it resumes."""

import csv

import numpy as np
import pytest

from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.step import Reporter
from evaluation.drives import open_drive
from evaluation.localisation.estimators import (
    default_settings,
    make_estimator,
    make_map,
)
from evaluation.localisation.localise import (
    COLUMNS,
    Localiser,
    localise,
)
from evaluation.report.ladder import LadderRung
from evaluation.study import localisation
from evaluation.study.localisation import (
    STARTS,
    ComparedPair,
    localise_pairs,
    measure_localisation,
)
from evaluation.study.surveys import RecordedDrive


@pytest.fixture(scope="module")
def pairs(towns):
    one, other = (RecordedDrive(towns / f"town_0{i}") for i in (1, 2))
    return [
        ComparedPair(
            LadderRung("town", "01", "01", "none", 0, "nothing"), (one, one)
        ),
        ComparedPair(
            LadderRung("town", "02", "01", "stages", 1, "a lane"), (other, one)
        ),
    ]


def test_a_pair_is_localised_as_each_scan_alone(towns, pairs):
    sources = pairs[1].sources
    methods = ("plane-icp", "gicp")
    found = measure_localisation(
        Reporter(), *sources, methods, ("", ""), STARTS, 10.0
    )
    assert len(found) == 4
    mapped, asked = (open_drive(towns / f"town_0{i}") for i in (2, 1))
    settings = default_settings("gicp")
    place = make_map(mapped, settings)
    found_alone = Localiser(place, make_estimator("gicp", settings), settings)
    alone = localise(found_alone, asked, range(8), STARTS[1])
    for name in COLUMNS:
        if name != "seconds":
            assert np.array_equal(found[3][name], alone[name])


def test_files_of_pairs(pairs, tmp_path, monkeypatch):
    own = tmp_path / "stay.py"
    own.write_text("def stay(map, scan, start):\n    return start, 1.0\n")
    methods = ("gicp", str(own))
    table = localise_pairs(pairs, tmp_path / "out", Cluster(1), methods, 10.0)
    with open(table, newline="") as stream:
        rows = list(csv.DictReader(stream))
    keys = [
        (row["cause"], row["level"], row["method"], row["start"])
        for row in rows
    ]
    assert keys == [
        (cause, level, method, start)
        for cause, level in (("none", "0"), ("stages", "1"))
        for method in ("gicp", "stay")
        for start in ("0.5", "2.0")
    ]
    # A start that stays is as far off as it was drawn.
    stayed = [float(row["translation_median"]) for row in rows][2:4]
    assert stayed == pytest.approx([0.5, 2.0])
    assert float(rows[0]["success_03m_1deg"]) == 1.0
    with open(tmp_path / "out/localisation_queries.csv", newline="") as stream:
        queries = list(csv.DictReader(stream))
    assert len(queries) == 8 * 8
    rights = [
        float(one["translation_error"]) <= 0.3
        and float(one["rotation_error_deg"]) <= 1.0
        for one in queries[:8]
    ]
    assert np.mean(rights) == float(rows[0]["success_03m_1deg"])
    assert (tmp_path / "out/localisation.png").stat().st_size > 1000
    before = table.read_bytes()

    # Finished pairs are read again.
    monkeypatch.setattr(localisation, "run_jobs", lambda jobs, _: done(jobs))

    def done(jobs):
        assert all(job.step.is_done() for job in jobs)

    localise_pairs(pairs, tmp_path / "out", Cluster(1), methods, 10.0)
    assert table.read_bytes() == before
    # Another text of the own method is another method.
    own.write_text("def stay(map, scan, start):\n    return start, 2.0\n")

    def stale(jobs):
        assert not any(job.step.is_done() for job in jobs)

    monkeypatch.setattr(localisation, "run_jobs", lambda jobs, _: stale(jobs))
    localise_pairs(pairs, tmp_path / "out", Cluster(1), methods, 10.0)
