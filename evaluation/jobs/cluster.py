"""Where jobs run: on processes of this machine, or on a cluster."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
import contextlib
from dataclasses import dataclass
import logging
import multiprocessing.resource_tracker
import os
import signal
from typing import TYPE_CHECKING

from evaluation.support.errors import InputError
from evaluation.support.interrupts import uninterrupted
from evaluation.support.processors import num_cores

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

# The address of a scheduler, for whoever gives none; Dask's own name for it.
_ADDRESS_VARIABLE = "DASK_SCHEDULER_ADDRESS"
# How long a scheduler may take to answer [s].
_ANSWER_TIMEOUT = 10.0


@dataclass(frozen=True)
class Cluster:
    """A scheduler of Dask and its workers.

    Attributes:
        num_workers: processes of this machine, each for one job at a time.
        scheduler: the address of an existing scheduler instead, such as
            `tcp://10.0.0.1:8786`; its workers must have this package and
            share the file system.
    """

    num_workers: int = 1
    scheduler: str | None = None

    @property
    def slots(self) -> int | None:
        """How many jobs it runs at a time, if that is known beforehand.

        A foreign scheduler is told of all jobs at once, since others may use
        it, and it may start workers for them.
        """
        return self.num_workers if self.scheduler is None else None

    @contextlib.contextmanager
    def connect(self) -> Iterator[Client]:
        """Yields a client; workers of this machine live as long as it.

        Raises:
            InputError: if the scheduler does not answer.
        """
        # Slow to import, and needed by nobody who asks for help.
        from distributed import Client

        # What happens to jobs is told by whoever runs them, in other words.
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        place = self.scheduler
        if place is not None:
            _check_answer(place)
        with contextlib.ExitStack() as stack:
            with uninterrupted():  # Half of it could not be closed.
                if place is None:
                    place = stack.enter_context(
                        _local_cluster(self.num_workers)
                    )
                client = stack.enter_context(
                    Client(place, timeout=_ANSWER_TIMEOUT, set_as_default=False)
                )
            yield client


def choose_cluster(num_jobs: int | None, scheduler: str | None) -> Cluster:
    """Returns the cluster that a user asks for.

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
            raise InputError("--jobs and --scheduler: give one of them")
        if num_jobs < 1:
            raise InputError(f"--jobs: {num_jobs} is not a positive number")
        return Cluster(num_workers=num_jobs)
    return Cluster(
        num_workers=num_cores(),
        scheduler=scheduler or os.environ.get(_ADDRESS_VARIABLE) or None,
    )


def _local_cluster(num_workers: int) -> LocalCluster:
    from distributed import LocalCluster

    # Ctrl-C reaches all processes of a terminal at once. It is for this one
    # to end the others: they, and the threads that start them, inherit that
    # the signal is blocked. The first start of a process would unblock it.
    multiprocessing.resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return LocalCluster(
            n_workers=num_workers,
            threads_per_worker=1,
            # What takes memory are the processes of the jobs.
            memory_limit=0,
            # On a free port; no dashboard is shown there.
            dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": False},
            silence_logs=logging.CRITICAL,
        )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _check_answer(address: str) -> None:
    """Raises InputError unless a scheduler answers in time.

    A client would wait for ever for one that takes the call but is silent.
    """
    from distributed import Security
    from distributed.core import rpc

    async def ask() -> None:
        keys = Security().get_connection_args("client")
        async with rpc(address, connection_args=keys) as scheduler:
            await scheduler.identity()

    fault = f"--scheduler: {address}: no answer"
    try:
        asyncio.run(asyncio.wait_for(ask(), _ANSWER_TIMEOUT))
    except asyncio.TimeoutError:
        raise InputError(f"{fault} in {_ANSWER_TIMEOUT:g} s") from None
    # Dask has all of these for an address of which it can make nothing, such
    # as one of TLS without a certificate.
    except (ImportError, OSError, TypeError, ValueError) as error:
        raise InputError(f"{fault} ({error})") from error
