"""Where jobs run: on processes of this machine, or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
import contextlib
from contextlib import AbstractContextManager
from dataclasses import dataclass
import os
import threading
from typing import Protocol

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.processes import run_process
from cns_drake.base.process import num_cores

# Environment variable with the address of a scheduler; the name is Dask's.
_ADDRESS_VARIABLE = "DASK_SCHEDULER_ADDRESS"

# Takes a message of a job: the kind, the job's name, and values. Besides what
# the job reports itself these are "started", "ended", and at last "result" with
# the exception that it ended by, or None. It is called from any thread.
Listener = Callable[..., None]


class Workers(Protocol):
    """Runs jobs side by side, and reports them to a `Listener`."""

    def submit(self, name: str, job: bytes, priority: float) -> None:
        """Lets a job run, when there is room.

        Args:
            name: the job's name.
            job: see `run_process`.
            priority: among jobs that wait, the one with the highest comes
                first.
        """

    def stop(self) -> None:
        """Ends all jobs; the message "ended" means a job's files are closed."""


@dataclass(frozen=True)
class Cluster:
    """This machine, or the workers of a scheduler of Dask.

    Attributes:
        num_workers: how many jobs run on this machine at a time.
        scheduler: the address of an existing scheduler instead, such as
            `tcp://10.0.0.1:8786`; its workers must have this package and
            share the file system.
    """

    num_workers: int = 1
    scheduler: str | None = None

    @property
    def slots(self) -> int | None:
        """How many jobs run at a time; None if that is not fixed beforehand.

        A foreign scheduler gets all jobs at once, since others may use
        it, and it may start workers for them.
        """
        return self.num_workers if self.scheduler is None else None

    def connect(self, listener: Listener) -> AbstractContextManager[Workers]:
        """Returns workers, which live as long as the context.

        Args:
            listener: takes the messages of their jobs.

        Raises:
            InputError: if the scheduler does not answer.
        """
        if self.scheduler is None:
            return local_workers(listener, self.num_workers)
        from cns_drake.base.jobs.dask_workers import dask_workers

        return dask_workers(self.scheduler, listener)


def choose_cluster(num_jobs: int | None, scheduler: str | None) -> Cluster:
    """Returns the cluster of a command's options.

    Args:
        num_jobs: `--jobs`: work on this machine, so many jobs at a time.
        scheduler: `--scheduler`. Without either it is the one of the
            environment variable DASK_SCHEDULER_ADDRESS, or else this machine
            with a job for each core.

    Raises:
        InputError: if both are given, or the number is not positive.
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


class LocalWorkers:
    """Runs jobs in processes of this machine.

    No port is opened, since anyone who reached it could run programs here.
    """

    def __init__(self, listener: Listener, threads: ThreadPoolExecutor):
        self._listener = listener
        self._threads = threads
        self._stopped = threading.Event()

    def submit(self, name: str, job: bytes, priority: float) -> None:
        del priority  # There is a thread for each job that is submitted.
        self._threads.submit(self._run, name, job)

    def stop(self) -> None:
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
        except Exception as caught:  # It becomes the result.
            error = caught
        self._listener("ended", name)
        self._listener("result", name, error)


@contextlib.contextmanager
def local_workers(
    listener: Listener, num_workers: int
) -> Iterator[LocalWorkers]:
    """Yields workers of this machine; what still runs at the end is ended."""
    with ThreadPoolExecutor(num_workers) as threads:
        workers = LocalWorkers(listener, threads)
        try:
            yield workers
        finally:
            workers.stop()
