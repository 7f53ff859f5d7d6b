"""Running many jobs in parallel, on one machine or on a cluster.

Both are an `Executor` of `concurrent.futures`: `ProcessExecutor` here, and
that of a Dask client on a cluster. A worker of Dask runs each job in a process
of its own, too.
"""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
import contextlib
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
import logging
import multiprocessing
import os
from pathlib import Path
import pickle
import shutil
import traceback
from typing import Any, TypeAlias
import uuid

from evaluation.base.errors import FailedJobsError, InputError, one_line
from evaluation.base.interrupts import uninterrupted
from evaluation.base.jobs.processes import (
    PATIENCE,
    JobError,
    ProcessDiedError,
    ProcessExecutor,
    nothing_left,
    run_process,
)
from evaluation.base.jobs.step import Step
from evaluation.base.process import num_cores
from evaluation.base.progress import JobsListener, listener
from evaluation.base.repetitions import repeated
from evaluation.base.terminal import note, resumable

# Environment variable with the address of a scheduler; the name is Dask's.
_ADDRESS_VARIABLE = "DASK_SCHEDULER_ADDRESS"
# How long a scheduler may take to answer [s].
_ANSWER_TIMEOUT = 10.0
# How often a job is started again after its process has died.
_RETRIES = 2
# So many jobs are not worth a message before they start.
_FEW = 4
# Most memory of a job [bytes].
_JOB_MEMORY = 1.2e9

# A function that takes the kind of a message about a job, the job's name, and
# values. The kinds are "started" and those of a `Reporter`. It may be called
# from any thread.
_Hear: TypeAlias = Callable[..., None]
# An executor, and the function to submit, with the name of a job and its
# pickled step.
_Connected: TypeAlias = tuple[Executor, Callable[[str, bytes], None]]


@dataclass(frozen=True)
class Job:
    """A step to be run in a process of its own.

    Attributes:
        name: unique name, in words.
        step: the work. `step.is_done` is called before a process is started, to
            save the process, and again in the process, because another copy of
            the job may have finished first.
    """

    name: str
    step: Step


@dataclass(frozen=True)
class Cluster:
    """Where jobs run: on this machine, or on the workers of a Dask scheduler.

    Attributes:
        num_workers: how many jobs run on this machine at a time.
        scheduler: address of a Dask scheduler, such as `tcp://10.0.0.1:8786`,
            whose workers run the jobs; None to run the jobs on this machine.
            The workers must have this package installed and share the file
            system.
    """

    num_workers: int = 1
    scheduler: str | None = None

    @property
    def slots(self) -> int | None:
        """Number of jobs that run at once; None for the workers of a scheduler.

        A scheduler gets all jobs at once: other users may be using the
        scheduler's workers, and the scheduler may start more workers for the
        jobs.
        """
        return self.num_workers if self.scheduler is None else None

    def connect(self, hear: _Hear) -> AbstractContextManager[_Connected]:
        """Returns a context manager whose value is the executor of the jobs.

        Raises:
            InputError: if the scheduler does not answer.
        """
        if self.scheduler is not None:
            return _dask_workers(self.scheduler, hear)
        executor = ProcessExecutor(self.num_workers, hear)
        return nullcontext((executor, executor.run))


def choose_cluster(num_jobs: int | None, scheduler: str | None) -> Cluster:
    """Returns where jobs run according to --jobs and --scheduler.

    Args:
        num_jobs: `--jobs`: number of jobs that run at a time on this machine.
        scheduler: `--scheduler`: address of a Dask scheduler. If neither option
            is given, the environment variable DASK_SCHEDULER_ADDRESS contains
            the address. If this variable is not set, the jobs run on this
            machine, one for each core.

    Raises:
        InputError: both options are given, or the number is not positive.
    """
    if num_jobs is not None:
        if scheduler is not None:
            raise InputError(
                "--jobs and --scheduler exclude each other; give one of them"
            )
        if num_jobs < 1:
            raise InputError(f"--jobs: {num_jobs} is not a positive number")
        return Cluster(num_workers=num_jobs)
    return Cluster(
        num_workers=num_cores(),
        scheduler=scheduler or os.environ.get(_ADDRESS_VARIABLE) or None,
    )


