"""A run in a process of its own, which reports each frame."""

import contextlib
import signal
import sys

from cns_drake.simulation import simulate
from evaluation.base.interrupts import INTERRUPTED, interrupt_on_termination


def run_and_report(scenario, output, sender):
    """Simulates, and sends the number of each frame.

    Exits with INTERRUPTED if SIGTERM has ended the run in good order.
    """
    status = INTERRUPTED
    with contextlib.suppress(KeyboardInterrupt):
        interrupt_on_termination()
        sender.send(0)
        simulate(
            scenario, output, on_frame=lambda done, total: sender.send(done)
        )
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        status = 0
    sys.exit(status)
