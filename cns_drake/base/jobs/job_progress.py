"""The progress of many jobs in one display on stderr."""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
from dataclasses import dataclass
import time
from typing import Any

from rich.console import Console, RenderableType
from rich.progress import TaskID

from cns_drake.base.progress import LINE_INTERVAL
from cns_drake.base.progress_bars import (
    print_note,
    show_bars,
    shown_times,
)

# A job that takes less than this share of its expected time was done before. It
# is left out of the estimate of the pace.
_REAL_SHARE = 0.05
# The first scans of a run also load programs and cities. The pace is not
# estimated before work of this expected time [s], or of a tenth of the total,
# is done.
_LEAST_MEASURED = 1.0


@dataclass
class _Work:
    """One job.

    Attributes:
        cost: expected time [s].
        done: the share that is done.
        taken: time that the measured share took [s].
        measured: the share that was done in that time.
        since: when it was started [s]; None if it does not run.
        first: the share at its first message, which an earlier run may have
            done; None until then.
    """

    cost: float
    done: float = 0.0
    taken: float = 0.0
    measured: float = 0.0
    since: float | None = None
    first: float | None = None


class TimeLeft:
    """Estimates the time left for jobs, from their costs and their progress.

    The methods take the present time `now` [s], always of the same clock.
    """

    def __init__(self, costs: Mapping[str, float]):
        """Makes an estimate for jobs, none of which has started.

        Args:
            costs: name of each job -> expected time on one core [s].
        """
        self._works = {name: _Work(cost) for name, cost in costs.items()}
        self._most_running = 1

    def start(self, name: str, now: float) -> None:
        """Records that a job starts, or is started again."""
        self._works[name] = _Work(self._works[name].cost, since=now)
        running = sum(w.since is not None for w in self._works.values())
        self._most_running = max(self._most_running, running)

    def progress(self, name: str, share: float, now: float) -> None:
        """Records which share of a job is done, 0 to 1.

        The time until the first call for a job counts as loading, and not as
        work.
        """
        work = self._works[name]
        work.done = share
        if work.since is None or work.first is None:
            work.since, work.first = now, share
        work.taken, work.measured = now - work.since, share - work.first

    def end(self, name: str, now: float) -> None:
        """Records that a job has ended."""
        work = self._works[name]
        since = now if work.since is None else work.since
        work.done, work.since = 1.0, None
        work.taken, work.measured = now - since, 1.0 - (work.first or 0.0)
        if work.taken < _REAL_SHARE * work.cost:
            work.taken = work.measured = 0.0

    def share(self) -> float:
        """Returns the share of all work that is done, 0 to 1."""
        total = sum(work.cost for work in self._works.values())
        done = sum(work.cost * work.done for work in self._works.values())
        return done / max(total, 1e-9)

    def seconds(self) -> float | None:
        """Returns the time left [s]; None before enough has been measured."""
        works = self._works.values()
        taken = sum(work.taken for work in works)
        expected = sum(work.cost * work.measured for work in works)
        left = [
            (work.cost * (1 - work.done), work.since is not None)
            for work in works
            if work.done < 1
        ]
        if not left:
            return 0.0
        if expected < min(_LEAST_MEASURED, 0.1 * sum(w.cost for w in works)):
            return None
        # As many jobs run side by side as before, and the longest job bounds
        # the time.
        even = sum(cost for cost, _ in left) / min(
            self._most_running, len(left)
        )
        longest = max((cost for cost, runs in left if runs), default=0.0)
        return taken / expected * max(even, longest)


class JobProgress:
    """A progress display: a line for all jobs, and one per running job.

    A context manager. Without a terminal it prints a line every few seconds.
    """

    def __init__(
        self,
        costs: Mapping[str, float],
        console: Console | None = None,
        num_done: int = 0,
    ):
        """Makes a display for jobs.

        Args:
            costs: name of each job that is left -> expected time on one core
                [s].
            console: where the display is shown; stderr by default.
            num_done: number of further jobs that were done before.
        """
        self._left = TimeLeft(costs)
        self._stack = contextlib.ExitStack()
        self._console = console
        self._tasks: dict[str, TaskID] = {}
        self._notes: dict[str, str] = {}
        # The jobs of a phase have the same first word.
        words = {name.split()[0] for name in costs}
        is_phase = len(words) == 1 < len(costs)
        self._phase = f"{words.pop()} jobs" if is_phase else "jobs"
        self._num_ended = num_done
        self._num_jobs = num_done + len(costs)
        self._start = time.monotonic()
        # When the next line is due without a terminal.
        self._due = time.monotonic() + LINE_INTERVAL
        self._silent = True

    def __enter__(self) -> JobProgress:
        self._bars = self._stack.enter_context(show_bars(console=self._console))
        self._total = self._bars.add_task(self._summary(), total=1.0, note="")
        self.refresh()
        return self

    def __exit__(self, *error: Any) -> None:
        self._stack.__exit__(*error)

    def __rich__(self) -> RenderableType:
        """Returns the display."""
        return self._bars.get_renderable()

    def start(self, name: str) -> None:
        """Shows that a job starts, or is started again."""
        self._left.start(name, time.monotonic())
        self._remove(name)
        self._tasks[name] = self._bars.add_task(name, total=None, note="")
        self.refresh()

    def progress(self, name: str, done: int, total: int) -> None:
        """Shows how much of a job is done."""
        if name not in self._tasks:
            return
        share = done / max(total, 1)
        self._left.progress(name, share, time.monotonic())
        self._notes[name] = f"{done} of {total}"
        if done >= total:
            self._notes[name] += ", writing"
        self._bars.update(
            self._tasks[name],
            completed=done,
            total=total,
            note=self._notes[name],
        )
        if self._silent:  # A line soon says what has begun, and how fast.
            self._due = 0.0
        self.refresh()

    def end(self, name: str, fault: bool = False) -> None:
        """Shows that a job has ended; if `fault` is true, with an error."""
        self._left.end(name, time.monotonic())
        self._num_ended += 1
        self._remove(name)
        if not self._bars.console.is_terminal and not fault:
            self.note(f"{name}: done, {self._summary()}")
        self.refresh()

    def note(self, text: str) -> None:
        """Prints lines of text above the progress display."""
        print_note(self._bars, text)

    def refresh(self) -> None:
        """Redraws the display."""
        now = time.monotonic()
        left = self._left.seconds()
        times = shown_times(now - self._start, left)
        self._bars.update(
            self._total,
            description=self._summary(),
            completed=self._left.share(),
            note=times,
        )
        if self._bars.console.is_terminal or now < self._due:
            return
        self._due = now + LINE_INTERVAL
        self._silent = self._silent and left is None
        running = [f"{name} {note}" for name, note in self._notes.items()]
        self.note("; ".join([f"{self._summary()}, {times}", *running]))

    def _summary(self) -> str:
        return f"{self._num_ended} of {self._num_jobs} {self._phase}"

    def _remove(self, name: str) -> None:
        self._notes.pop(name, None)
        if name in self._tasks:
            self._bars.remove_task(self._tasks.pop(name))
