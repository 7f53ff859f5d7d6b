"""Shows progress on stderr: bars on a terminal, lines in a log."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
import contextlib
import copy
from dataclasses import dataclass, field
import datetime
import math
import re
import shutil
import sys
import threading
import time
from typing import Any, TextIO

from cns_drake.base.errors import printable
from cns_drake.base.progress import JobsListener, Listener, heard_by, listener

# Work that takes less time than this is not shown [s].
PATIENCE = 1.0
# Least time between two lines of a log [s].
_INTERVAL = 30.0
# How often it is checked whether something must be shown [s].
_TICK = 0.25
# Part of a fingerprint at the end of a job's name, which keeps it unique. Words
# and dates are none.
_FINGERPRINT = re.compile(r" (?=\S*\d)(?=\S*[a-f])(?:[0-9a-f]{6}|[0-9a-f]{8})$")
# A word that is a name, such as `riverside_01` or `scan.bin`.
_NAME = re.compile(r"[\d_./]")
# Length of a bar [characters].
_BAR = 20
# An estimate is made once this share of the work is done.
_LEAST_SHARE = 0.1
# No estimate is made before this time [s]: the first scans also load programs
# and cities.
_LEAST_TIME = 3.0
# The pace is steady if its two halves differ by at most this factor.
_STEADY = 1.25
# A job that takes less than this share of its expected time was done before. It
# is left out of the pace.
_REAL_SHARE = 0.05
# Work that is older than this share of all work hardly counts in the pace of
# jobs, which follows the load of the machine.
_MEMORY = 0.25


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

    def expected(self) -> float:
        """Returns the expected time of what was not done before [s]."""
        return self.cost * (1.0 - (self.first or 0.0))


@dataclass
class _PaceOfJobs:
    """Time that jobs take, divided by their expected time.

    Attributes:
        expected: expected time of the jobs that have ended, a weighted sum [s].
        taken: the time that these jobs took, with the same weights [s].
    """

    expected: float = 0.0
    taken: float = 0.0

    def measure(self, expected: float, taken: float, kept: float) -> None:
        """Records a job, after all earlier jobs were weighted by `kept`."""
        self.expected = kept * self.expected + expected
        self.taken = kept * self.taken + taken


@dataclass
class _Paces:
    """Paces of all jobs, and of each kind of jobs.

    Attributes:
        memory: expected time of later jobs after which a job hardly counts [s].
        of_all: pace of all jobs.
        of_kind: kind of jobs -> its pace.
    """

    memory: float
    of_all: _PaceOfJobs = field(default_factory=_PaceOfJobs)
    of_kind: dict[str, _PaceOfJobs] = field(default_factory=dict)

    def measure(self, name: str, expected: float, taken: float) -> None:
        """Records a job with its expected time and the time it took [s]."""
        kept = math.exp(-expected / self.memory)
        of_kind = self.of_kind.setdefault(_kind(name), _PaceOfJobs())
        for pace in (self.of_all, of_kind):
            pace.measure(expected, taken, kept)

    def of(self, name: str) -> float:
        """Returns the time that a job takes, divided by its expected time."""
        pace = self.of_kind.get(_kind(name), self.of_all)
        return pace.taken / pace.expected


class TimeLeft:
    """Estimates the time left for jobs from the jobs that have ended.

    The time that these jobs took, divided by their expected time, is the pace
    of the jobs of the same kind that are left. Jobs that ended lately count
    most. The pace of a kind of which no job has ended is that of all jobs,
    because machines differ in how fast they do one kind of work.

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
        self._paces = _Paces(_MEMORY * self._total)

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
            self._measured += work.expected()
            self._paces.measure(name, work.expected(), taken)

    def share(self) -> float:
        """Returns the share of all work that has ended, 0 to 1."""
        works = self._works.values()
        ended = sum(work.cost for work in works if work.is_ended)
        return ended / max(self._total, 1e-9)

    def seconds(self, now: float) -> float | None:
        """Returns the time left [s]; None while it cannot be estimated."""
        left = [
            (name, work)
            for name, work in self._works.items()
            if not work.is_ended
        ]
        if not left:
            return 0.0
        if not self._paces.of_all.expected:
            return None
        # A job that takes longer than expected counts as if it ended now, since
        # the machine may have become slower.
        paces = copy.deepcopy(self._paces)
        for name, work in left:
            expected = work.expected() * self._paces.of(name)
            if work.since is not None and now - work.since > expected:
                paces.measure(name, work.expected(), now - work.since)
        running, waiting = [], []
        begun = 0.0
        for name, work in left:
            needed = work.cost * paces.of(name)
            if work.since is None:
                waiting.append(needed)
            else:  # One that takes longer than expected soon ends, perhaps.
                spent = now - work.since + needed * (work.first or 0.0)
                running.append(max(needed - spent, 0.1 * needed))
                begun += work.cost * min((now - work.since) / needed, 1.0)
        if self._measured + begun < _LEAST_SHARE * self._total:
            return None
        # As many jobs run side by side as before, and the longest job bounds
        # the time.
        side_by_side = min(self._most_running, len(left))
        even = (sum(running) + sum(waiting)) / side_by_side
        return max(even, *running, 0.0)


