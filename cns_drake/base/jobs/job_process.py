"""The process in which one job runs, and its messages to its parent.

Each job has a process with its own interpreter. Its memory is freed with the
process (Python systems in a Drake diagram are not freed otherwise), and a crash
does not reach the other jobs.
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

from cns_drake.base.errors import InputError, missing_library, one_line
from cns_drake.base.files import exclusive
from cns_drake.base.interrupts import (
    end_interrupted,
    ignore_interrupts,
    interrupt_on_termination,
    uninterrupted,
)
from cns_drake.base.jobs.step import Reporter, Step
from cns_drake.base.process import look_seldom

# How long a process may take to close its files after SIGTERM [s].
PATIENCE = 30.0
# The file descriptor to which a job prints, whatever replaces it in here.
_STDERR = 2
# How often a parent checks whether its job was cancelled [s].
_LOOK_INTERVAL = 0.2

# A job takes and frees the same arrays thousands of times. The C library would
# return their memory each time: Dask's workers set it so, and its own guess may
# be wrong. Fetching memory anew takes longer than filling it [bytes].
ALLOCATION = {
    "MALLOC_MMAP_THRESHOLD_": str(1 << 25),  # The largest that glibc takes.
    "MALLOC_TRIM_THRESHOLD_": str(1 << 28),
}

# As many jobs run as there are cores. More threads of linear algebra would wait
# for each other, which takes processor time.
_ONE_CORE = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"), "1"
)


class JobError(Exception):
    """A job cannot be done; the message gives the reason in one line."""


class ProcessDiedError(Exception):
    """The process of a job was killed, crashed or was terminated."""


class StartedProcess(Protocol):
    """A process that has begun; `subprocess.Popen` is one."""

    def terminate(self) -> None:
        """Terminates the process; it may close its files."""

    def kill(self) -> None:
        """Kills the process."""

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
        function: a module's function; its argument is the number of the file
            descriptor that is connected to this process.

    Returns:
        The connection to it, and the process. The process has its own session,
        which Ctrl-C does not reach: the interrupted parent ends its jobs in
        good order.
    """
    # The search path is the parent's, not that of the current folder.
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
            env={**_ONE_CORE, **os.environ, **ALLOCATION},
            pass_fds=[number],
            stdin=subprocess.DEVNULL,
            stdout=_STDERR,
            start_new_session=True,
        )
    return ours, process


def start_anew(job: bytes) -> tuple[Connection, StartedProcess]:
    """Starts a job in an interpreter that imports everything anew."""
    connection, process = start_interpreter(main)
    # If the process has died already, waiting for its end shows it.
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
        is_wanted: called often; the process is ended when it returns False.
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
    """Ends a process and returns its status."""
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
    look_seldom()
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
        # If the parent has gone, no process reads the message.
        with contextlib.suppress(ConnectionError):
            connection.send(message)

    try:
        threading.Thread(
            target=end_with_parent, args=(connection,), daemon=True
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
                            f"{output}: another process works on it; waiting"
                        ),
                    )
                )
            if not nothing_left(step):
                step.run(reporter)
    except MemoryError:
        # At another time, or on another machine, there may be enough memory.
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
    """Returns whether a step has nothing to do; False if that is unclear."""
    try:
        return step.is_done()
    except InputError:
        return False


def end_with_parent(connection: Connection) -> None:
    """Ends this process when its parent has ended, even if killed."""
    # The parent sends nothing more: the next read returns at its end.
    with contextlib.suppress(OSError):
        connection.poll(None)
    os.kill(os.getpid(), signal.SIGTERM)
    threading.Event().wait(PATIENCE)
    os.kill(os.getpid(), signal.SIGKILL)
