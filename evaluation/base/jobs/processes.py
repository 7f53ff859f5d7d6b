"""The process in which a job runs, and the `Executor` of such processes.

Each job runs in a process of its own, with its own interpreter. When the
process ends, its memory is freed (Python systems in a Drake diagram are not
freed otherwise), and a crash does not affect other jobs. Imports take seconds.
On Linux, job processes are therefore forked from the fork server of
`multiprocessing`, which has already imported the parent's modules. On other
systems the libraries do not support forks.

`ProcessPoolExecutor` does not do this. Measured with Python 3.11: one killed
worker breaks the futures of all running and waiting jobs, workers survive a
parent that was killed, and without `/dev/shm` nothing starts. It has no method
that ends running jobs before Python 3.14, and before Python 3.11 it cannot
give each job a new process.
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
import contextlib
from contextlib import nullcontext
import gc
import importlib
import multiprocessing
from multiprocessing import util
from multiprocessing.connection import Connection, Pipe, wait
from multiprocessing.process import BaseProcess
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from types import ModuleType
from typing import Any

from evaluation.base import errors, interrupts, system_libraries
from evaluation.base.errors import InputError
from evaluation.base.file_locks import exclusive, remove_lock
from evaluation.base.jobs.step import Reporter, Step
from evaluation.base.plugins import plugin_fault
from evaluation.base.process import ONE_CORE, collect_garbage_seldom
from evaluation.base.progress import heard_by
from evaluation.base.working_folder import (
    ignore_local_settings,
    leave_out_folder,
)

# How long a process may take to close its files after SIGTERM [s]. A process
# that does not react, because it is inside a library, is then killed, so that
# an interrupted command ends within five seconds.
PATIENCE = 3.0
# File descriptors. Whatever a job prints goes to stderr.
_STDOUT = 1
_STDERR = 2
# How often a parent checks whether its job was cancelled [s].
_LOOK_INTERVAL = 0.2
# How long a killed process may take to disappear [s].
_DEATH_TIME = 1.0
# Environment variable with the names of the modules to import beforehand.
_MODULES_VARIABLE = "CNS_DRAKE_JOB_MODULES"

# Settings of the C library's memory allocation [bytes]. A job allocates and
# frees the same arrays thousands of times. By Dask's settings, and sometimes by
# the library's own, the memory of these arrays would go back to the system each
# time; fetching the memory again takes longer than filling it.
ALLOCATION = {
    "MALLOC_MMAP_THRESHOLD_": str(1 << 25),  # The largest that glibc takes.
    "MALLOC_TRIM_THRESHOLD_": str(1 << 28),
}

if sys.platform == "linux":
    _context = multiprocessing.get_context("forkserver")
else:
    _context = multiprocessing.get_context("spawn")
# One thread at a time changes the environment, or reads statuses.
_starting = threading.Lock()


class JobError(Exception):
    """A job cannot be done; the message gives the reason in one line."""


class ProcessDiedError(Exception):
    """The process of a job was killed, crashed or was terminated."""


class ProcessExecutor(ThreadPoolExecutor):
    """Runs steps in processes of this machine, which end with this process.

    Submit the method `run`. A thread waits for the end of each process. No port
    is opened, since anyone who reached it could run programs here.
    """

    def __init__(self, num_workers: int, hear: Callable[..., None]):
        """Makes an executor.

        Args:
            num_workers: number of jobs that run at a time.
            hear: called with the kind of each message of a job, the job's name,
                and values, from any thread.
        """
        super().__init__(num_workers)
        self._hear = hear
        self._ended = threading.Event()

    def run(self, name: str, step: bytes) -> None:
        """Runs a job; see `run_process`."""
        self._hear("started", name)
        run_process(
            step,
            lambda kind, *values: self._hear(kind, name, *values),
            lambda: not self._ended.is_set(),
        )

    def shutdown(
        self, wait: bool = True, *, cancel_futures: bool = False
    ) -> None:
        """Ends the executor, and all jobs unless they are waited for.

        If they are not waited for, each future has its result as soon as the
        process of the job has ended.
        """
        if not wait:
            self._ended.set()
        super().shutdown(wait, cancel_futures=cancel_futures or not wait)


def run_process(
    job: bytes,
    on_message: Callable[..., None],
    is_wanted: Callable[[], bool],
) -> None:
    """Runs a job in a process of its own and waits for its end.

    Args:
        job: a pickled `evaluation.base.jobs.step.Step`.
        on_message: called with each message of the job, as the `send` of a
            `evaluation.base.jobs.step.Reporter`.
        is_wanted: called repeatedly; when this function returns False, the
            process is ended.

    Raises:
        JobError: the job cannot be done.
        ProcessDiedError: the process ended before the job was done.
    """
    ours, theirs = Pipe()
    with ours:
        with theirs:  # The pipe then ends with the process.
            process = _start_process(theirs, job)
        try:
            kind, text = _last_message(ours, on_message, is_wanted)
        finally:
            status = _end_process(process)
            if status == -signal.SIGKILL:  # The killed process left its lock.
                with interrupts.uninterrupted():
                    output = pickle.loads(job).output
                if output is not None:
                    remove_lock(output)
    if kind == "fault":
        raise JobError(text)
    if kind != "done":
        raise ProcessDiedError(text or _describe_status(status))


def _start_process(connection: Connection, job: bytes) -> BaseProcess:
    process = _context.Process(target=_process_main, args=(connection, job))
    # Ctrl-C would end the process with a traceback, until it has a session of
    # its own: processes inherit the blocked signals of the thread.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with _starting, _environment_of_jobs():
            process.start()
    except (EOFError, OSError) as error:
        # A new fork server starts only after the dead one has disappeared.
        time.sleep(_DEATH_TIME)
        raise ProcessDiedError("the process that starts jobs died") from error
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return process


@contextlib.contextmanager
def _environment_of_jobs() -> Iterator[None]:
    """Sets environment variables and `__main__` for a new interpreter."""
    modules = [
        name
        for name in list(sys.modules)
        if name.startswith(("cns_drake.", "evaluation.", "worlds."))
    ]
    changed = {
        # As many jobs run as there are cores.
        **{k: os.environ.get(k, v) for k, v in ONE_CORE.items()},
        **ALLOCATION,
        _MODULES_VARIABLE: " ".join(modules),
        # Modules in the working folder do not count.
        "PYTHONSAFEPATH": "1",
    }
    before = {name: os.environ.get(name) for name in changed}
    os.environ.update(changed)
    multiprocessing.set_forkserver_preload([__name__])
    # The process of a job would run this process's script again.
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    options: Any = util  # Its hints lack what is not public.
    flags = options._args_from_interpreter_flags
    if sys.version_info < (3, 11):  # It does not know PYTHONSAFEPATH.
        options._args_from_interpreter_flags = lambda: [*flags(), "-I"]
    try:
        yield
    finally:
        options._args_from_interpreter_flags = flags
        sys.modules["__main__"] = main
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _last_message(
    connection: Connection,
    on_message: Callable[..., None],
    is_wanted: Callable[[], bool],
) -> tuple[str, str]:
    """Returns kind and text of a job's last message; "" and "" if none came."""
    with contextlib.suppress(EOFError, ConnectionError):
        while is_wanted():
            if connection.poll(_LOOK_INTERVAL):
                kind, *values = connection.recv()
                if kind in ("done", "fault", "died"):
                    return kind, *values
                on_message(kind, *values)
    return "", ""