@dataclass(frozen=True)
class Space:
    """Space on a disk that jobs need.

    Attributes:
        folder: folder of the results, which exists.
        most: space that the jobs need [bytes].
    """

    folder: Path
    most: float

    def __str__(self) -> str:
        text = f"{_gigabytes_text(self.most)} on the disk"
        free = shutil.disk_usage(self.folder).free
        if free < self.most:
            text += f", which has {_gigabytes_text(free)}"
        return text


def forecast(
    jobs: Sequence[Job], cluster: Cluster, space: Space | None = None
) -> str | None:
    """Returns how many jobs are left, and what space they need.

    How long they take depends on the machine and its load, so the time left is
    shown only when some of them are done.

    Args:
        jobs: the jobs, of which some may be done.
        cluster: runs the jobs.
        space: space on the disk that the jobs need, if it is known.

    Returns:
        One line of text; None if only a few jobs are left, or if nothing is
        known about them.
    """
    left = [job for job in jobs if not nothing_left(job.step)]
    if len(left) <= _FEW:
        return None
    parts = []
    if cluster.slots is not None:
        number = min(cluster.slots, len(left))
        memory = _gigabytes_text(number * _JOB_MEMORY)
        parts.append(f"{memory} of memory with {number} at a time")
    if space is not None:
        parts.append(str(space))
    return f"{len(left)} jobs: {'; '.join(parts)}" if parts else None


def _gigabytes_text(number: float) -> str:
    return f"{number / 1e9:.1f} GB"


def run_jobs(
    jobs: Iterable[Job],
    cluster: Cluster,
    unit: str = "jobs",
    *,
    resumes: bool = True,
) -> None:
    """Runs jobs on a cluster, in their order.

    Notes of the jobs are printed on stderr. A job whose process or worker dies
    is repeated, and a note says so. A job that fails does not stop the others.

    Args:
        jobs: the jobs.
        cluster: runs them.
        unit: what the jobs are, such as `cities`.
        resumes: whether another run can use the files of finished jobs; if the
            work is interrupted, a note says so.

    Raises:
        FailedJobsError: if jobs could not be done; the error names all of these
            jobs.
        InputError: if the scheduler does not answer.
    """
    jobs = list(jobs)
    if repeats := repeated(job.name for job in jobs):
        raise ValueError(f"{repeats[0]}: several jobs have this name")
    left = [job for job in jobs if not nothing_left(job.step)]
    if not left:
        return
    with (
        resumable() if resumes else nullcontext(),
        listener().jobs(len(jobs), len(jobs) - len(left), unit) as shown,
    ):
        run = _Run(left, shown)
        with cluster.connect(run.hear) as (executor, function):
            run.run(executor, function, cluster.slots)
    run.raise_faults()


class _Run:
    """One run of jobs on an executor."""

    def __init__(self, jobs: Sequence[Job], shown: JobsListener):
        """Takes the jobs that are left."""
        self._waiting = deque(jobs)
        self._shown = shown
        # Names of the jobs whose present copy has started.
        self._started: set[str] = set()
        self._running: dict[Future, Job] = {}
        self._deaths: Counter = Counter()
        self._faults: dict[str, str] = {}

    def hear(self, kind: str, name: str, *values: Any) -> None:
        """Receives a message of a job."""
        if kind == "started":
            if name in self._started:  # Dask repeats it by itself.
                _note_repeated(name, "its worker died")
            self._started.add(name)
            self._shown.start(name)
        elif kind == "doing":
            self._shown.doing(name, *values)
        else:
            note(*values)

    def run(
        self,
        executor: Executor,
        function: Callable[[str, bytes], None],
        slots: int | None,
    ) -> None:
        """Runs jobs until none is left."""
        running = self._running

        def submit(job: Job) -> None:
            future = executor.submit(function, job.name, pickle.dumps(job.step))
            running[future] = job

        try:
            while True:
                while self._waiting and (slots is None or len(running) < slots):
                    submit(self._waiting.popleft())
                if not running:
                    return
                for future in wait(running, None, FIRST_COMPLETED).done:
                    job = running.pop(future)
                    if self._must_repeat(job.name, future):
                        submit(job)
        finally:
            # Jobs that run when this is interrupted close their files.
            executor.shutdown(wait=not running)
            wait(running, PATIENCE + 0.5)

    def raise_faults(self) -> None:
        """Raises FailedJobsError if a job failed."""
        if not self._faults:
            return
        parts = [f"{name}: {fault}" for name, fault in self._faults.items()]
        raise FailedJobsError("; ".join(parts))

    def _must_repeat(self, name: str, future: Future) -> bool:
        """Takes the result of a job, and returns whether it must run again."""
        self._started.discard(name)
        try:
            future.result()
        except CancelledError:
            raise InputError(
                "the connection to the scheduler was lost; run the same command"
                " again to go on"
            ) from None
        except (InputError, JobError) as error:
            fault = str(error)
        except ProcessDiedError as error:
            fault = str(error)
            if self._deaths[name] < _RETRIES:
                self._deaths[name] += 1
                _note_repeated(name, fault)
                return True
        except Exception as error:
            if type(error).__name__ == "KilledWorker":  # Dask's.
                fault = "every worker that ran it died"
            else:  # A fault of this program.
                note(traceback.format_exc())
                fault = one_line(f"{type(error).__name__}: {error}")
        else:
            self._shown.end(name)
            return False
        self._faults[name] = fault
        self._shown.end(name, fault=True)
        if self._running:
            note(f"{name}: failed: {fault}")
        return False


