"""The progress of many jobs: the remaining time, and how it is shown."""

import io

import pytest
from rich.console import Console

from cns_drake.base.jobs import job_progress
from cns_drake.base.jobs.job_progress import JobProgress, TimeLeft


def test_nothing_is_estimated_before_it_is_measured():
    left = TimeLeft({"a": 30.0, "b": 10.0, "c": 20.0})
    assert left.seconds() is None
    assert left.share() == 0.0
    left.start("a", now=100.0)
    left.start("b", now=100.0)
    left.progress("b", 0.0, now=105.0)
    assert left.seconds() is None
    # A half of 10 s takes 10 s; two workers run side by side.
    left.progress("b", 0.5, now=115.0)
    assert left.seconds() == pytest.approx(2.0 * 30.0)


@pytest.mark.parametrize(("share", "is_known"), [(0.099, False), (0.101, True)])
def test_the_first_scans_are_no_measure(share, is_known):
    # They take long, since they load the program: 20 s for a part of 10 s.
    left = TimeLeft({"a": 10.0, "b": 100.0})
    left.start("a", now=0.0)
    left.progress("a", 0.0, now=0.0)
    left.progress("a", share, now=20.0)
    assert (left.seconds() is not None) == is_known


def test_the_longest_one_that_runs_ends_no_earlier():
    left = TimeLeft({"a": 50.0, "b": 10.0})
    left.start("a", now=0.0)
    left.start("b", now=0.0)
    left.end("b", now=10.0)
    assert left.seconds() == pytest.approx(50.0)


def test_a_slow_machine_takes_longer():
    left = TimeLeft({"a": 1000.0, "b": 500.0})
    left.start("a", now=0.0)
    left.end("a", now=2000.0)
    assert left.seconds() == pytest.approx(1000.0)
    assert left.share() == pytest.approx(2 / 3)
    left.start("b", now=2000.0)
    left.end("b", now=3000.0)
    assert left.seconds() == 0.0
    assert left.share() == pytest.approx(1.0)


def test_results_of_an_earlier_run_give_no_pace():
    left = TimeLeft({"drive": 100.0, "done": 400.0})
    left.start("done", now=0.0)
    left.end("done", now=1.0)
    assert left.seconds() is None
    left.start("drive", now=0.0)
    left.progress("drive", 0.5, now=5.0)
    assert left.seconds() is None
    # Measured from 5 s and one half on: 40 s for a quarter, 25 s worth.
    left.progress("drive", 0.75, now=45.0)
    assert left.seconds() == pytest.approx(40.0)
    # The job starts again on another worker.
    left.start("drive", now=50.0)
    assert left.seconds() is None


@pytest.mark.parametrize("width", [30, 40, 60, 80, 200])
def test_all_jobs_and_each_running_one_are_one_line_each(width):
    screen = Console(file=io.StringIO(), width=width, force_terminal=True)
    names = ["survey metropolis_01_stage_04", "metropolis 01 > 04, ring++"]
    costs = dict.fromkeys([*names, "short"], 10.0)
    with JobProgress(costs, screen) as shown:
        for name in costs:
            shown.start(name)
            shown.progress(name, 1, 240)
        shown.end("short")
        paper = Console(file=io.StringIO(), width=width)
        paper.print(shown)
    lines = paper.file.getvalue().splitlines()
    assert len(lines) == 3
    assert all(len(line) <= width for line in lines)
    assert lines[0].startswith("1 of 3 jobs")
    for name, line in zip(names, lines[1:], strict=True):
        assert line.startswith(name[:8])


def test_without_a_terminal_there_is_a_line_now_and_then(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(job_progress.time, "monotonic", lambda: now[0])
    paper = Console(file=io.StringIO(), width=40)
    costs = {"a drive": 100.0, "a walk": 900.0}
    with JobProgress(costs, paper, num_done=3) as shown:
        shown.start("a drive")
        for done in range(11):
            shown.progress("a drive", done, 10)
            now[0] += 1.0
        shown.end("a drive")
        shown.note("[bold] " + "word " * 20)
    lines = paper.file.getvalue().splitlines()
    # The begin is reported at once, and the first measure; then the progress
    # every five seconds.
    assert [line.rpartition("; ")[2] for line in lines[:3]] == [
        "a drive 0 of 10",
        "a drive 1 of 10",
        "a drive 6 of 10",
    ]
    # A tenth of a drive a second, and ten such drives.
    assert lines[0].startswith("3 of 5 a jobs, elapsed 0:00; ")
    assert lines[1].startswith("3 of 5 a jobs, elapsed 0:01, about 1:39 left; ")
    assert lines[3] == "a drive: done, 4 of 5 a jobs"
    assert lines[-1].startswith("[bold] word word")