def _kind(name: str) -> str:
    """Returns the kind of a job, the first of several words of its name.

    Jobs that record drives have the names of the drives, which are one word.
    """
    kind, *rest = name.split(maxsplit=1)
    return kind if rest else ""


@dataclass
class _Task:
    """What the program, or one of its jobs, does.

    Attributes:
        name: name of the job; empty for the program itself.
        activity: what it does.
        done: how much of it is done.
        total: how much there is to do; 0 if that is not known.
        unit: what `done` and `total` count.
        since: when the activity was counted for the first time [s].
        first: how much was done at the time `since`, for example by an earlier
            run.
        pace: pace of the activity.
    """

    name: str = ""
    activity: str = ""
    done: int = 0
    total: int = 0
    unit: str = ""
    since: float = 0.0
    first: int = 0
    pace: Pace = field(default_factory=Pace)

    def update(
        self, activity: str, done: int, total: int, unit: str, now: float
    ) -> None:
        """Records what is done."""
        if activity != self.activity or not self.total or done < self.done:
            self.since = now
            self.first = done
            self.pace = Pace()
        self.activity = activity
        self.done = done
        self.total = total
        self.unit = unit
        self.pace.measure(done - self.first, now - self.since)

    def text(self) -> str:
        """Returns what is done, and how far it is."""
        counted = ""
        if self.total:
            counted = f"{self.done} of {self.total} {self.unit}".rstrip()
        what = ", ".join(filter(None, (self.activity, counted)))
        return ": ".join(filter(None, (shown_name(self.name), what)))

    def in_words(self) -> str:
        """Returns what is done, without names and numbers."""
        words = [one for one in self.activity.split() if not _NAME.search(one)]
        return " ".join([*words, self.unit]).rstrip()

    def left(self) -> float | None:
        """Returns the time left for this activity [s], if it can be told."""
        if not 0 < self.done < self.total:
            return None
        pace = self.pace.steady(self.total - self.first)
        return None if pace is None else pace * (self.total - self.done)


def shown_name(name: str) -> str:
    """Returns the name of a job without the fingerprint at its end, if any."""
    return _FINGERPRINT.sub("", name)


def shown_times(elapsed: float, left: float | None) -> str:
    """Returns elapsed time and time left as text, both given in [s].

    The time left is omitted if it is None.
    """
    text = f"elapsed {_clock(elapsed)}"
    return text if left is None else f"{text}, about {_clock(left)} left"


def _clock(seconds: float) -> str:
    text = str(datetime.timedelta(seconds=round(seconds)))
    return text.removeprefix("0:").removeprefix("0")


class Display(Listener):
    """Shows on a stream what the program does, while the `with` block runs.

    On a terminal, the last lines show the progress: one line for the program,
    or for all of its jobs, and one for each running job. In a file or pipe, a
    line is printed at most every half a minute. Work that ends at once is not
    shown.
    """

    def __init__(
        self,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ):
        """Makes a display.

        Args:
            stream: where it is shown; stderr by default.
            clock: returns the present time [s].
        """
        self._stream = sys.stderr if stream is None else stream
        self._is_terminal = self._stream.isatty()
        self._now = clock
        self._start = clock()
        self._own = _Task()
        self._jobs: _JobsDisplay | None = None
        # When a line was printed last.
        self._printed = -math.inf
        # Number of lines at the bottom of the terminal that are ours.
        self._num_drawn = 0
        self._ends_line = True
        self._lock = threading.RLock()
        self._ended = threading.Event()

    def __enter__(self) -> Display:
        self._streams = sys.stdout, sys.stderr
        if self._is_terminal:
            if sys.stdout is not None and sys.stdout.isatty():
                sys.stdout = _StreamAbove(sys.stdout, self)
            sys.stderr = _StreamAbove(sys.stderr, self)
        threading.Thread(target=self._keep_telling, daemon=True).start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        with self._lock:
            self._erase()
        sys.stdout, sys.stderr = self._streams

    def doing(
        self, activity: str, done: int = 0, total: int = 0, unit: str = ""
    ) -> None:
        with self._lock:
            self._own.update(activity, done, total, unit, self._now())
        if not self._is_terminal:
            self.refresh()

    @contextlib.contextmanager
    def jobs(
        self, costs: Mapping[str, float], num_done: int, unit: str
    ) -> Iterator[_JobsDisplay]:
        shown = _JobsDisplay(self, costs, num_done, unit, self._now)
        with self._lock:
            before = self._jobs
            self._jobs = shown
        try:
            yield shown
        finally:
            with self._lock:
                self._jobs = before

    def refresh(self) -> None:
        """Updates the display, if an update is due."""
        with self._lock:
            now = self._now()
            if self._ended.is_set() or now < self._start + PATIENCE:
                return
            if self._is_terminal:
                self._draw(now)
            elif now >= self._printed + _INTERVAL and (text := self._line(now)):
                self._printed = now
                self._write(f"{printable(text)}\n")

    @contextlib.contextmanager
    def erased(self) -> Iterator[None]:
        """Removes the display while other text is written on the terminal."""
        with self._lock:
            self._erase()
            yield

    def note_end(self, text: str) -> None:
        """Records the end of the last other text on the terminal."""
        self._ends_line = text.endswith("\n")

    def _keep_telling(self) -> None:
        while not self._ended.wait(_TICK):
            self.refresh()

    def _line(self, now: float) -> str:
        """Returns all that is done as one line, for a log."""
        if self._jobs is not None:
            return self._jobs.line(now)
        return "; ".join(line for line, _ in self._rows(now))

    def _rows(self, now: float) -> list[tuple[str, float | None]]:
        """Returns each line, and the share that is done, if it is known."""
        if self._jobs is not None:
            return self._jobs.rows(now)
        if not self._own.activity:
            return []
        return [(_shown(self._own, now - self._start), _share(self._own))]

    def _erase(self) -> None:
        if self._num_drawn:
            # Up by as many lines, to their begin; then clear what is below.
            self._write(f"\x1b[{self._num_drawn}F\x1b[J")
            self._num_drawn = 0

    def _write(self, text: str) -> None:
        # That the stream takes no text is no fault of the work.
        with contextlib.suppress(OSError, ValueError):
            self._stream.write(text)
            self._stream.flush()

    def _draw(self, now: float) -> None:
        if not self._ends_line:
            return
        columns, rows = shutil.get_terminal_size()
        lines = self._bars(now)[: max(rows - 1, 1)]
        self._erase()
        # A terminal may wrap a line that ends at its edge.
        shown = [f"{printable(line)[: columns - 1]}\n" for line in lines]
        self._write("".join(shown))
        self._num_drawn = len(lines)

    def _bars(self, now: float) -> list[str]:
        return [
            line if share is None else f"{line}  {_bar(share)}"
            for line, share in self._rows(now)
        ]


