"""Workers of a scheduler of Dask, on any number of machines.

Dask's own configuration says how to reach it: certificates of TLS, for one.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
import contextlib
import logging
import multiprocessing
from typing import TYPE_CHECKING
import uuid

from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.jobs.processes import ProcessDiedError, run_process

if TYPE_CHECKING:
    from distributed import Client, Future

    from cns_drake.base.jobs.cluster import Listener

# How long a scheduler may take to answer [s].
_ANSWER_TIMEOUT = 10.0
# Dask's name for the key of all jobs.
_KIND = "job"


class DaskWorkers:
    """Has jobs run by the workers of a scheduler; see `Workers`."""

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
            work,
            name,
            job,
            self._id,
            # Up to the first "-", a kind whose duration Dask learns: only then
            # it moves jobs from a worker to an idle one. A new key each time:
            # an old one would stand for the old result.
            key=f"{_KIND}-{name} {self._count}-{self._id}",
            priority=priority,
            pure=False,
        )
        self._futures[name] = future
        future.add_done_callback(lambda future: self._end(name, future))

    def stop(self) -> None:
        futures = list(self._futures.values())
        self._futures.clear()
        self._client.cancel(futures, force=True)

    @property
    def _address(self) -> str:
        return self._client.scheduler.address

    def _end(self, name: str, future: Future) -> None:
        if self._futures.pop(name, None) is not None:
            self._listener("result", name, self._error(future))

    def _error(self, future: Future) -> Exception | None:
        """Returns the error that a job ended with, or None."""
        if future.status == "finished":
            return None
        if future.status == "lost":
            # The job is done, but its worker was lost before its result came
            # here. A second run finds the job done.
            return ProcessDiedError("its worker died")
        if future.status != "error":
            return LostSchedulerError(
                f"{self._address}: the connection to the scheduler was lost; "
                "run the same command again to go on"
            )
        from distributed.scheduler import KilledWorker

        error = future.exception()
        if isinstance(error, KilledWorker):
            return InputError("every worker that ran it died")
        return error


class LostSchedulerError(InputError):
    """Ends all jobs after the connection was lost."""


@contextlib.contextmanager
def dask_workers(address: str, listener: Listener) -> Iterator[DaskWorkers]:
    """Yields the workers of the scheduler at an address.

    Raises:
        InputError: if it does not answer.
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


def work(name: str, job: bytes, topic: str) -> None:
    """Runs a job; what a worker of Dask does.

    Args:
        name: the name of the job.
        job: see `run_process`.
        topic: the Dask topic of the job's messages.

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

    # A worker of Dask is a daemon, which may not start processes. Those of jobs
    # end with it nevertheless.
    multiprocessing.current_process().daemon = False
    report("started")
    try:
        run_process(job, report, is_wanted)
    finally:
        report("ended")
