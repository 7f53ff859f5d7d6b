"""The process in which one job runs, and its messages to its parent.

A process each, with an interpreter of its own: what a job leaves in memory
goes with it (Python systems in a Drake diagram are not freed otherwise), and
whatever happens to one does not happen to the others.
"""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import os
import pickle
import signal
import subprocess
import sys
import threading
import traceback
from typing import Protocol

from cns_drake.base.errors import InputError, one_line
from cns_drake.base.files import exclusive
from cns_drake.base.interrupts import (
    end_interrupted,
    ignore_interrupts,
    interrupt_on_termination,
    uninterrupted,
)
from cns_drake.base.jobs.step import Reporter, Step
from cns_drake.base.libraries import missing_library

# How long a process may take to close its files once it is asked to end [s].
PATIENCE = 30.0
# Where what a job prints goes, whatever stands for it in this process.
_STDERR = 2
# How often a parent looks whether its job is still wanted [s].
_LOOK_INTERVAL = 0.2

# A job takes and frees the same arrays thousands of times. The C library
# would return their memory each time, as Dask's workers ask for, or where it
# guesses wrong; fetching it anew takes longer than filling it [bytes].
_ALLOCATION = {
    "MALLOC_MMAP_THRESHOLD_": str(1 << 25),  # The largest that glibc takes.
    "MALLOC_TRIM_THRESHOLD_": str(1 << 28),
}


class JobError(Exception):
    """A job cannot be done; the message is one line that says why."""


class ProcessDiedError(Exception):
    """The process of a job was killed, or crashed, or was asked to end."""


class StartedProcess(Protocol):
    """A process that has begun; `subprocess.Popen` is one."""

    def terminate(self) -> None:
        """Asks it to end."""

    def kill(self) -> None:
        """Ends it at once."""

    def wait(self, timeout: float | None = None, /) -> int:
        """Returns its status, that of a signal as a negative number.

        Raises:
            subprocess.TimeoutExpired: it takes longer [s].
        """


# Starts the process of a pickled job; returns it and what leads to it.
Start = Callable[[bytes], tuple[Connection, StartedProcess]]


def start_interpreter(
    function: Callable[[int], None],
) -> tuple[Connection, subprocess.Popen]:
    """Starts an interpreter that runs a function.

    Args:
        function: of a module; takes the number of the file descriptor that
            leads here.

    Returns:
        What leads to it, and the process. It is in a session of its own, so
        that no Ctrl-C reaches it: whoever is interrupted there ends its jobs
        in good order.
    """
    # The search path is the parent's, not what its folder makes of it.
    code = (
        "import sys; number, *sys.path[:] = sys.argv[1:]; "
        f"from {function.__module__} import {function.__name__} as run; "
        "run(int(number))"
    )
    ours, theirs = Pipe()
    with theirs:  # The pipe then ends with the process.
        number = theirs.fileno()
        process = subprocess.Popen(
            [sys.executable, "-c", code, str(number), *sys.path],
            env={**os.environ, **_ALLOCATION},
            pass_fds=[number],
            stdin=subprocess.DEVNULL,
            stdout=_STDERR,
            start_new_session=True,
        )
    return ours, process


def start_anew(job: bytes) -> tuple[Connection, StartedProcess]:
    """Starts a job in an interpreter that imports everything anew."""
    connection, process = start_interpreter(main)
    # Where it has died already, that shows when its end is awaited.
    with contextlib.suppress(ConnectionError):
        connection.send_bytes(job)
    return connection, process


def run_process(
    job: bytes,
    on_message: Callable[..., None],
    is_wanted: Callable[[], bool],
    start: Start = start_anew,
) -> None:
    """Runs a job in a process of its own and waits for its end.

    Args:
        job: a pickled `Step`.
        on_message: takes the job's messages; see `Reporter`.
        is_wanted: asked often; where it says no, the process is ended.
        start: starts the process.

    Raises:
        JobError: the job cannot be done.
        ProcessDiedError: its process ended before it was done.
    """
    ours, process = start(job)
    with ours:
        try:
            kind, text = _listen(ours, on_message, is_wanted)
        finally:
            status = _end(process)
    if kind == "fault":
        raise JobError(text)
    if kind != "done":
        raise ProcessDiedError(text or _describe(status))


def _listen(
    connection: Connection,
    on_message: Callable[..., None],
    is_wanted: Callable[[], bool],
) -> tuple[str, str]:
    """Returns the last message of a job, "" if it just ended."""
    with contextlib.suppress(EOFError, ConnectionError):
        while is_wanted():
            if connection.poll(_LOOK_INTERVAL):
                kind, *values = connection.recv()
                if kind in ("done", "fault", "died"):
                    return kind, *values
                on_message(kind, *values)
    return "", ""


def _end(process: StartedProcess) -> int:
    """Sees that a process ends, and returns its status."""
    process.terminate()
    try:
        return process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def _describe(status: int) -> str:
    if status >= 0:
        return f"its process ended with status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = f"signal {-status}"
    return f"its process was ended by {name}" + (
        ", perhaps for lack of memory" if -status == signal.SIGKILL else ""
    )


def main(number: int) -> None:
    """Runs the job that a parent sends; its whole process.

    Args:
        number: of the file descriptor that leads to the parent.
    """
    connection = Connection(number)
    with contextlib.suppress(EOFError, ConnectionError):
        work(connection, connection.recv_bytes())


def work(connection: Connection, job: bytes) -> None:
    """Runs a job; the rest of its process.

    Args:
        connection: leads to the parent.
        job: a pickled `Step`.
    """
    interrupt_on_termination(once=True)

    def send(*message: object) -> None:
        # Where the parent has gone, nobody takes the message.
        with contextlib.suppress(ConnectionError):
            connection.send(message)

    try:
        threading.Thread(
            target=_end_with_parent, args=(connection,), daemon=True
        ).start()
        last = _run(job, Reporter(send))
    except KeyboardInterrupt:
        end_interrupted()
    ignore_interrupts()
    send(*last)


def _run(job: bytes, reporter: Reporter) -> tuple[str, str]:
    """Runs a job; returns its last message."""
    try:
        with uninterrupted():
            step: Step = pickle.loads(job)
            output = step.output
        with contextlib.ExitStack() as stack:
            if output is not None:
                stack.enter_context(
                    exclusive(
                        output,
                        lambda: reporter.note(
                            f"{output}: waiting for another process that "
                            "works on it"
                        ),
                    )
                )
            if not nothing_left(step):
                step.run(reporter)
    except MemoryError:
        # Another time, or elsewhere, there may be enough.
        return "died", "not enough memory"
    except InputError as error:
        return "fault", str(error)
    except Exception as error:
        lacking = isinstance(error, ImportError) and missing_library(error)
        if lacking:
            return "fault", lacking
        reporter.note(traceback.format_exc())
        return "fault", one_line(f"{type(error).__name__}: {error}")
    return "done", ""


def nothing_left(step: Step) -> bool:
    """Returns whether a step has nothing to do, as far as it can find out."""
    try:
        return step.is_done()
    except InputError:
        return False


def _end_with_parent(connection: Connection) -> None:
    """Ends this process when its parent has ended, even if killed."""
    # Nothing more is sent: what comes is the end.
    with contextlib.suppress(OSError):
        connection.poll(None)
    os.kill(os.getpid(), signal.SIGTERM)
    threading.Event().wait(PATIENCE)
    os.kill(os.getpid(), signal.SIGKILL)
