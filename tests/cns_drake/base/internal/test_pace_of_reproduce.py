"""The time left of a real run is told within a third of the truth.

`jobs_of_reproduce.csv` has the first 20 of the 32 jobs of `cns-drake reproduce
metropolis --jobs 2` on two busy cores, in the order in which they started, with
the expected times and the CPU times [s].
"""

import csv
import heapq
from pathlib import Path

import pytest

from cns_drake.base.progress_display import TimeLeft

JOBS = [
    (row["job"], float(row["cost"]), float(row["seconds"]))
    for row in csv.DictReader(
        Path(__file__).with_name("jobs_of_reproduce.csv").open()
    )
]


def replay(jobs, num_workers):
    """Yields each second of a run, the time left that is told, and the end.

    Args:
        jobs: name, expected time and real time of each job [s].
        num_workers: number of jobs that run at a time.
    """
    left = TimeLeft({name: cost for name, cost, _ in jobs})
    waiting = list(reversed(jobs))
    running, told = [], []
    now = 0.0
    while waiting or running:
        while waiting and len(running) < num_workers:
            name, _, seconds = waiting.pop()
            left.start(name, now)
            heapq.heappush(running, (now + seconds, name))
        while now < running[0][0]:
            told.append((now, left.seconds(now)))
            now = min(now + 1.0, running[0][0])
        left.end(heapq.heappop(running)[1], now)
    for at, seconds in told:
        yield at, seconds, now


@pytest.mark.parametrize("machine", [0.3, 1.0, 4.0])
@pytest.mark.parametrize(
    ("of_drives", "of_methods"), [(1.0, 1.0), (1.3, 1.0), (1.0, 1.3)]
)
@pytest.mark.parametrize("num_workers", [1, 2])
def test_the_time_left_of_a_real_run(
    num_workers, of_drives, of_methods, machine
):
    """A machine may be quicker with one kind of work than with another."""
    jobs = [
        (
            name,
            cost,
            seconds * machine * (of_methods if " " in name else of_drives),
        )
        for name, cost, seconds in JOBS
    ]
    ratios = [
        (now / end, told / (end - now))
        for now, told, end in replay(jobs, num_workers)
        # In the last seconds, a single job counts.
        if told is not None and 0.1 * end <= now <= 0.95 * end
    ]
    # Nothing is told before the first jobs have ended.
    assert ratios[0][0] < 0.15
    for share, ratio in ratios:
        assert 2 / 3 <= ratio <= 3 / 2, share


def test_loading_the_program_is_no_work():
    """Each job is as quick as the first once it has begun."""
    left = TimeLeft(dict.fromkeys("abcd", 10.0))
    left.start("a", 0.0)
    left.begin("a", 30.0)
    left.begin("a", 35.0)
    left.end("a", 40.0)
    assert left.seconds(40.0) == pytest.approx(30.0)


def test_the_time_left_follows_the_load_of_the_machine():
    """A quarter of the work after the load has halved, it is told."""
    jobs = [(str(k), 10.0, 20.0 if k < 20 else 10.0) for k in range(40)]
    (told,) = (told for now, told, _ in replay(jobs, 1) if now == 500.0)
    assert 100.0 <= told <= 400.0 / 3.0
