"""Programs leave the handlers of signals in a state for their end."""

import contextlib
import signal

from cns_drake.base.interrupts import SIGNALS


@contextlib.contextmanager
def handlers_kept():
    """Restores the handlers of all signals that interrupt, after the block."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
