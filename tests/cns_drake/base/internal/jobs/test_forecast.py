"""What is told before jobs start: how long, and how much space."""

import shutil

from helpers import job_functions
import pytest

from cns_drake.base import Cluster, Job, Space
from cns_drake.base.jobs import forecast


def job(name, cost, needs=(), is_done=False):
    done = job_functions.yes if is_done else None
    return Job(
        name, job_functions.Call(job_functions.refuse, done=done), needs, cost
    )


CHAIN = [job("c", 30.0, ("b",)), job("b", 20.0, ("a",)), job("a", 10.0)]
SINGLE = [job(f"single {k}", 10.0) for k in range(6)]


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
