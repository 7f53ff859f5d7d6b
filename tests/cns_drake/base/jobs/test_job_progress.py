"""The progress of many jobs: the remaining time, and how it is shown."""

import io

import pytest
from rich.console import Console

from cns_drake.base.jobs import job_progress
from cns_drake.base.jobs.job_progress import JobProgress, TimeLeft


def test_expected_costs_count_before_the_first_result():
    left = TimeLeft({"a": 30.0, "b": 10.0, "c": 20.0})
    assert left.seconds() == pytest.approx(60.0)
    assert left.share() == 0.0
    left.start("a", now=100.0)
    left.start("b", now=100.0)
    # Two workers run side by side.
    assert left.seconds() == pytest.approx(30.0)


def test_the_longest_one_that_runs_ends_no_earlier():
    left = TimeLeft({"a": 50.0, "b": 10.0})
    left.start("a", now=0.0)
    left.start("b", now=0.0)
    assert left.seconds() == pytest.approx(50.0)
    left.end("b", now=10.0)
    assert left.seconds() == pytest.approx(50.0)


def test_a_slow_machine_takes_longer():
    left = TimeLeft({"a": 1000.0, "b": 500.0})
    left.start("a", now=0.0)
    left.end("a", now=2000.0)
    # The expected costs still weigh as much as ten measured seconds.
    assert left.seconds() == pytest.approx(500.0 * 2010.0 / 1010.0)
    assert left.share() == pytest.approx(2 / 3)
    left.start("b", now=2000.0)
    left.end("b", now=3000.0)
    assert left.seconds() == 0.0
    assert left.share() == pytest.approx(1.0)


def test_results_of_an_earlier_run_give_no_pace():
    left = TimeLeft({"drive": 100.0, "done": 400.0})
    left.start("done", now=0.0)
    left.end("done", now=1.0)
    assert left.seconds() == pytest.approx(100.0)
    left.start("drive", now=0.0)
    left.progress("drive", 0.5, now=5.0)
    assert left.seconds() == pytest.approx(50.0)
    # Measured from 5 s and one half on: 40 s for a quarter, 25 s worth.
    left.progress("drive", 0.75, now=45.0)
    pace = (10.0 + 40.0) / (10.0 + 25.0)
    assert left.seconds() == pytest.approx(pace * 25.0, rel=0.15)
    # The job starts again on another worker.
    left.start("drive", now=50.0)
    assert left.seconds() == pytest.approx(100.0)


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
    with JobProgress({"a drive": 100.0, "b": 900.0}, paper) as shown:
        shown.start("a drive")
        for done in range(11):
            shown.progress("a drive", done, 10)
            now[0] += 1.0
        shown.end("a drive")
        shown.note("[bold] " + "word " * 20)
    lines = paper.file.getvalue().splitlines()
    # The begin is reported at once, then the progress every five seconds.
    assert [line.rpartition("; ")[2] for line in lines[:-2]] == [
        "a drive 0 of 10",
        "a drive 5 of 10",
        "a drive 10 of 10",
    ]
    assert lines[0].startswith("0 of 2 jobs, 0:16:40 left; ")
    assert lines[-2] == "a drive: done, 1 of 2 jobs"
    assert lines[-1].startswith("[bold] word word")
