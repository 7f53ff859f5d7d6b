"""A process that imports what jobs need, and forks a process for each.

A job of a study takes a few seconds, and a new interpreter takes one or two to
import what the job needs. A forked process has the modules already. The
imported modules start no threads but those of linear algebra, which survive a
fork. Steps of one group also share what they load.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import gc
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle, send_handle
import os
import pickle
import signal
import subprocess
import sys
import threading
import time

from cns_drake.base.jobs.job_process import (
    ProcessDiedError,
    StartedProcess,
    start_interpreter,
    work,
)
from cns_drake.base.jobs.step import Step
from cns_drake.base.process import look_seldom

# How often the server checks whether a process has ended [s].
_LOOK_INTERVAL = 0.01
# Greatest number of groups that load, since what they load stays in memory. The
# jobs of further ones load by themselves.
_MOST_GROUPS = 8


class JobServer:
    """Starts the processes of jobs on this machine.

    The steps of a group have a server of their own, which is forked from the
    first one. Threads may use it side by side.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        # Group -> its server; the first one has no group.
        self._servers: dict[str | None, _Server] = {}

    def start(self, job: bytes) -> tuple[Connection, _Forked]:
        """Starts the process of a pickled job; see `job_process.Start`.

        Raises:
            ProcessDiedError: the server ends whenever it loads the job.
        """
        group = _group(job)
        with self._lock:
            server = self._server(None, lambda: start_interpreter(serve))
            if group is not None and (
                group in self._servers or len(self._servers) <= _MOST_GROUPS
            ):
                first = server
                server = self._server(group, lambda: first.start(job, "serve"))
        return server.start(job)

    def stop(self) -> None:
        """Ends the servers; processes that they have started go on."""
        with self._lock:
            for server in reversed(self._servers.values()):
                server.stop()

    def _server(
        self,
        group: str | None,
        start: Callable[[], tuple[Connection, StartedProcess]],
    ) -> _Server:
        """Returns the server of a group, started anew if it has ended."""
        server = self._servers.get(group)
        if server is None or not server.is_alive():
            server = self._servers[group] = _Server(*start())
        return server


class _Server:
    """The server's process, as its parent sees it."""

    def __init__(self, connection: Connection, process: StartedProcess):
        self._lock = threading.Lock()
        self._connection, self._process = connection, process

    def is_alive(self) -> bool:
        try:
            self._process.wait(0.0)
        except subprocess.TimeoutExpired:
            return True
        except ProcessDiedError:  # Its parent has died, too.
            pass
        return False

    def start(
        self, job: bytes, kind: str = "start"
    ) -> tuple[Connection, _Forked]:
        """Starts the process of a job, or with "serve" a server for it."""
        ours, theirs = Pipe()
        try:
            with theirs, self._server_errors(), self._lock:
                self._connection.send((kind, job))
                send_handle(
                    self._connection, theirs.fileno(), destination_pid=None
                )
                number = self._connection.recv()
        except ProcessDiedError:
            ours.close()
            raise
        return ours, _Forked(self, number)

    def ask(self, kind: str, *values: int) -> int | None:
        """Returns the answer to a request; see `_serve`."""
        with self._server_errors(), self._lock:
            self._connection.send((kind, *values))
            return self._connection.recv()

    def stop(self) -> None:
        with self._lock:
            self._connection.close()
        with contextlib.suppress(ProcessDiedError):
            self._process.wait()

    @contextlib.contextmanager
    def _server_errors(self) -> Iterator[None]:
        """Turns the end of the server into a ProcessDiedError."""
        try:
            yield
        except (EOFError, OSError) as error:
            status = self._process.wait()
            raise ProcessDiedError(
                f"the process that starts jobs ended with status {status}"
            ) from error


class _Forked:
    """A process that the server has started."""

    def __init__(self, server: _Server, number: int):
        self._server = server
        self._number = number

    def terminate(self) -> None:
        self._server.ask("signal", self._number, signal.SIGTERM)

    def kill(self) -> None:
        self._server.ask("signal", self._number, signal.SIGKILL)

    def wait(self, timeout: float | None = None, /) -> int:
        deadline = None if timeout is None else time.monotonic() + timeout
        while (status := self._server.ask("status", self._number)) is None:
            if deadline is not None and time.monotonic() > deadline:
                raise subprocess.TimeoutExpired("job", timeout or 0.0)
            time.sleep(_LOOK_INTERVAL)
        return status


def _group(job: bytes) -> str | None:
    """Returns the group of a job; the job's process reports failures."""
    try:
        return pickle.loads(job).group
    except Exception:
        return None


def serve(number: int) -> None:
    """Starts processes until the parent has gone; the server's process.

    Args:
        number: of the file descriptor that leads to the parent.
    """
    look_seldom()
    forked = _serve(Connection(number))
    if forked is not None:  # This is the process of a job.
        work(*forked)


def _serve(
    parent: Connection, *, loads: bool = False
) -> tuple[Connection, bytes] | None:
    """Answers a parent; returns what a forked process has to do.

    Args:
        parent: sends requests.
        loads: whether the steps of jobs are loaded, too.
    """
    statuses: dict[int, int | None] = {}
    while True:
        try:
            kind, *values = parent.recv()
        except (EOFError, ConnectionError):
            return None
        answer: int | None = None
        if kind in ("start", "serve"):
            (job,) = values
            connection = Connection(recv_handle(parent))
            _prepare_for(job, loads=loads)
            answer = os.fork()
            if answer == 0:
                parent.close()
                if kind == "serve":
                    return _serve(connection, loads=True)
                os.setsid()
                return connection, job
            connection.close()
            statuses[answer] = None
        else:
            number, *signals = values
            if statuses[number] is None:
                statuses[number] = _look(number)
            if kind == "status":
                answer = statuses[number]
            # The number of an ended process may belong to another one by now.
            elif statuses[number] is None:
                os.kill(number, *signals)
        with contextlib.suppress(ConnectionError):
            parent.send(answer)


def _prepare_for(job: bytes, *, loads: bool) -> None:
    """Prepares for a job; the job's process reports failures."""
    with contextlib.suppress(Exception):
        step: Step = pickle.loads(job)
        step.prepare()
        if loads:
            step.load()
    with contextlib.suppress(Exception):
        if compiling := sys.modules.get("cns_drake.base.compiled"):
            compiling.start_compiler()
    # Garbage collection would write to memory that the processes share.
    gc.freeze()


def _look(number: int) -> int | None:
    """Returns the status of a child that has ended, None before."""
    ended, status = os.waitpid(number, os.WNOHANG)
    return os.waitstatus_to_exitcode(status) if ended else None
