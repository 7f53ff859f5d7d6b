"""Calls side by side, in processes forked from this one.

A forked process has all that its parent has read, and sends back results only.
That suits calls of a second or less, for which a `Step` with its own process
and files is too much.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
from functools import partial
import gc
from itertools import chain
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import os
import pickle
import signal
import sys
import threading
from typing import Any, NoReturn, TypeVar

from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.jobs.job_process import end_with_parent
from cns_drake.base.process import num_cores

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
# Items are handed out in this many parts, so that no process waits long for
# another one at the end.
_PARTS = 16
# A call is handed out by its number, in this many bytes.
_NUMBER = 4
# What a call has given, or raised.
_Outcome = tuple[Any, Exception | None]


def side_by_side(calls: Sequence[Callable[[], Any]]) -> list[Any]:
    """Returns what calls return, made by as many processes as there are cores.

    One of them is this process. It makes all calls where processes cannot be
    forked safely: beside threads, whose locks would stay locked, and on systems
    other than Linux.

    Args:
        calls: of which nothing but the result and written files remains, and
            none needs another one; the longest should come first.

    Raises:
        Exception: what the first of the failing calls raises.
    """
    wanted = min(num_cores(), len(calls)) - 1 if _can_fork() else 0
    found: dict[int, _Outcome] = {}
    with contextlib.ExitStack() as stack:
        numbers = _numbers(len(calls))
        stack.callback(os.close, numbers)
        helpers: list[_Helper] = []
        with contextlib.suppress(OSError):  # Perhaps there are too many.
            for _ in range(wanted):
                helper = _Helper(calls, numbers, helpers)
                stack.callback(helper.end)
                helpers.append(helper)
        found |= _made(calls, numbers)
        for helper in helpers:
            found |= helper.found()
    results = []
    for number, call in enumerate(calls):
        if number not in found:  # Its process has died, for lack of memory.
            found[number] = call(), None
        result, error = found[number]
        if error is not None:
            raise error
        results.append(result)
    return results


@contextlib.contextmanager
def begun(call: Callable[[], _Result]) -> Iterator[Callable[[], _Result]]:
    """Begins a call, by a forked process, and yields what waits for its result.

    This process can make calls side by side meanwhile. Without a second core,
    or where no process can be forked, it makes the call when it waits.

    Args:
        call: of which nothing but the result remains.

    Yields:
        What returns the result, or raises what the call raises; to be called
        once.
    """
    with contextlib.ExitStack() as stack:
        helper: _Helper | None = None
        if _can_fork() and num_cores() > 1:
            numbers = _numbers(1)
            stack.callback(os.close, numbers)
            with contextlib.suppress(OSError):
                helper = _Helper([call], numbers, [])
                stack.callback(helper.end)

        def wait() -> _Result:
            found = {} if helper is None else helper.found()
            if not found:
                return call()
            result, error = found[0]
            if error is not None:
                raise error
            return result

        yield wait


def mapped(
    function: Callable[[_Item], _Result], items: Sequence[_Item]
) -> list[_Result]:
    """Returns a function's results for items; see `side_by_side`."""
    size = -(-len(items) // _PARTS)
    parts = [items[k : k + size] for k in range(0, len(items), size or 1)]
    calls = [partial(_of_part, function, part) for part in parts]
    return list(chain.from_iterable(side_by_side(calls)))


def _can_fork() -> bool:
    return sys.platform == "linux" and threading.active_count() == 1


def _of_part(
    function: Callable[[_Item], _Result], part: Sequence[_Item]
) -> list[_Result]:
    return [function(item) for item in part]


def _numbers(count: int) -> int:
    """Returns a pipe from which processes take numbers, each given once."""
    numbers, writing = os.pipe()
    # A pipe takes 64 kB without a reader.
    with open(writing, "wb") as file:
        for number in range(count):
            file.write(number.to_bytes(_NUMBER, "little"))
    return numbers


def _made(
    calls: Sequence[Callable[[], Any]], numbers: int
) -> dict[int, _Outcome]:
    """Returns what the calls that are left for this process give."""
    found: dict[int, _Outcome] = {}
    while taken := os.read(numbers, _NUMBER):
        number = int.from_bytes(taken, "little")
        try:
            found[number] = calls[number](), None
        except Exception as error:
            found[number] = None, error
    return found


class _Helper:
    """A forked process that makes calls."""

    def __init__(
        self,
        calls: Sequence[Callable[[], Any]],
        numbers: int,
        others: Sequence[_Helper],
    ):
        """Begins to make calls.

        Args:
            calls: of all processes.
            numbers: the pipe from which it takes the numbers of its calls.
            others: the helpers before it.
        """
        self._connection, theirs = Pipe()
        # Here an interrupt would have both processes tidy up.
        with theirs, uninterrupted():
            self._process = os.fork()
            if self._process == 0:
                # Each pipe then ends with the first process.
                for helper in (*others, self):
                    helper._connection.close()
                _help(calls, numbers, theirs)

    def found(self) -> dict[int, _Outcome]:
        """Waits for the results; without those of a process that has died."""
        with contextlib.suppress(EOFError, ConnectionError):
            return pickle.loads(self._connection.recv_bytes())
        return {}

    def end(self) -> None:
        os.kill(self._process, signal.SIGKILL)
        os.waitpid(self._process, 0)
        self._connection.close()


def _help(
    calls: Sequence[Callable[[], Any]], numbers: int, connection: Connection
) -> NoReturn:
    """Makes calls; the whole forked process."""
    try:
        # The parent ends this process, and Ctrl-C does not.
        os.setsid()
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        threading.Thread(
            target=end_with_parent, args=(connection,), daemon=True
        ).start()
        # Garbage collection would write to memory that the processes share.
        gc.freeze()
        connection.send_bytes(pickle.dumps(_made(calls, numbers)))
    finally:
        # Nothing of the parent's is to be closed or removed here.
        os._exit(0)
