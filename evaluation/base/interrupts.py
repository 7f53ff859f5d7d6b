"""Ctrl-C and SIGTERM: when they can interrupt, and how they end a process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import os
import signal
import sys
import threading
from types import FrameType
from typing import NoReturn

# Exit status of a process that was interrupted, as shells have it.
INTERRUPTED = 130
# The signals that interrupt.
SIGNALS = (signal.SIGINT, signal.SIGTERM)
# The file descriptor of standard error.
_STDERR = 2
_Handler = Callable[[int, FrameType | None], object]


def interrupt_on_termination(once: bool = False) -> Callable[[], bool]:
    """Makes SIGTERM raise KeyboardInterrupt, so that open files are closed.

    SIGINT raises it anyway, unless the process was started to ignore SIGINT. An
    interrupt that a destructor swallows is raised again.

    Args:
        once: whether further SIGTERM signals are ignored after the first, and
            cannot interrupt the closing of files. Then only SIGKILL, sent by a
            parent process, can end a process that hangs.

    Returns:
        A function that returns whether a signal has raised KeyboardInterrupt. A
        library can turn the KeyboardInterrupt into an error of another type.
    """
    raised: list[int] = []

    def interrupt(signal_number: int, frame: FrameType | None) -> None:
        raised.append(signal_number)
        if once and signal_number == signal.SIGTERM:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)
    if callable(signal.getsignal(signal.SIGINT)):
        signal.signal(signal.SIGINT, interrupt)
    sys.unraisablehook = _repeat_interrupt
    return lambda: bool(raised)


def _repeat_interrupt(lost: sys.UnraisableHookArgs) -> None:
    if lost.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(lost)
        return
    # What is raised here would be swallowed, too.
    threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGTERM)).start()


@contextlib.contextmanager
def _handled_by(handle: _Handler) -> Iterator[dict[int, _Handler]]:
    """Sets a handler of `SIGNALS` for the block; yields the former handlers.

    A signal that is ignored, or has the default action, keeps its action.
    Python sets and runs handlers in the main thread only.
    """
    before: dict[int, _Handler] = {
        number: handler
        for number in SIGNALS
        if threading.current_thread() is threading.main_thread()
        and callable(handler := signal.getsignal(number))
    }
    for number in before:
        signal.signal(number, handle)
    try:
        yield before
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Delays interrupts until the end of the block, an import in a library.

    An extension module that is interrupted during its initialisation fails with
    an unrelated error, or crashes the process later. Blocking the signals would
    not help, because a library's threads can receive the signals as well.
    """
    waiting: list[int] = []
    try:
        with _handled_by(lambda number, frame: waiting.append(number)):
            yield
    finally:
        if waiting:
            signal.raise_signal(waiting[0])


@contextlib.contextmanager
def ended_by_interrupts(program: str) -> Iterator[None]:
    """Ends the process at the first interrupt of the block, an import.

    For a program that has written nothing yet, so that nobody waits until all
    is imported. No exception is raised, see `uninterrupted`.

    Args:
        program: name of the program, for the message.
    """

    def end(number: int, frame: FrameType | None) -> None:
        # The last line may be a bar, without a cursor.
        begin = "\r\x1b[2K\x1b[?25h" if os.isatty(_STDERR) else ""
        # What is interrupted may hold the lock of `sys.stderr`.
        os.write(_STDERR, f"{begin}{program}: interrupted\n".encode())
        end_interrupted()

    with _handled_by(end):
        yield


@contextlib.contextmanager
def interrupts_wait() -> Iterator[Callable[[], None]]:
    """Delays interrupts until the block calls the yielded function.

    Without the delay, KeyboardInterrupt can be raised while the arguments of a
    C++ function are being converted. The interrupt is then reported as an
    argument of a wrong type. Only the first interrupt is delayed. A second
    interrupt takes effect at once, and further interrupts are ignored, so that
    files can be closed.
    """
    waiting: list[int] = []
    struck: list[int] = []

    def wait(number: int, frame: FrameType | None) -> None:
        waiting.append(number)
        if len(waiting) > 1 and not struck:
            struck.append(number)
            handlers[number](number, frame)

    def strike() -> None:
        if waiting and not struck:
            struck.append(waiting[0])
            raise KeyboardInterrupt

    try:
        with _handled_by(wait) as handlers:
            yield strike
    finally:
        if waiting and not struck:
            signal.raise_signal(waiting[0])


def ignore_interrupts() -> None:
    """Ignores all further interrupts, at the end of a process."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def end_interrupted() -> NoReturn:
    """Ends an interrupted process at once, without Python's shutdown.

    The shutdown can fail if a library was interrupted during a computation.
    Only standard output and standard error are flushed, no other open files.
    """
    for stream in (sys.stdout, sys.stderr):
        # An interrupted write cannot be flushed.
        with contextlib.suppress(OSError, ValueError, RuntimeError):
            stream.flush()
    # Nothing of `multiprocessing` is left in the temporary folder. Processes of
    # jobs end with this process; it does not wait for them.
    if util := sys.modules.get("multiprocessing.util"):
        with contextlib.suppress(Exception):
            util._exit_function(active_children=list)
    os._exit(INTERRUPTED)
