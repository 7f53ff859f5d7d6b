"""Progress reports of long tasks: what a task does, and how far it is.

A task reports its progress as a library writes to a log, without knowing who
reads the reports. The caller chooses the listener that receives the reports:
the command line shows them on stderr, and the process of a job sends them to
its parent process. By default, they are ignored.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import contextlib
from contextvars import ContextVar
from typing import TypeVar

_Item = TypeVar("_Item")


class Listener:
    """Receives progress reports of a task. This base class ignores them."""

    def doing(
        self, activity: str, done: int = 0, total: int = 0, unit: str = ""
    ) -> None:
        """Receives what the task does from now on, and how far it is.

        Args:
            activity: what is done, such as `reading the stage`.
            done: how much of the activity is done.
            total: how much there is to do; 0 if this is unknown.
            unit: what `done` and `total` count, such as `scans`.
        """

    def jobs(
        self, num_jobs: int, num_done: int, unit: str
    ) -> contextlib.AbstractContextManager[JobsListener]:
        """Returns a context manager whose value receives reports of jobs.

        The value may be called from any thread.

        Args:
            num_jobs: number of jobs.
            num_done: number of these jobs that were done before.
            unit: what the jobs are, such as `cities`.
        """
        return contextlib.nullcontext(JobsListener())


class JobsListener:
    """Receives reports of parallel jobs. This base class ignores them."""

    def start(self, name: str) -> None:
        """Receives the report that a job starts, or is started again."""

    def doing(
        self,
        name: str,
        activity: str,
        done: int = 0,
        total: int = 0,
        unit: str = "",
    ) -> None:
        """Receives what a job does; see `Listener.doing`."""

    def end(self, name: str, fault: bool = False) -> None:
        """Receives the report that a job ended, with an error if `fault`."""


_NOBODY = Listener()
_listener: ContextVar[Listener] = ContextVar("listener", default=_NOBODY)
# The latest report: activity, done, total and unit.
_latest: ContextVar[tuple[str, int, int, str] | None] = ContextVar(
    "latest", default=None
)
# What the loops around are about, and how far they are: the outermost first.
_loops: ContextVar[tuple[tuple[str, int, int, str], ...]] = ContextVar(
    "loops", default=()
)


def listener() -> Listener:
    """Returns the listener that receives progress reports here."""
    return _listener.get()


@contextlib.contextmanager
def heard_by(listener: Listener) -> Iterator[None]:
    """Makes a listener receive the progress reports of the `with` block.

    It does not receive the reports of other threads.
    """
    token = _listener.set(listener)
    before = _latest.set(None)
    try:
        yield
    finally:
        _latest.reset(before)
        _listener.reset(token)


def doing(activity: str, done: int = 0, total: int = 0, unit: str = "") -> None:
    """Reports what is done from now on; see `Listener.doing`."""
    _latest.set((activity, done, total, unit))
    _listener.get().doing(activity, done, total, unit)


@contextlib.contextmanager
def interlude(activity: str) -> Iterator[None]:
    """Reports an activity for the time of the `with` block.

    Afterwards, the earlier activity is reported again.
    """
    before = _latest.get()
    doing(activity)
    try:
        yield
    finally:
        if before:
            doing(*before)


def track(
    items: Iterable[_Item], activity: str, total: int, unit: str
) -> Iterator[_Item]:
    """Yields the items of a long loop, and reports how far the loop is.

    After an inner loop, the progress of the outer loop is reported again.

    Args:
        items: the items.
        activity: what is done with the items, such as `reading scans`.
        total: number of items.
        unit: what the items are, such as `scans`.
    """
    around = _loops.get()
    try:
        for done, item in enumerate(items):
            now = activity, done, total, unit
            _loops.set((*around, now))
            doing(*now)
            yield item
    finally:
        _loops.set(around)
    if around:
        doing(*around[-1])
