"""Where jobs run: on processes of this machine, or on a cluster."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
import os

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.workers import Listener, Workers, local_workers
from cns_drake.base.process import num_cores

# Environment variable with the address of a scheduler; the name is Dask's.
_ADDRESS_VARIABLE = "DASK_SCHEDULER_ADDRESS"


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
            return local_workers(listener)
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
