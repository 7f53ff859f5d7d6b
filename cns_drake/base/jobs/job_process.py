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

# The search path is the parent's, not what the folder it runs in makes of it.
_START = (
    "import sys; number, *sys.path[:] = sys.argv[1:]; "
    f"from {__name__} import main; main(int(number))"
)


class JobError(Exception):
    """A job cannot be done; the message is one line that says why."""


class ProcessDiedError(Exception):
    """The process of a job was killed, or crashed, or was asked to end."""


def run_process(
    job: bytes,
    on_message: Callable[..., None],
    is_wanted: Callable[[], bool],
) -> None:
    """Runs a job in a process of its own and waits for its end.

    Args:
        job: a pickled `Step`.
        on_message: takes the job's messages; see `Reporter`.
        is_wanted: asked often; where it says no, the process is ended.

    Raises:
        JobError: the job cannot be done.
        ProcessDiedError: its process ended before it was done.
    """
    ours, theirs = Pipe()
    # In a session of its own no Ctrl-C reaches it: whoever is interrupted
    # there ends its jobs in good order.
    command = [sys.executable, "-c", _START, str(theirs.fileno()), *sys.path]
    process = subprocess.Popen(
        command,
        env={**os.environ, **_ALLOCATION},
        pass_fds=[theirs.fileno()],
        stdin=subprocess.DEVNULL,
        stdout=_STDERR,
        start_new_session=True,
    )
    theirs.close()  # The pipe then ends with the process.
    with ours:
        try:
            kind, text = _listen(ours, job, on_message, is_wanted)
        finally:
            status = _end(process)
    if kind == "fault":
        raise JobError(text)
    if kind != "done":
        raise ProcessDiedError(text or _describe(status))


def _listen(
    connection: Connection,
    job: bytes,
    on_message: Callable[..., None],
    is_wanted: Callable[[], bool],
) -> tuple[str, str]:
    """Returns the last message of a job, "" if it just ended."""
    with contextlib.suppress(EOFError, ConnectionError):
        connection.send_bytes(job)
        while is_wanted():
            if connection.poll(_LOOK_INTERVAL):
                kind, *values = connection.recv()
                if kind in ("done", "fault", "died"):
                    return kind, *values
                on_message(kind, *values)
    return "", ""


def _end(process: subprocess.Popen) -> int:
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
    interrupt_on_termination(once=True)

    def send(*message: object) -> None:
        # Where the parent has gone, nobody takes the message.
        with contextlib.suppress(ConnectionError):
            connection.send(message)

    try:
        job = connection.recv_bytes()
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
