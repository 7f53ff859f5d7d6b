"""The remaining time follows the pace of the work."""

from itertools import pairwise
import math

import pytest

from cns_drake.base.progress_display import Pace, TimeLeft


def steps(*seconds):
    """Returns a pace that was measured at steps of one unit of work."""
    pace = Pace()
    total = 0.0
    for done, taken in enumerate(seconds, 1):
        total += taken
        pace.measure(done, total)
    return pace


def test_a_steady_pace():
    assert steps(*10 * [2.0]).steady(40) == pytest.approx(2.0)
    # A quarter more in the second half, and a little more than that.
    assert steps(*5 * [2.0], *5 * [2.5]).steady(40) == pytest.approx(2.25)
    assert steps(*5 * [2.0], *5 * [2.51]).steady(40) is None


@pytest.mark.parametrize(
    ("number", "seconds", "total"),
    [
        (0, 1.0, 10),
        (1, 10.0, 10),  # It has no halves.
        (9, 1.0, 91),  # Less than a tenth.
        (9, 0.33, 10),  # Less than three seconds.
    ],
)
def test_too_little_is_no_measure(number, seconds, total):
    assert steps(*number * [seconds]).steady(total) is None
    assert steps(*(number + 10) * [seconds]).steady(10) is not None


def test_a_slow_begin_is_no_measure():
    pace = steps(20.0, *9 * [1.0])
    assert pace.steady(100) is None
    # It is, once it hardly counts.
    pace = steps(5.0, *39 * [1.0])
    assert pace.steady(100) == pytest.approx(1.1)


def ended(left, names, now, seconds):
    """Runs jobs one after the other; returns when they have ended."""
    for name in names:
        left.start(name, now)
        now += seconds
        left.end(name, now)
    return now


def test_nothing_is_told_before_jobs_have_ended():
    left = TimeLeft(dict.fromkeys("abcdefgh", 10.0))
    assert left.seconds(0.0) is None
    assert left.share() == 0.0
    now = ended(left, "a", 0.0, 20.0)
    assert left.seconds(now) == pytest.approx(7 * 20.0)
    now = ended(left, "b", now, 20.0)
    assert left.seconds(now) == pytest.approx(6 * 20.0)
    assert left.share() == pytest.approx(0.25)
    now = ended(left, "cdefgh", now, 20.0)
    assert left.seconds(now) == 0.0


def test_a_first_small_job_is_no_measure():
    left = TimeLeft({"a": 1.0, "b": 1.0, "c": 18.0})
    now = ended(left, "a", 0.0, 1.0)
    assert left.seconds(now) is None
    now = ended(left, "b", now, 1.0)
    assert left.seconds(now) == pytest.approx(18.0)


def test_the_estimate_follows_the_pace():
    names = [str(k) for k in range(40)]
    left = TimeLeft(dict.fromkeys(names, 10.0))
    now = ended(left, names[:20], 0.0, 10.0)
    assert left.seconds(now) == pytest.approx(200.0)
    # Other programs take two thirds of the machine.
    before = left.seconds(now)
    for k, name in enumerate(names[20:35]):
        now = ended(left, [name], now, 30.0)
        told = left.seconds(now)
        # It never jumps, and ends near the truth.
        assert abs(told - before) < 35.0
        truth = 30.0 * (19 - k)
        assert 0.3 * truth < told < 1.05 * truth
        before = told
    assert before == pytest.approx(5 * 30.0, rel=0.2)


def test_jobs_side_by_side():
    left = TimeLeft(dict.fromkeys("abcdef", 10.0))
    for name in "abcd":
        left.start(name, now=0.0)
    left.end("a", now=10.0)
    left.end("b", now=10.0)
    left.start("e", now=10.0)
    left.end("c", now=10.0)
    # d soon ends; e has begun; f waits; four run at a time.
    assert left.seconds(10.0) == pytest.approx(10.0)
    # d is late: it counts as if it had taken 16 s, and 10 s of later work leave
    # exp(-10 / 15) of the weight of a, b and c, as c left of a and b.
    old = sum(10.0 * math.exp(-10.0 * k / 15.0) for k in (1, 2, 3))
    pace = (old + 16.0) / (old + 10.0)
    rest = [pace, 10.0 * pace - 6.0, 10.0 * pace]
    assert left.seconds(16.0) == pytest.approx(sum(rest) / 3)


def test_a_late_job_is_evidence_before_it_ends():
    """The machine becomes four times slower in the second of ten jobs."""
    names = [str(k) for k in range(10)]
    left = TimeLeft(dict.fromkeys(names, 60.0))
    now = ended(left, names[:1], 0.0, 60.0)
    left.start(names[1], now)
    told = [left.seconds(now + spent) for spent in range(0, 240, 20)]
    # It falls until the job is late, and rises while the job is still not done.
    assert told[:4] == pytest.approx([540.0, 520.0, 500.0, 480.0], abs=7.0)
    assert all(a < b for a, b in pairwise(told[3:]))
    # 8 jobs of 240 s are left, most of which is told before the job ends.
    assert told[-1] > 0.6 * 8 * 240.0


def test_what_was_done_before_gives_no_pace():
    left = TimeLeft(dict.fromkeys("abcd", 100.0))
    now = ended(left, "ab", 0.0, 1.0)
    assert left.seconds(now) is None
    # Half of these two was done by an earlier run.
    for name in "cd":
        left.start(name, now)
        left.record_done_before(name, 0.5)
        left.record_done_before(name, 0.9)
        left.end(name, now + 60.0)
    assert left.seconds(now + 60.0) == 0.0
    left.start("c", now)
    left.record_done_before("c", 0.5)
    # 120 s for 100 s of work; 50 s of it is left.
    assert left.seconds(now) == pytest.approx(60.0)
