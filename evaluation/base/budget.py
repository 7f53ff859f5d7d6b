"""What reading a file of others may cost, which the system enforces.

A few kilobytes can declare, name or unpack to anything. While a file is read,
the process gets memory and processor time in proportion to the size of the
file, and no more, so that readers need not count.
"""

from collections.abc import Callable, Iterator
import contextlib
from contextvars import ContextVar
import functools
import inspect
import math
import mmap
import os
from pathlib import Path
import resource
import signal
import threading
import time
from types import FrameType
from typing import ParamSpec, TypeVar

from evaluation.base.errors import InputError

_Arguments = ParamSpec("_Arguments")
_Found = TypeVar("_Found")
# Memory [bytes] and processor time [s] for any file, and for each byte of it.
_MEMORY = 400e6
_MEMORY_PER_BYTE = 100.0
_SECONDS = 30.0
_SECONDS_PER_BYTE = 30e-6
# By what factor the user raises both.
_VARIABLE = "CNS_READING_BUDGET"
# The system refuses memory only so far beyond the budget [bytes]: libraries in
# C crash when it does.
_BEYOND = 300e6
# How often the system lets the process look at what it has taken [s].
_INTERVAL = 0.05
# The error is repeated after this time: a library can swallow the first [s].
_GRACE = 1.0
# Greatest ratio of a file's size to what it takes on a disk that compresses.
# A file with holes has any size.
_MOST_RATIO = 1000
_BLOCK = 512
# Only Linux tells how much memory a process can write to, and limits it.
_STATM = "/proc/self/statm"
_IS_KNOWN = os.path.exists(_STATM)
_DATA_COLUMN = 5


class _SpentError(BaseException):
    """The budget is spent; not an `Exception`, which parsers catch."""


class _Budget:
    """What this process may take until the end of reading.

    Attributes:
        memory: greatest size of its data [bytes].
        until: greatest process time [s].
    """

    def __init__(self, factor: float) -> None:
        self._factor = factor
        self._counted: set[tuple[int, int]] = set()
        self._is_over = False
        self.memory = _used_memory() + factor * _MEMORY
        self.until = time.process_time() + factor * _SECONDS
        self._limits = resource.getrlimit(resource.RLIMIT_DATA)
        self._timer = signal.getitimer(signal.ITIMER_PROF)
        self._handler = signal.signal(signal.SIGPROF, self._look)
        signal.siginterrupt(signal.SIGPROF, False)
        self._next_error = 0.0
        self.start()

    def _look(self, number: int, frame: FrameType | None) -> None:
        """Handles the timer's signal."""
        now = time.process_time()
        if self._is_over or now < self._next_error:
            return
        self._next_error = now + _GRACE
        if now > self.until:
            raise _SpentError("processor time")
        if _used_memory() > self.memory:
            raise _SpentError("memory")
        self._next_error = 0.0

    def add_file(self, path: Path) -> None:
        """Adds what the size of a file allows, once for each file."""
        try:
            status = os.stat(path)
        except OSError:
            return
        identity = status.st_dev, status.st_ino
        if identity not in self._counted:
            self._counted.add(identity)
            size = self._factor * _size(status)
            self.memory += _MEMORY_PER_BYTE * size
            self.until += _SECONDS_PER_BYTE * size
            self.start()

    def start(self) -> None:
        """Makes the system enforce the budget."""
        signal.setitimer(signal.ITIMER_PROF, _INTERVAL, _INTERVAL)
        if _IS_KNOWN:
            _limit(resource.RLIMIT_DATA, self.memory + _BEYOND)

    def stop(self) -> None:
        """Lets the process take what it could before."""
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        resource.setrlimit(resource.RLIMIT_DATA, self._limits)

    def end(self) -> None:
        """Leaves the process as it was."""
        self._is_over = True
        self.stop()
        # A signal that still waits is discarded; it could end the process.
        signal.signal(signal.SIGPROF, signal.SIG_IGN)
        signal.signal(signal.SIGPROF, self._handler or signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, *self._timer)


