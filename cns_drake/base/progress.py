"""What long work says about itself: what it does, and how far it is.

Work says so wherever it is called from, as a library writes to a log. Who
starts the work decides who hears it: the command line shows it on stderr, the
process of a job sends it to its parent, and by default nobody hears it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
import contextlib
from contextvars import ContextVar
from typing import TypeVar

_Item = TypeVar("_Item")


class Listener:
    """Hears what work does. This one ignores all that it hears."""

    def doing(
        self, activity: str, done: int = 0, total: int = 0, unit: str = ""
    ) -> None:
        """Hears what is done from now on, and how far it is.

        Args:
            activity: what is done, such as `reading the stage`.
            done: how much of it is done.
            total: how much there is to do; 0 if that is not known.
            unit: what `done` and `total` count, such as `scans`.
        """

    def jobs(
        self, costs: Mapping[str, float], num_done: int, unit: str
    ) -> contextlib.AbstractContextManager[JobsListener]:
        """Returns a context manager whose value hears of jobs.

        Args:
            costs: name of each job that is left -> expected time on one core
                [s].
            num_done: number of further jobs that were done before.
            unit: what the jobs are, such as `cities`.
        """
        return contextlib.nullcontext(JobsListener())


class JobsListener:
    """Hears what jobs do that run side by side. This one ignores it."""

    def start(self, name: str) -> None:
        """Hears that a job starts, or is started again."""

    def doing(
        self,
        name: str,
        activity: str,
        done: int = 0,
        total: int = 0,
        unit: str = "",
    ) -> None:
        """Hears what a job does; see `Listener.doing`."""

    def end(self, name: str, fault: bool = False) -> None:
        """Hears that a job has ended; if `fault` is true, with an error."""


_NOBODY = Listener()
_listener: ContextVar[Listener] = ContextVar("listener", default=_NOBODY)
# What the loops around are about, and how far they are: the outermost first.
_loops: ContextVar[tuple[tuple[str, int, int, str], ...]] = ContextVar(
    "loops", default=()
)


def listener() -> Listener:
    """Returns who hears what work does here."""
    return _listener.get()


@contextlib.contextmanager
def heard_by(one: Listener) -> Iterator[None]:
    """Makes a listener hear what the work of the `with` block does.

    Other threads than the present one are not heard.
    """
    token = _listener.set(one)
    try:
        yield
    finally:
        _listener.reset(token)


def doing(activity: str, done: int = 0, total: int = 0, unit: str = "") -> None:
    """Says what is done from now on; see `Listener.doing`."""
    _listener.get().doing(activity, done, total, unit)


def track(
    items: Iterable[_Item], activity: str, total: int, unit: str
) -> Iterator[_Item]:
    """Yields the items of a long loop, and says how far it is.

    After a loop inside another one, the work is that of the outer loop again.

    Args:
        items: the items.
        activity: what is done with them, such as `reading scans`.
        total: their number.
        unit: what they are.
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
