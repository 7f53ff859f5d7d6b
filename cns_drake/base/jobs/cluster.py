"""Where jobs run: on processes of this machine, or on a cluster."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
import contextlib
from contextlib import AbstractContextManager
from dataclasses import dataclass
import logging
import multiprocessing
import os
import threading
import traceback
from typing import TYPE_CHECKING
import uuid

from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.jobs.processes import (
    JobError,
    ProcessDiedError,
    run_process,
)
from cns_drake.base.process import num_cores

if TYPE_CHECKING:
    from distributed import Client, Future


# Environment variable with the address of a scheduler; the name is Dask's.
_ADDRESS_VARIABLE = "DASK_SCHEDULER_ADDRESS"

# A function that takes a message about a job: the kind of message, the job's
# name, and values. Besides the job's own reports, the kinds are "started",
# "ended" and, at last, "result" with the exception that ended the job, or None.
# It may be called from any thread.
Listener = Callable[..., None]
# How long a scheduler may take to answer [s].
_ANSWER_TIMEOUT = 10.0
# Greatest number of jobs side by side; each is a process.
_MOST_JOBS = 1024
# First part of the keys of all jobs in Dask.
_KIND = "job"


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

    def connect(self, listener: Listener) -> AbstractContextManager[Workers]:
        """Returns a context manager whose value is the workers of the cluster.

        Raises:
            InputError: if the scheduler does not answer.
        """
        if self.scheduler is None:
            return LocalWorkers(listener, self.num_workers)
        return dask_workers(self.scheduler, listener)


def choose_cluster(num_jobs: int | None, scheduler: str | None) -> Cluster:
    """Returns where jobs run according to --jobs and --scheduler.

    Args:
        num_jobs: `--jobs`: number of jobs that run at a time on this machine.
        scheduler: `--scheduler`: address of a Dask scheduler. If neither option
            is given, the environment variable DASK_SCHEDULER_ADDRESS contains
            the address. If this variable is not set, the jobs run on this
            machine, one for each core.

    Raises:
        InputError: if both options are given, or the number is not from 1 to
            1024.
    """
    if num_jobs is not None:
        if scheduler is not None:
            raise InputError(
                "--jobs and --scheduler exclude each other; give one of them"
            )
        if num_jobs < 1:
            raise InputError(f"--jobs: {num_jobs} is not a positive number")
        if num_jobs > _MOST_JOBS:
            raise InputError(f"--jobs: {num_jobs} is more than {_MOST_JOBS}")
        return Cluster(num_workers=num_jobs)
    return Cluster(
        num_workers=num_cores(),
        scheduler=scheduler or os.environ.get(_ADDRESS_VARIABLE) or None,
    )


class LocalWorkers:
    """Runs jobs in child processes, which end when this process ends.

    No port is opened, since anyone who reached it could run programs here.
    """

    def __init__(self, listener: Listener, num_workers: int):
        self._listener = listener
        self._threads = ThreadPoolExecutor(num_workers)
        self._stopped = threading.Event()

    def __enter__(self) -> LocalWorkers:
        return self

    def __exit__(self, kind: type | None, *error: object) -> None:
        self.stop()
        # After an interrupt, a thread that still waits for the imports of a
        # process is not waited for; what it starts ends with this process.
        interrupted = kind is KeyboardInterrupt
        self._threads.shutdown(wait=not interrupted, cancel_futures=True)

    def submit(self, name: str, job: bytes, priority: float) -> None:
        """Queues a job; jobs start in the order in which they are submitted.

        `priority` is not used, because at most `num_workers` jobs are submitted
        at a time. A thread waits for the end of each job.
        """
        self._threads.submit(self._run, name, job)

    def stop(self) -> None:
        """Ends all jobs.

        When the listener receives the message "ended" of a job, the files of
        that job are closed.
        """
        self._stopped.set()

    def _run(self, name: str, job: bytes) -> None:
        error: Exception | None = None
        self._listener("started", name)
        try:
            run_process(
                job,
                lambda kind, *values: self._listener(kind, name, *values),
                lambda: not self._stopped.is_set(),
            )
        except (JobError, ProcessDiedError) as caught:
            error = caught
        except Exception as caught:  # A fault of this program.
            self._listener("note", name, traceback.format_exc())
            error = caught
        self._listener("ended", name)
        self._listener("result", name, error)


class DaskWorkers:
    """Runs jobs on the workers of a Dask scheduler.

    The methods are the same as in `LocalWorkers`.
    """

    def __init__(self, client: Client, listener: Listener):
        self._client = client
        self._listener = listener
        self._id = uuid.uuid4().hex
        self._futures: dict[str, Future] = {}
        self._count = 0
        client.subscribe_topic(self._id, lambda event: listener(*event[1]))
        if not client.nthreads():
            listener("note", "", f"{self._address}: no workers yet, waiting")

    def submit(self, name: str, job: bytes, priority: float) -> None:
        self._count += 1
        future = self._client.submit(
            run_on_worker,
            name,
            job,
            self._id,
            # Dask learns the durations of tasks by the part of the key before
            # the first "-", and only then moves tasks from a busy worker to an
            # idle one. Each key is new: an old key would return the old result.
            key=f"{_KIND}-{name} {self._count}-{self._id}",
            priority=priority,
            pure=False,
        )
        self._futures[name] = future
        future.add_done_callback(lambda future: self._report_end(name, future))

    def stop(self) -> None:
        futures = list(self._futures.values())
        self._futures.clear()
        self._client.cancel(futures, force=True)

    @property
    def _address(self) -> str:
        return self._client.scheduler.address

    def _report_end(self, name: str, future: Future) -> None:
        if self._futures.pop(name, None) is None:
            return
        error: Exception | None = None
        if future.status == "lost":
            # The job is done, but its worker was lost before its result came
            # here. A second run finds the job done.
            error = ProcessDiedError("its worker died")
        elif future.status == "error":
            from distributed.scheduler import KilledWorker

            error = future.exception()
            if isinstance(error, KilledWorker):
                error = InputError("every worker that ran it died")
        elif future.status != "finished":
            error = LostSchedulerError(
                f"{self._address}: the connection to the scheduler was lost; "
                "run the same command again to go on"
            )
        self._listener("result", name, error)


Workers = LocalWorkers | DaskWorkers


class LostSchedulerError(InputError):
    """The connection to the Dask scheduler was lost, and all jobs ended."""


@contextlib.contextmanager
def dask_workers(address: str, listener: Listener) -> Iterator[DaskWorkers]:
    """Yields the `DaskWorkers` of the scheduler at an address.

    Raises:
        InputError: if the scheduler does not answer.
    """
    # Slow to import, and not needed to print help.
    from distributed import Client

    # The caller reports what happens to jobs, in its own words.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    _check_answer(address)
    with contextlib.ExitStack() as stack:
        with uninterrupted():  # Half a client cannot be closed.
            client = stack.enter_context(
                Client(address, timeout=_ANSWER_TIMEOUT, set_as_default=False)
            )
        yield DaskWorkers(client, listener)


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

    fault = f"--scheduler: {address}: no answer; is the scheduler running?"
    try:
        asyncio.run(asyncio.wait_for(ask(), _ANSWER_TIMEOUT))
    except asyncio.TimeoutError:
        raise InputError(f"{fault} in {_ANSWER_TIMEOUT:g} s") from None
    # Dask raises any of these for an address that it cannot use, such as TLS
    # without a certificate.
    except (ImportError, OSError, TypeError, ValueError) as error:
        raise InputError(f"{fault} ({error})") from error


def run_on_worker(name: str, job: bytes, topic: str) -> None:
    """Runs a job on a worker of Dask.

    Raises:
        JobError: see `run_process`.
        ProcessDiedError: see `run_process`.
    """
    from distributed import Status, get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def report(kind: str, *values: object) -> None:
        worker.log_event(topic, (kind, name, *values))

    def is_wanted() -> bool:
        # Only here is it noticed that the client has gone or has cancelled the
        # job.
        task = worker.state.tasks.get(key)
        return (
            worker.status in (Status.running, Status.paused)
            and task is not None
            and task.state != "cancelled"
        )

    # A worker of Dask is a daemon, which may not start processes. The processes
    # of jobs end with the worker nevertheless.
    multiprocessing.current_process().daemon = False
    report("started")
    try:
        run_process(job, report, is_wanted)
    finally:
        report("ended")