# The system limits processes, so there is one budget, of the main thread.
_CURRENT: ContextVar[_Budget | None] = ContextVar("budget", default=None)


@contextlib.contextmanager
def reading(path: Path) -> Iterator[None]:
    """Limits what the block, which reads a file, may take of the system.

    Within another such block, the size of the file adds to what the other may
    take. Python handles signals in the main thread only, so blocks of other
    threads have no limit of their own. A call of a library in C ends before the
    time is looked at.

    Args:
        path: the file, or a folder whose files are read in further blocks.

    Raises:
        InputError: the block takes more memory or processor time than a file of
            this size needs.
    """
    budget, own = _CURRENT.get(), None
    if budget is None and threading.current_thread() is threading.main_thread():
        budget = own = _Budget(_factor())
        _CURRENT.set(own)
    try:
        if budget is not None:
            budget.add_file(path)
        yield
    except MemoryError as error:
        raise InputError(_fault(path, "memory")) from error
    except _SpentError as error:
        raise InputError(_fault(path, str(error))) from error
    finally:
        if own is not None:
            own.end()
            _CURRENT.set(None)


def reads(
    function: Callable[_Arguments, _Found],
) -> Callable[_Arguments, _Found]:
    """Makes the block of `reading` of a function, whose first argument is read.

    The argument is a path, also as text.
    """
    first = next(iter(inspect.signature(function).parameters))

    @functools.wraps(function)
    def limited(*args: _Arguments.args, **named: _Arguments.kwargs) -> _Found:
        # Without the argument, Python says what is missing.
        path = args[0] if args else named.get(first, "")
        with reading(Path(str(path))):
            return function(*args, **named)

    return limited


@contextlib.contextmanager
def not_counted() -> Iterator[None]:
    """Takes a block, such as a compilation, out of what reading may cost."""
    budget = _CURRENT.get()
    if budget is None:
        yield
        return
    seconds, memory = time.process_time(), _used_memory()
    budget.stop()
    try:
        yield
    finally:
        budget.until += time.process_time() - seconds
        budget.memory += _used_memory() - memory
        budget.start()


def limit_process(path: Path) -> None:
    """Limits this process, which does nothing but read files, as `reading`.

    The system ends the process when the time is over, also within a library.
    """
    size = _size(os.stat(path))
    seconds = time.process_time() + _factor() * (
        _SECONDS + _SECONDS_PER_BYTE * size
    )
    _limit(resource.RLIMIT_CPU, seconds)
    if _IS_KNOWN:
        memory = _factor() * (_MEMORY + _MEMORY_PER_BYTE * size)
        _limit(resource.RLIMIT_DATA, _used_memory() + memory + _BEYOND)


def _limit(kind: int, most: float) -> None:
    """Sets a limit of this process, up to the one that its user has set."""
    _, hard = resource.getrlimit(kind)
    limit = math.ceil(most)
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(kind, (limit, hard))


def _used_memory() -> int:
    """Returns the size of this process's data [bytes]; 0 if unknown."""
    if not _IS_KNOWN:
        return 0
    with open(_STATM, "rb", 0) as stream:
        return int(stream.read().split()[_DATA_COLUMN]) * mmap.PAGESIZE


def _size(status: os.stat_result) -> int:
    """Returns what a file has of its size, without holes [bytes]."""
    return min(status.st_size, _MOST_RATIO * _BLOCK * max(status.st_blocks, 1))


def _factor() -> float:
    """Returns the factor that the user has set."""
    text = os.environ.get(_VARIABLE) or "1"
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not 0.0 < factor < math.inf:
        raise InputError(f"{_VARIABLE}: {text!r} is no positive number")
    return factor


def _fault(path: Path, what: str) -> str:
    return (
        f"{path}: takes more {what} to read than a file of its size should;"
        f" {_VARIABLE}=4 allows four times as much"
    )
