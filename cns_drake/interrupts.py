"""Interrupts of a simulation, which come up between its frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import signal
import threading

from evaluation.interrupts import SIGNALS


@contextlib.contextmanager
def interrupts_wait() -> Iterator[Callable[[], None]]:
    """Makes an interrupt wait for the next call of what is yielded.

    Raised anywhere, its exception can come up inside the conversion of
    arguments for a C++ function, which takes it for a type that does not fit
    and goes on with another error. A second one, before the first has
    struck, strikes at once; later ones do not disturb the closing. Signals
    that are ignored, or that end the process, stay so.
    """
    handlers = {}
    # Only there can handlers be set, and only there they run.
    if threading.current_thread() is threading.main_thread():
        handlers = {
            number: handler
            for number in SIGNALS
            if callable(handler := signal.getsignal(number))
        }
    waiting: list[int] = []
    struck: list[int] = []

    def wait(number, frame):
        waiting.append(number)
        if len(waiting) > 1 and not struck:
            struck.append(number)
            handlers[number](number, frame)

    def strike() -> None:
        if waiting and not struck:
            struck.append(waiting[0])
            raise KeyboardInterrupt

    for number in handlers:
        signal.signal(number, wait)
    try:
        yield strike
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if waiting and not struck:
            signal.raise_signal(waiting[0])
