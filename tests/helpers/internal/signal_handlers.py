"""Signals during programs that run in the process of a test."""

import contextlib
import signal

from evaluation.base import program, progress_display
from evaluation.base.interrupts import INTERRUPTED, SIGNALS


@contextlib.contextmanager
def handlers_kept():
    """Restores the handlers of all signals that interrupt, after the block."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def interrupt_at(patch, count, number):
    """Has a program interrupted at one of its reports of progress.

    Args:
        patch: undoes it.
        count: number of the report.
        number: number of the signal.
    """
    left = [count]

    def doing(*report):
        left[0] -= 1
        if left[0] == 0:
            signal.raise_signal(number)

    def end_interrupted():
        raise SystemExit(INTERRUPTED)

    patch.setattr(program.interrupts, "end_interrupted", end_interrupted)
    patch.setattr(progress_display.Display, "doing", doing)
