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
import multiprocessing
from multiprocessing.connection import Connection, Pipe
import os
import signal
import sys
import threading
from typing import Any, TypeVar

from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.jobs.processes import end_with_parent
from cns_drake.base.process import num_cores

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
# Items are handed out in this many parts, so that no process waits long for
# another one at the end.
_PARTS = 16
# A call is handed out by its number, in this many bytes.
_NUMBER = 4
# What a call has returned, or raised.
_Outcome = tuple[Any, Exception | None]


def side_by_side(calls: Sequence[Callable[[], Any]]) -> list[Any]:
    """Returns what calls return, made by as many processes as there are cores.

    One of them is this process. It makes all calls where processes cannot be
    forked safely: beside threads, whose locks would stay locked, and on systems
    other than Linux.

    Args:
        calls: functions of which nothing but the result and written files
            remains, and none of which needs another one; the longest should
            come first.

    Raises:
        Exception: what the first of the failing calls raises.
    """
    wanted = min(num_cores(), len(calls)) - 1 if _can_fork() else 0
    with contextlib.ExitStack() as stack:
        numbers = _numbers(len(calls))
        stack.callback(os.close, numbers)
        make = partial(_made, calls, numbers)
        waits = []
        with contextlib.suppress(OSError):  # Perhaps there are too many.
            for _ in range(wanted):
                waits.append(stack.enter_context(_helper(make)))
        found = make()
        for wait in waits:
            made, _ = wait() or ({}, None)
            found |= made
    # A process that died, for lack of memory, left its calls to this one.
    return [
        _result(found[k]) if k in found else call()
        for k, call in enumerate(calls)
    ]


@contextlib.contextmanager
def begun(call: Callable[[], _Result]) -> Iterator[Callable[[], _Result]]:
    """Begins a call, by a forked process, and yields what waits for its result.

    This process can make calls side by side meanwhile. Without a second core,
    or where no process can be forked, it makes the call when it waits.

    Args:
        call: a function of which nothing but the result remains.

    Yields:
        What returns the result, or raises what the call raises; to be called
        once.
    """
    with contextlib.ExitStack() as stack:
        wait: Callable[[], _Outcome | None] | None = None
        if _can_fork() and num_cores() > 1:
            with contextlib.suppress(OSError):
                wait = stack.enter_context(_helper(call))

        def result() -> _Result:
            outcome = None if wait is None else wait()
            return call() if outcome is None else _result(outcome)

        yield result


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
    """Returns the outcomes of the calls that are left for this process."""
    found = {}
    while taken := os.read(numbers, _NUMBER):
        number = int.from_bytes(taken, "little")
        found[number] = _outcome(calls[number])
    return found


def _outcome(call: Callable[[], Any]) -> _Outcome:
    try:
        return call(), None
    except Exception as error:
        return None, error


def _result(outcome: _Outcome) -> Any:
    """Returns what a call returned, or raises what it raised."""
    result, error = outcome
    if error is not None:
        raise error
    return result


@contextlib.contextmanager
def _helper(
    call: Callable[[], Any],
) -> Iterator[Callable[[], _Outcome | None]]:
    """Has a forked process make a call; ends the process at last.

    Yields:
        What waits for the outcome; it returns None if the process has died.
    """
    ours, theirs = Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(
        target=_help, args=(call, theirs)
    )

    def wait() -> _Outcome | None:
        with contextlib.suppress(EOFError, ConnectionError):
            return ours.recv()
        return None

    with ours:
        # An interrupt here would have both processes tidy up.
        with theirs, uninterrupted():
            process.start()
        try:
            yield wait
        finally:
            process.kill()
            process.join()


def _help(call: Callable[[], Any], connection: Connection) -> None:
    """Makes a call; the whole forked process."""
    # The parent ends this process, and Ctrl-C does not.
    os.setsid()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=end_with_parent, daemon=True).start()
    # Garbage collection would write to memory that the processes share.
    gc.freeze()
    outcome = _outcome(call)
    # Nothing of the parent's is to be closed or removed here.
    with contextlib.suppress(Exception):
        connection.send(outcome)
    os._exit(0)