def _shown(task: _Task, elapsed: float) -> str:
    return f"{task.text()}, {shown_times(elapsed, task.left())}"


def _share(task: _Task) -> float | None:
    return task.done / task.total if task.total else None


def _bar(share: float) -> str:
    """Returns a bar of constant length, for a share from 0 to 1.

    The bar is full, and says 100 %, only if everything is done.
    """
    # Sums of shares have rounding errors.
    percent = min(math.floor(100.0 * share + 1e-6), 100)
    full = _BAR * percent // 100
    return f"[{'#' * full}{'.' * (_BAR - full)}] {percent} %"


@contextlib.contextmanager
def show_progress() -> Iterator[None]:
    """Shows the progress of the block on stderr, unless it is shown already."""
    if isinstance(listener(), Display):
        yield
        return
    with Display() as display, heard_by(display):
        yield


class _JobsDisplay(JobsListener):
    """Shows jobs that run side by side: one line for all, and one for each."""

    def __init__(
        self,
        display: Display,
        costs: Mapping[str, float],
        num_done: int,
        unit: str,
        clock: Callable[[], float],
    ):
        self._display = display
        self._left = TimeLeft(costs)
        self._tasks: dict[str, _Task] = {}
        self._num_ended = num_done
        self._num_jobs = num_done + len(costs)
        self._unit = unit
        self._now = clock
        self._start = clock()

    def start(self, name: str) -> None:
        self._left.start(name, self._now())
        self._tasks[name] = _Task(name, "starting")
        self._display.refresh()

    def doing(
        self,
        name: str,
        activity: str,
        done: int = 0,
        total: int = 0,
        unit: str = "",
    ) -> None:
        if name not in self._tasks:
            return
        if total:
            self._left.record_done_before(name, done / total)
        task = self._tasks[name]
        task.update(activity, done, total, unit, self._now())
        self._display.refresh()

    def end(self, name: str, fault: bool = False) -> None:
        self._left.end(name, self._now())
        self._num_ended += 1
        self._tasks.pop(name, None)
        self._display.refresh()

    def line(self, now: float) -> str:
        """Returns how far all jobs are, and what is done, as one line."""
        whole, *_ = self.rows(now)
        found = Counter(one.in_words() for one in list(self._tasks.values()))
        words = [
            f"{text} ({number} times)" if number > 1 else text
            for text, number in found.items()
        ]
        return ": ".join(filter(None, (whole[0], ", ".join(words))))

    def rows(self, now: float) -> list[tuple[str, float | None]]:
        """Returns a line for all jobs, and one for each running job.

        With each line comes the share that is done, if it is known.
        """
        times = shown_times(now - self._start, self._left.seconds(now))
        # Another thread may start and end jobs meanwhile.
        tasks = list(self._tasks.values())
        return [
            (f"{self._summary()}, {times}", self._left.share()),
            *((task.text(), _share(task)) for task in tasks),
        ]

    def _summary(self) -> str:
        return f"{self._num_ended} of {self._num_jobs} {self._unit} done"


class _StreamAbove:
    """A stream to the terminal whose text appears above the display."""

    def __init__(self, stream: TextIO, display: Display):
        self._stream = stream
        self._display = display

    def write(self, text: str) -> int:
        with self._display.erased():
            self._display.note_end(text)
            written = self._stream.write(text)
            self._stream.flush()
            return written

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