def _end_process(process: BaseProcess) -> int:
    """Ends a process and returns its status.

    A status can be read only once. The start of a process reads the statuses of
    all others, too, and could take one from a thread that waits for it.
    Threads therefore ask for statuses, and start processes, in turns.
    """
    process.terminate()
    deadline = time.monotonic() + PATIENCE
    while True:
        wait([process.sentinel], _LOOK_INTERVAL)
        with _starting:
            status = process.exitcode
        if status is not None:
            return status
        if time.monotonic() > deadline:
            process.kill()


def _describe_status(status: int) -> str:
    if status >= 0:
        return f"its process ended with status {status}"
    name = f"signal {-status}"
    with contextlib.suppress(ValueError):
        name = signal.Signals(-status).name
    why = ", perhaps for lack of memory" if name == "SIGKILL" else ""
    return f"its process was ended by {name}{why}"


def _process_main(connection: Connection, job: bytes) -> None:
    """Runs a job: the main function of its process."""
    interrupts.interrupt_on_termination(once=True)
    # In its own session, which Ctrl-C does not reach: the interrupted parent
    # ends its jobs in good order.
    os.setsid()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    os.dup2(_STDERR, _STDOUT)

    def send(*message: object) -> None:
        # If the parent has gone, no process reads the message.
        with contextlib.suppress(ConnectionError):
            connection.send(message)

    try:
        threading.Thread(target=_end_with_parent, daemon=True).start()
        last = _run_job(job, Reporter(send))
    except KeyboardInterrupt:
        interrupts.end_interrupted()
    interrupts.ignore_interrupts()
    send(*last)


def _run_job(job: bytes, reporter: Reporter) -> tuple[str, str]:
    """Runs a job; returns its last message."""
    try:
        with interrupts.uninterrupted():
            step: Step = pickle.loads(job)
            place = step.output

        def note_waiting() -> None:
            reporter.note(f"{step.words}: another process works on it; waiting")

        alone = exclusive(place, note_waiting) if place else nullcontext()
        with alone:
            if not nothing_left(step):
                with heard_by(reporter):
                    step.run(reporter)
    except MemoryError:
        # At another time, or on another machine, there may be enough memory.
        return "died", "not enough memory"
    except InputError as error:
        if errors.shows_traceback():
            reporter.note(traceback.format_exc())
        return "fault", str(error)
    except SystemExit as error:
        if fault := plugin_fault(error):
            return "fault", fault
        raise
    except Exception as error:
        if isinstance(error, ImportError):
            lacking = system_libraries.missing_library(error)
            if lacking:
                return "fault", lacking
        if fault := plugin_fault(error):
            return "fault", fault
        reporter.note(traceback.format_exc())
        return "fault", errors.one_line(f"{type(error).__name__}: {error}")
    return "done", ""


def nothing_left(step: Step) -> bool:
    """Returns whether a step is done; False if this cannot be found out."""
    try:
        return step.is_done()
    except InputError:
        return False


def _end_with_parent() -> None:
    """Makes this process end with its parent, even if the parent is killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)
    threading.Event().wait(PATIENCE)
    os.kill(os.getpid(), signal.SIGKILL)


def _preload_modules(modules: Iterable[str]) -> None:
    """Imports modules in the process from which job processes are forked."""
    leave_out_folder(sys.path)
    ignore_local_settings()
    collect_garbage_seldom()
    os.setsid()
    parent = os.getppid()
    for name in modules:
        if os.getppid() != parent:  # Nobody waits for these imports any more.
            os._exit(0)
        # The process of a job reports what fails.
        with contextlib.suppress(Exception):
            importlib.import_module(name)
    if compiling := sys.modules.get("evaluation.base.compilation"):
        compiling.start_compiler()
    # Garbage collection would write to memory that the processes share.
    gc.freeze()


if names := os.environ.pop(_MODULES_VARIABLE, None):
    _preload_modules(names.split())
