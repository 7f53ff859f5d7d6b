"""What is told before jobs start: how long, and how much space."""

import shutil

from helpers import job_functions
import pytest

from cns_drake.base import Cluster, Job, Space
from cns_drake.base.jobs import forecast
from cns_drake.base.jobs.forecast import shortest_time


def job(name, cost, needs=(), is_done=False):
    done = job_functions.yes if is_done else None
    return Job(
        name, job_functions.Call(job_functions.refuse, done=done), needs, cost
    )


CHAIN = [job("c", 30.0, ("b",)), job("b", 20.0, ("a",)), job("a", 10.0)]
SINGLE = [job(f"single {k}", 10.0) for k in range(6)]


def test_the_shortest_time():
    assert shortest_time([], 2) == 0.0
    assert shortest_time(SINGLE, 2) == pytest.approx(30.0)
    # All that needs b waits for a; others run meanwhile.
    assert shortest_time([*CHAIN, *SINGLE], 2) == pytest.approx(60.0)
    assert shortest_time([*CHAIN, *SINGLE], 1) == pytest.approx(120.0)
    # What is not there is done.
    assert shortest_time(CHAIN[:2], 2) == pytest.approx(50.0)


@pytest.fixture
def slow(monkeypatch):
    """A machine that takes three times as long."""
    monkeypatch.setattr(forecast, "measure_slowness", lambda: 3.0)


@pytest.mark.usefixtures("slow")
def test_what_is_told(tmp_path, monkeypatch):
    usage = type(shutil.disk_usage(tmp_path))
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage(9e9, 0, 5e9))
    done = job("done", 1000.0, is_done=True)
    assert (
        forecast.forecast([done], Cluster(2), Space(tmp_path, 4e9, 3e9)) is None
    )
    assert forecast.forecast(
        [done, *SINGLE], Cluster(2), Space(tmp_path, 4e9, 3e9)
    ) == (
        "6 jobs: about 90 s with 2 at a time, as this machine was measured"
        " just now; 2.4 GB of memory; 4.0 GB on the disk (3.0 GB in the end)"
    )
    text = forecast.forecast(CHAIN, Cluster(64), Space(tmp_path, 6e9, 6e9))
    assert text.startswith("3 jobs: about 3 minutes with 3 at a time")
    assert text.endswith("; 6.0 GB on the disk, which has 5.0 GB")


def test_nothing_is_measured_for_other_machines(tmp_path, monkeypatch):
    monkeypatch.setattr(forecast, "measure_slowness", None)
    cluster = Cluster(scheduler="tcp://10.0.0.1:1")
    text = forecast.forecast(SINGLE, cluster, Space(tmp_path, 1e9, 1e9))
    assert text.startswith("6 jobs: 1.0 GB on the disk")
    assert forecast.forecast(SINGLE, cluster) is None


@pytest.mark.usefixtures("slow")
def test_nothing_is_told_of_short_jobs():
    """Their time counts as it is on the machine of the costs."""
    assert forecast.forecast(SINGLE, Cluster(2), least=30.1) is None
    assert forecast.forecast(SINGLE, Cluster(2), least=29.9) == (
        "6 jobs: about 90 s with 2 at a time, as this machine was measured"
        " just now; 2.4 GB of memory"
    )


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.1, "10 s"),
        (91.0, "100 s"),
        (100.0, "2 minutes"),
        (5_990.0, "100 minutes"),
        (6_000.0, "1.7 h"),
    ],
)
def test_times_have_one_or_two_digits(seconds, text):
    assert forecast._time_text(seconds) == text


def test_this_machine_is_of_this_century(monkeypatch):
    monkeypatch.setattr(forecast, "_POINTS", 100_000)
    assert 0.01 < forecast.measure_slowness() < 1000.0