def _note_repeated(name: str, why: str) -> None:
    note(f"job {name}: {why}; it is repeated")


@contextlib.contextmanager
def _dask_workers(address: str, hear: _Hear) -> Iterator[_Connected]:
    """Yields the executor of the Dask scheduler at an address.

    Raises:
        InputError: if Dask is not installed, or the scheduler does not answer.
    """
    # Slow to import, and not needed to print help.
    try:
        from distributed import Client
    except ModuleNotFoundError as error:
        raise InputError(
            f"--scheduler: {address}: Dask is not installed; run pip install"
            " 'cns-eval[dask]'"
        ) from error

    # What happens to jobs is reported here, in our own words.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    _check_answer(address)
    topic = uuid.uuid4().hex
    with contextlib.ExitStack() as stack:
        with uninterrupted():  # Half a client cannot be closed.
            client = stack.enter_context(
                Client(address, timeout=_ANSWER_TIMEOUT, set_as_default=False)
            )
        client.subscribe_topic(topic, lambda event: hear(*event[1]))
        if not client.nthreads():
            note(f"{address}: no workers yet, waiting")

        yield client.get_executor(pure=False), _OnWorker(topic)


@dataclass(frozen=True)
class _OnWorker:
    """Runs a job on a worker of Dask, which reports to a topic of events."""

    topic: str

    def __call__(self, name: str, step: bytes) -> None:
        from distributed import Status, get_worker

        worker = get_worker()
        key = worker.get_current_task()

        def report(kind: str, *values: object) -> None:
            worker.log_event(self.topic, (kind, name, *values))

        def is_wanted() -> bool:
            # Only here is it noticed that the client has gone or has cancelled
            # the job.
            task = worker.state.tasks.get(key)
            return (
                worker.status in (Status.running, Status.paused)
                and task is not None
                and task.state != "cancelled"
            )

        # A worker of Dask is a daemon, which may not start processes. The
        # processes of jobs end with the worker nevertheless.
        multiprocessing.current_process().daemon = False
        report("started")
        run_process(step, report, is_wanted)


def _check_answer(address: str) -> None:
    """Raises InputError unless a scheduler answers in time.

    A client would wait for ever for a scheduler that accepts the connection and
    never answers.
    """
    from distributed import Security
    from distributed.core import rpc

    async def ask() -> None:
        keys = Security().get_connection_args("client")
        async with rpc(address, connection_args=keys) as scheduler:
            await scheduler.identity()

    is_usual = os.environ.get(_ADDRESS_VARIABLE) == address
    given = _ADDRESS_VARIABLE if is_usual else "--scheduler"
    fault = f"{given}: {address}: no answer"
    try:
        # This thread may have an event loop of its own.
        asked = asyncio.wait_for(ask(), _ANSWER_TIMEOUT)
        ThreadPoolExecutor(1).submit(asyncio.run, asked).result()
    except asyncio.TimeoutError:
        raise InputError(
            f"{fault} in {_ANSWER_TIMEOUT:g} s; is the scheduler running?"
        ) from None
    # Dask raises any of these for an address that it cannot use, such as TLS
    # without a certificate.
    except (ImportError, OSError, TypeError, ValueError) as error:
        raise InputError(f"{fault} ({error})") from error
