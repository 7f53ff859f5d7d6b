"""The table of `cns-drake size`, and the numbers that it refuses."""

import math

import pytest

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.studies import size
from cns_drake.studies.size import measure_sizes, size_table
from evaluation.study.chosen_methods import choose_methods
from evaluation.study.rungs import SizePoint

METHODS = choose_methods(only=["solid"])


def test_only_the_named_methods():
    names = [one.name for one in choose_methods(only=["solid", "btc", "solid"])]
    assert sorted(names) == ["btc", "solid"]
    assert names == [
        one.name for one in choose_methods() if one.name in ("btc", "solid")
    ]
    with pytest.raises(InputError, match=r"--only: no method 'bow' \(known: b"):
        choose_methods(only=["solid", "bow"])


def test_growth_is_the_exponent_of_the_time():
    points = [
        SizePoint(method, places, places, 50, 0.9, 0.8, factor * time, 1.0)
        for method, factor in (("btc", 1.0), ("solid", 7.0))
        # Time grows by the square, then not at all.
        for places, time in ((3000, 9.0), (1000, 1.0), (9000, 9.0))
    ]
    table = size_table("town", points)
    rows = [dict(zip(table.header, row, strict=True)) for row in table.rows]
    assert [(row["method"], row["places"]) for row in rows] == [
        (method, places)
        for method in ("solid", "btc")
        for places in (1000, 3000, 9000)
    ]
    for first, second, third in (rows[:3], rows[3:]):
        assert math.isnan(first["growth"])
        assert second["growth"] == pytest.approx(2.0)
        assert third["growth"] == pytest.approx(0.0)
    assert {row["map"] for row in rows} == {"town"}


@pytest.mark.parametrize("number", [-1, 100_001])
def test_numbers_of_places_that_are_none(tmp_path, number):
    with pytest.raises(InputError, match=f"--places: {number} is not from 0"):
        measure_sizes("suburbia", [10, number], tmp_path, Cluster(), METHODS)
    assert not list(tmp_path.iterdir())


def test_a_job_for_each_drive_and_for_each_method_and_size(
    tmp_path, monkeypatch
):
    planned = []

    def stop(jobs, cluster):
        planned.extend(jobs)
        raise InputError("planned")

    monkeypatch.setattr(size, "run_jobs", stop)
    with pytest.raises(InputError, match="planned"):
        measure_sizes("suburbia", [300, 0, 300], tmp_path, Cluster(), METHODS)
    names = [job.name for job in planned]
    assert names[0] == "describe suburbia_02_database"
    assert names[-3:] == [
        "describe suburbia_02",
        "size 0 solid",
        "size 300 solid",
    ]
    # One or two drives of other cities have 300 places.
    assert 5 <= len(names) <= 6
    assert set(planned[-1].needs) == set(names[:-2])
    alone, among = (job.step.arguments[2] for job in planned[-2:])
    assert alone == ()
    assert len(among) == len(names) - 4
