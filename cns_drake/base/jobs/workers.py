"""Workers run jobs: on this machine, one thread and one process a job."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import sys
import threading
from typing import Protocol

from cns_drake.base.jobs.job_process import run_process, start_anew
from cns_drake.base.jobs.job_server import JobServer

# Takes a message of a job: the kind, the job's name, and values. Besides what
# the job reports itself these are "started", "ended", and at last "result" with
# the exception that it ended by, or None. It is called from any thread.
Listener = Callable[..., None]


class Workers(Protocol):
    """Runs jobs side by side, and reports them to a `Listener`."""

    def submit(self, name: str, job: bytes, priority: float) -> None:
        """Lets a job run, when there is room.

        Args:
            name: of the job.
            job: see `run_process`.
            priority: of several jobs that wait, the one with the highest comes
                first.
        """

    def stop(self) -> None:
        """Ends all jobs; the message "ended" means a job's files are closed."""


class LocalWorkers:
    """Starts every job at once: the caller sees to it that there is room.

    On Linux their processes are forked from one that has imported what they
    need. On other systems the libraries do not support forks.

    No port is opened, since anyone who reached it could run programs here.
    """

    def __init__(self, listener: Listener):
        self._listener = listener
        self._stopped = threading.Event()
        self._threads: list[threading.Thread] = []
        self._server = JobServer() if sys.platform == "linux" else None

    def submit(self, name: str, job: bytes, priority: float) -> None:
        del priority
        thread = threading.Thread(
            target=self._run, args=(name, job), daemon=True
        )
        self._threads.append(thread)
        thread.start()

    def stop(self) -> None:
        self._stopped.set()

    def join(self) -> None:
        """Waits until nothing runs any more."""
        for thread in self._threads:
            thread.join()
        if self._server is not None:
            self._server.stop()

    def _run(self, name: str, job: bytes) -> None:
        error: Exception | None = None
        self._listener("started", name)
        try:
            run_process(
                job,
                lambda kind, *values: self._listener(kind, name, *values),
                lambda: not self._stopped.is_set(),
                self._server.start if self._server else start_anew,
            )
        except Exception as caught:  # It becomes the result.
            error = caught
        self._listener("ended", name)
        self._listener("result", name, error)


@contextlib.contextmanager
def local_workers(listener: Listener) -> Iterator[LocalWorkers]:
    """Yields workers of this machine; what still runs at the end is ended."""
    workers = LocalWorkers(listener)
    try:
        yield workers
    finally:
        workers.stop()
        workers.join()
