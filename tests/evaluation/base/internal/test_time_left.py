"""The time left of jobs of known lengths is told, within a third of it."""

import heapq

import pytest

from evaluation.base.progress_display import TimeLeft


def replay(jobs, num_workers):
    """Returns the shares of a run, and the time left that is told by the true.

    Args:
        jobs: name, expected time and real time of each job [s], in order.
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
            told.append((now, left.seconds(now, {})))
            now = min(now + 1.0, running[0][0])
        left.end(heapq.heappop(running)[1], now)
    assert left.seconds(now, {}) == 0.0
    return [
        (at / now, seconds / (now - at))
        for at, seconds in told
        if seconds is not None
    ]


def kinds(*lengths):
    """Returns jobs of several kinds: (kind, number, expected, real time)."""
    return [
        (f"{kind} {k}", cost, seconds)
        for kind, number, cost, seconds in lengths
        for k in range(number)
    ]


# Four kinds of jobs in the order of a study, with expected times that are
# wrong by up to a fifth, each in its own way.
STUDY = kinds(
    ("describe", 4, 6.0, 6.5),
    ("mapped", 8, 18.0, 19.0),
    ("place", 16, 9.0, 8.0),
    ("change", 8, 0.5, 0.4),
)


@pytest.mark.parametrize("machine", [0.3, 1.0, 8.0])
@pytest.mark.parametrize("num_workers", [1, 2])
@pytest.mark.parametrize(
    "jobs",
    [
        kinds(("a", 40, 10.0, 10.0)),
        STUDY,
        STUDY[::-1],
        STUDY[::2] + STUDY[1::2],
    ],
    ids=["equal", "in order", "in reverse", "mixed"],
)
def test_from_a_tenth_of_the_work_on(jobs, num_workers, machine):
    """However fast the machine is."""
    jobs = [(name, cost, machine * real) for name, cost, real in jobs]
    ratios = replay(jobs, num_workers)
    assert ratios[0][0] < 0.2
    for share, ratio in ratios:
        # In the last moments, a part of one job counts.
        assert share > 0.95 or 2 / 3 <= ratio <= 4 / 3, share


def test_equal_jobs_are_told_exactly():
    ratios = replay(kinds(("a", 10, 1.0, 30.0)), 1)
    assert [r for _, r in ratios] == pytest.approx([1.0] * len(ratios))


def test_a_kind_has_a_pace_of_its_own():
    """It is known as soon as one job of the kind has ended."""
    both = kinds(("a", 20, 10.0, 10.0)), kinds(("b", 20, 10.0, 40.0))
    jobs = [one for pair in zip(*both, strict=True) for one in pair]
    for share, ratio in replay(jobs, 1):
        assert share > 0.95 or ratio == pytest.approx(1.0, abs=0.3), share


def test_loading_the_program_is_no_work():
    """Each job is as quick as the first once it has begun."""
    left = TimeLeft(dict.fromkeys("abcd", 10.0))
    left.start("a", 0.0)
    left.begin("a", 30.0)
    left.begin("a", 35.0)
    left.end("a", 40.0)
    assert left.seconds(40.0, {}) == pytest.approx(30.0)


def test_a_job_that_counts_is_told_before_one_has_ended():
    left = TimeLeft({"a 1": 10.0, "a 2": 10.0, "b 1": 30.0})
    left.start("a 1", 0.0)
    assert left.seconds(6.0, {"a 1": None}) is None
    # It will take 20 s, twice its expected time.
    assert left.seconds(15.0, {"a 1": 5.0}) == pytest.approx(5.0 + 20.0 + 60.0)


def test_the_load_of_the_machine_halves():
    """A quarter of the work later, this is told."""
    jobs = [(f"a {k}", 10.0, 20.0 if k < 20 else 10.0) for k in range(40)]
    (ratio,) = (r for share, r in replay(jobs, 1) if share == 500.0 / 600.0)
    assert 1.0 <= ratio <= 4 / 3
