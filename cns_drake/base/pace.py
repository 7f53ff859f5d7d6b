"""Estimates of the time that is left, from the pace of the work so far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math

# An estimate is made once this share of the work is done.
_LEAST_SHARE = 0.1
# No estimate is made before this time [s]: the first scans also load programs
# and cities.
_LEAST_TIME = 3.0
# The pace is steady if its two halves differ by at most this factor.
_STEADY = 1.25


class Pace:
    """The time that work takes, measured while it is done."""

    def __init__(self) -> None:
        # Amount of work and time [s] since the start, in growing order.
        self._seen: list[tuple[float, float]] = [(0.0, 0.0)]

    def measure(self, work: float, seconds: float) -> None:
        """Records how much work was done so far, and in which time [s]."""
        if work > self._seen[-1][0]:
            self._seen.append((work, seconds))

    def steady(self, total: float) -> float | None:
        """Returns the time that one unit of work takes [s].

        The result is None while an estimate for `total` units of work would be
        unreliable: before a tenth is done, or if the first half of the work
        done so far did not take about as long as the second half.
        """
        work, seconds = self._seen[-1]
        if work < _LEAST_SHARE * total or seconds < _LEAST_TIME:
            return None
        half = next(point for point in self._seen if point[0] >= work / 2)
        if half[0] >= work:
            return None
        first = half[1] / half[0]
        second = (seconds - half[1]) / (work - half[0])
        if max(first, second) > _STEADY * min(first, second):
            return None
        return seconds / work


@dataclass
class _JobState:
    """What is known of one job.

    Attributes:
        cost: expected time [s].
        since: when the job was started [s]; None if the job does not run.
        first: share that an earlier run had done; None until the job says how
            far it is.
        is_ended: whether the job has ended.
    """

    cost: float
    since: float | None = None
    first: float | None = None
    is_ended: bool = False


# A job that takes less than this share of its expected time was done before. It
# is left out of the pace.
_REAL_SHARE = 0.05
# Work that is older than this share of all work hardly counts in the pace of
# jobs, which follows the load of the machine.
_MEMORY = 0.25


class TimeLeft:
    """Estimates the time left for jobs from the jobs that have ended.

    The time that these jobs took, divided by their expected time, is the pace
    of the jobs that are left. Jobs that ended lately count most.

    The methods take the present time `now` [s], always of the same clock.
    """

    def __init__(self, costs: Mapping[str, float]):
        """Makes an estimate for jobs, none of which has started.

        Args:
            costs: name of each job -> expected time on one core [s].
        """
        self._works = {name: _JobState(cost) for name, cost in costs.items()}
        self._most_running = 1
        self._total = sum(costs.values())
        # Expected time of all jobs that gave a pace [s].
        self._measured = 0.0
        # Expected and real times of these jobs, weighted sums [s].
        self._expected = 0.0
        self._taken = 0.0

    def start(self, name: str, now: float) -> None:
        """Records that a job starts, or is started again."""
        self._works[name] = _JobState(self._works[name].cost, since=now)
        running = sum(w.since is not None for w in self._works.values())
        self._most_running = max(self._most_running, running)

    def record_done_before(self, name: str, share: float) -> None:
        """Records which share of a job was done before its start, 0 to 1."""
        work = self._works[name]
        if work.first is None:
            work.first = share

    def end(self, name: str, now: float) -> None:
        """Records that a job has ended."""
        work = self._works[name]
        taken = 0.0 if work.since is None else now - work.since
        work.since, work.is_ended = None, True
        if taken >= _REAL_SHARE * work.cost:
            expected = work.cost * (1.0 - (work.first or 0.0))
            kept = math.exp(-expected / (_MEMORY * self._total))
            self._measured += expected
            self._expected = kept * self._expected + expected
            self._taken = kept * self._taken + taken

    def share(self) -> float:
        """Returns the share of all work that has ended, 0 to 1."""
        works = self._works.values()
        ended = sum(work.cost for work in works if work.is_ended)
        return ended / max(self._total, 1e-9)

    def seconds(self, now: float) -> float | None:
        """Returns the time left [s]; None while it cannot be estimated."""
        left = [work for work in self._works.values() if not work.is_ended]
        if not left:
            return 0.0
        if self._measured < _LEAST_SHARE * self._total or not self._expected:
            return None
        pace = self._taken / self._expected
        running, waiting = [], []
        for work in left:
            needed = pace * work.cost
            if work.since is None:
                waiting.append(needed)
            else:  # One that takes longer than expected soon ends, perhaps.
                spent = now - work.since + needed * (work.first or 0.0)
                running.append(max(needed - spent, 0.1 * needed))
        # As many jobs run side by side as before, and the longest job bounds
        # the time.
        side_by_side = min(self._most_running, len(left))
        even = (sum(running) + sum(waiting)) / side_by_side
        return max(even, *running, 0.0)
