"""What is told before jobs start: how many, and how much space."""

import shutil

from helpers import job_functions

from evaluation.base import Cluster, Job, Space, forecast


def job(name, is_done=False):
    done = job_functions.yes if is_done else None
    step = job_functions.Call(job_functions.refuse, done=done)
    return Job(name, step)


def test_what_is_told(tmp_path, monkeypatch):
    usage = type(shutil.disk_usage(tmp_path))
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage(9e9, 0, 5e9))
    done = job("done", is_done=True)
    jobs = [done, *(job(f"single {k}") for k in range(6))]
    space = Space(tmp_path, 4e9)
    assert forecast([done], Cluster(2), space) is None
    assert forecast(jobs[:5], Cluster(2), space) is None
    assert forecast(jobs, Cluster(2), space) == (
        "6 jobs: 2.4 GB of memory with 2 at a time; 4.0 GB on the disk"
    )
    text = forecast(jobs, Cluster(64), Space(tmp_path, 6e9))
    assert text.startswith("6 jobs: 7.2 GB of memory with 6 at a time")
    assert text.endswith("; 6.0 GB on the disk, which has 5.0 GB")
    assert forecast(jobs, Cluster(scheduler="tcp://a:1")) is None
