"""Runs of the programs as forks of one process that has imported all.

A command takes seconds to import its modules, and often little else. In a
folder like that of a virtual environment, `cns-drake` and `cns-eval` are small
clients, which pass their words, folder, environment and standard streams to a
server. The server forks, and the fork runs the program. The process that starts
a program's jobs is a fork of the server, too.
"""

from __future__ import annotations

from collections.abc import Callable
import functools
import gc
import importlib
import json
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import os
from pathlib import Path
import pkgutil
import select
import signal
import socket
import subprocess
import sys
import tempfile

from cns_drake.base.compiled import start_compiler
from cns_drake.base.jobs import job_server
from cns_drake.base.jobs.job_process import ALLOCATION
from cns_drake.base.process import look_seldom

_CLIENT = """#!{python} -IS
import json, os, socket, sys

with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
    server.connect({address!r})
    request = [sys.argv, os.getcwd(), dict(os.environ)]
    socket.send_fds(server, [json.dumps(request).encode()], [0, 1, 2])
    status = server.recv(1)
sys.exit(status[0] if status else 1)
"""
_PROGRAMS = {
    "cns-drake": "cns_drake.__main__",
    "cns-eval": "evaluation.command_line.cli",
}
_LONGEST = 1 << 17
# Those of the processes of jobs; a fork cannot change them any more.
_SETTINGS = {**ALLOCATION, "OPENBLAS_NUM_THREADS": "1"}


class CommandServer:
    """A server, and the folder of its clients.

    Apart from the clients, the folder is the environment of the tests.
    """

    def __init__(self, environment: Path):
        """Makes the folder, and starts the server; `close` ends it."""
        # The address of a socket must be short.
        self._folder = tempfile.TemporaryDirectory()
        address = f"{self._folder.name}/server"
        _link_all(Path(sys.prefix), environment, but={"bin"})
        programs = environment / "bin"
        _link_all(Path(sys.prefix) / "bin", programs, but=_PROGRAMS.keys())
        for name in _PROGRAMS:
            text = _CLIENT.format(python=sys.executable, address=address)
            (programs / name).write_text(text)
            (programs / name).chmod(0o755)
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with listener:
            listener.bind(address)
            listener.listen()
            number = listener.fileno()
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(number)],
                pass_fds=[number],
                stdin=subprocess.PIPE,
                env=os.environ
                | _SETTINGS
                | {"PYTHONPATH": os.pathsep.join(sys.path)},
            )

    def close(self) -> None:
        """Ends the server, which also ends with this process."""
        self._process.communicate()
        self._folder.cleanup()


def _link_all(source: Path, target: Path, but) -> None:
    target.mkdir()
    for path in source.iterdir():
        if path.name not in but:
            (target / path.name).symlink_to(path)


def _serve(listener: socket.socket) -> None:
    """Forks for each client until stdin ends, without waiting for the forks."""
    look_seldom()
    for package in map(importlib.import_module, ("cns_drake", "evaluation")):
        prefix = f"{package.__name__}."
        for found in pkgutil.walk_packages(package.__path__, prefix):
            if "map_closures" not in found.name:  # It needs an extra.
                importlib.import_module(found.name)
    start_compiler()
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    # Forks would take most of their time to look for garbage in all this.
    gc.freeze()
    while listener in select.select([listener, sys.stdin], [], [])[0]:
        client, _ = listener.accept()
        if os.fork() == 0:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            listener.close()
            _answer(client)
            os._exit(0)
        client.close()


def _answer(client: socket.socket) -> None:
    """Runs a client's program or function, and sends its exit status."""
    address = client.getsockname()
    request, streams, _, _ = socket.recv_fds(client, _LONGEST, 4)
    words, folder, environment = json.loads(request)
    process = os.fork()
    if process == 0:
        client.close()
        for number, stream in enumerate(streams[:3]):
            os.dup2(stream, number)
            os.close(stream)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        if connections := streams[3:]:
            os.setsid()
            module, function, *sys.path[:] = words
            run = getattr(importlib.import_module(module), function)
            sys.exit(run(*connections))
        job_server.start_interpreter = functools.partial(_start, address)
        sys.argv = words
        module = _PROGRAMS[Path(words[0]).name]
        sys.exit(importlib.import_module(module).main())
    status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    client.send(bytes([status if status >= 0 else 128 - status]))


class _Started:
    """A process that the server has forked, as a program sees it."""

    def __init__(self, server: socket.socket):
        self._server = server
        self._status: int | None = None

    def wait(self, timeout: float | None = None, /) -> int:
        """Returns its status; see `job_process.StartedProcess`."""
        if self._status is None:
            if not select.select([self._server], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired("function", timeout)
            self._status = (self._server.recv(1) or b"\1")[0]
        return self._status


def _start(
    address: str, function: Callable[[int], None]
) -> tuple[Connection, _Started]:
    """Has the server run a function, as `job_process.start_interpreter` does.

    Args:
        address: the server's.
        function: a module's function; its argument is the number of the file
            descriptor that is connected to this process.
    """
    ours, theirs = Pipe()
    server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    server.connect(address)
    words = [function.__module__, function.__name__, *sys.path]
    request = json.dumps([words, os.getcwd(), dict(os.environ)]).encode()
    with theirs, open(os.devnull) as nothing:
        streams = [nothing.fileno(), 2, 2, theirs.fileno()]
        socket.send_fds(server, [request], streams)
    return ours, _Started(server)


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])))
