"""Shows progress on stderr: bars on a terminal, lines in a log."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from dataclasses import dataclass
import datetime
import sys
import threading
import time
from typing import TYPE_CHECKING, TextIO

from evaluation.base.errors import printable
from evaluation.base.progress import JobsListener, Listener, heard_by, listener

if TYPE_CHECKING:
    from rich.live import Live
    from rich.table import Table

# Work that takes less time than this is not shown [s].
PATIENCE = 1.0
# Time between two lines of a log [s].
_INTERVAL = 30.0
# A line of a log names at most this number of jobs.
_MOST_NAMED = 3
# Width of a bar [characters].
_BAR = 20
# An estimate is made once this share of the work is done.
_LEAST_SHARE = 0.1
# No estimate is made before this time [s]: the first scans also load programs
# and cities.
_LEAST_TIME = 3.0


@dataclass
class _Task:
    """What the program, or one of its jobs, does.

    Attributes:
        title: what the job works on; empty for the program itself.
        activity: what it does.
        done: how much of it is done.
        total: how much there is to do; 0 if that is not known.
        unit: what `done` and `total` count.
        since: when the activity was counted for the first time [s].
        first: how much was done at the time `since`, for example by an earlier
            run.
    """

    title: str = ""
    activity: str = ""
    done: int = 0
    total: int = 0
    unit: str = ""
    since: float = 0.0
    first: int = 0

    def update(
        self, activity: str, done: int, total: int, unit: str, now: float
    ) -> None:
        """Records what is done."""
        if activity != self.activity or not self.total or done < self.done:
            self.since = now
            self.first = done
        self.activity = activity
        self.done = done
        self.total = total
        self.unit = unit

    def text(self) -> str:
        """Returns what is done, and how far it is."""
        counted = ""
        if self.total:
            counted = f"{self.done} of {self.total} {self.unit}".rstrip()
        what = ", ".join(filter(None, (self.activity, counted)))
        return ": ".join(filter(None, (self.title, what)))

    def share(self) -> float | None:
        """Returns the share that is done, if it is known."""
        return self.done / self.total if self.total else None

    def left(self, now: float) -> float | None:
        """Returns the time left for this activity [s], if it can be told."""
        done, seconds = self.done - self.first, now - self.since
        is_early = done < _LEAST_SHARE * (self.total - self.first)
        if is_early or done <= 0 or seconds < _LEAST_TIME:
            return None
        return seconds / done * (self.total - self.done)


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
    line is printed every half a minute. Work that ends at once is not shown.
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
        self._now = clock
        self._start = clock()
        self._own = _Task()
        self._jobs: _JobsDisplay | None = None
        self._live: Live | None = None
        self._lock = threading.Lock()
        self._ended = threading.Event()

    def __enter__(self) -> Display:
        threading.Thread(target=self._keep_telling, daemon=True).start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        with self._lock:
            if self._live is not None:
                self._live.stop()

    def doing(
        self, activity: str, done: int = 0, total: int = 0, unit: str = ""
    ) -> None:
        self._own.update(activity, done, total, unit, self._now())

    @contextlib.contextmanager
    def jobs(
        self, num_jobs: int, num_done: int, unit: str
    ) -> Iterator[_JobsDisplay]:
        before = self._jobs
        self._jobs = _JobsDisplay(num_jobs, num_done, unit, self._now)
        try:
            yield self._jobs
        finally:
            self._jobs = before

    def line(self) -> str:
        """Returns all that is done as one line, for a log."""
        rows = [text for text, _ in self._rows()]
        more = len(rows) - 1 - _MOST_NAMED
        if more > 0:
            rows[-more:] = [f"and {more} more"]
        return printable("; ".join(rows))

    def _keep_telling(self) -> None:
        """Shows progress until the display ends."""
        if self._ended.wait(PATIENCE):
            return
        if self._stream.isatty():
            with self._lock:
                if not self._ended.is_set():
                    self._live = _live(self._stream, self._table)
                    self._live.start()
            return
        while True:
            # That the stream takes no text is no fault of the work.
            with contextlib.suppress(OSError, ValueError):
                if line := self.line():
                    print(line, file=self._stream, flush=True)
            if self._ended.wait(_INTERVAL):
                return

    def _rows(self) -> list[tuple[str, float | None]]:
        """Returns each line, and the share that is done, if it is known."""
        now = self._now()
        if self._jobs is not None:
            return self._jobs.rows(now)
        own = self._own
        if not own.activity:
            return []
        times = shown_times(now - self._start, own.left(now))
        return [(", ".join(filter(None, (own.text(), times))), own.share())]

    def _table(self) -> Table:
        """Returns the lines with their bars, for a terminal."""
        from rich.progress_bar import ProgressBar
        from rich.table import Table
        from rich.text import Text

        table = Table.grid(padding=(0, 1))
        table.add_column(no_wrap=True, overflow="ellipsis")
        for text, share in self._rows():
            bar = ProgressBar(1.0, share, _BAR) if share is not None else ""
            table.add_row(Text(printable(text)), bar)
        return table


def _live(stream: TextIO, table: Callable[[], Table]) -> Live:
    """Returns a display at the bottom of a terminal, below all other text."""
    from rich.console import Console
    from rich.live import Live

    # Other text is neither broken nor coloured.
    console = Console(
        file=stream, force_terminal=True, soft_wrap=True, highlight=False
    )
    return Live(
        console=console,
        transient=True,
        get_renderable=table,
        redirect_stdout=sys.stdout is not None and sys.stdout.isatty(),
    )


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
        num_jobs: int,
        num_done: int,
        unit: str,
        clock: Callable[[], float],
    ):
        self._tasks: dict[str, _Task] = {}
        self._num_jobs = num_jobs
        self._num_before = num_done
        self._num_ended = num_done
        self._unit = unit
        self._now = clock
        self._start = clock()

    def start(self, name: str) -> None:
        self._tasks[name] = _Task(name.replace("_", " "), "starting")

    def doing(
        self,
        name: str,
        activity: str,
        done: int = 0,
        total: int = 0,
        unit: str = "",
    ) -> None:
        if name in self._tasks:
            now = self._now()
            self._tasks[name].update(activity, done, total, unit, now)

    def end(self, name: str, fault: bool = False) -> None:
        self._num_ended += 1
        self._tasks.pop(name, None)

    def rows(self, now: float) -> list[tuple[str, float | None]]:
        """Returns a line for all jobs, and one for each running job.

        With each line comes the share that is done, if it is known.
        """
        # Other threads may start and end jobs meanwhile.
        tasks = dict(self._tasks)
        every = _Task(
            done=self._num_ended,
            total=self._num_jobs,
            since=self._start,
            first=self._num_before,
        )
        times = shown_times(now - self._start, every.left(now))
        done = f"{self._num_ended} of {self._num_jobs} {self._unit} done"
        return [
            (f"{done}, {times}", every.share()),
            *((one.text(), one.share()) for one in tasks.values()),
        ]
