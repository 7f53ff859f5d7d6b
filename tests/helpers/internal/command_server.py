"""Runs of the programs as forks of one process that has imported all.

A command takes seconds to import its modules, and often little else. In a
folder like that of a virtual environment, `cns-drake` and `cns-eval` are small
clients, which pass their words, folder, environment and standard streams to a
server. The server forks, and the fork runs the program. So does `python`, if it
is to run a file.

The program is that of the checkout. If `INSTALLED_VARIABLE` names the Python of
another environment, it is the one that is installed there.
"""

import gc
import importlib
import json
import multiprocessing
import os
from pathlib import Path
import pkgutil
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile

from _pytest.monkeypatch import MonkeyPatch

import cns_drake
from cns_drake.simulation import simulate
from evaluation.base.compilation import start_compiler
from evaluation.base.jobs import processes
from evaluation.base.jobs.processes import ALLOCATION
from evaluation.recognition import chosen_methods
from helpers.internal.studies import leave_figures_unrendered
from helpers.tiny_drive import tiny_scenario

# Environment variable with the methods that a study compares; its figures are
# not rendered, either.
METHODS_VARIABLE = "CNS_DRAKE_TEST_METHODS"
# Environment variable with the Python of an environment in which the program is
# installed from its wheel, as `.ci/run` does. It must find the packages that
# tests need, too.
INSTALLED_VARIABLE = "CNS_DRAKE_TEST_INSTALLED"

_CLIENT = """#!{python} -IS
import json, os, socket, sys

program, *words = sys.argv
if program.endswith("/python") and not "".join(words[:1]).endswith(".py"):
    os.execv({python!r}, [{python!r}, *words])
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
_CLIENTS = {*_PROGRAMS, "python"}
_TESTS = Path(__file__).parents[2]
_LONGEST = 1 << 17
# Those of the processes of jobs; a fork cannot change them any more.
_SETTINGS = {**ALLOCATION, "OPENBLAS_NUM_THREADS": "1"}


class CommandServer:
    """A server, and the folder of its clients.

    Apart from the clients, the folder is the environment of the tests, or the
    one in which the program is installed.
    """

    def __init__(self, environment: Path):
        """Makes the folder, and starts the server; `close` ends it."""
        # The address of a socket must be short.
        self._folder = tempfile.TemporaryDirectory()
        address = f"{self._folder.name}/server"
        installed = os.environ.get(INSTALLED_VARIABLE)
        python = installed or sys.executable
        path = [str(_TESTS)] if installed else sys.path
        prefix = Path(python).parents[1]
        _link_all(prefix, environment, but={"bin"})
        programs = environment / "bin"
        _link_all(prefix / "bin", programs, but=_CLIENTS)
        if installed:  # Programs of extras are those of the tests.
            known = {path.name for path in programs.iterdir()}
            _link_all(Path(sys.prefix) / "bin", programs, known | _CLIENTS)
        for name in _CLIENTS:
            text = _CLIENT.format(python=python, address=address)
            (programs / name).write_text(text)
            (programs / name).chmod(0o755)
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with listener:
            listener.bind(address)
            listener.listen()
            number = listener.fileno()
            self._process = subprocess.Popen(
                [python, "-m", __name__, str(number)],
                pass_fds=[number],
                stdin=subprocess.PIPE,
                env=os.environ
                | _SETTINGS
                | {"PYTHONPATH": os.pathsep.join(path)},
                # Python looks for packages in the current folder first.
                cwd=environment,
            )

    def close(self) -> None:
        """Ends the server, which also ends with this process."""
        self._process.communicate()
        self._folder.cleanup()


def _link_all(source: Path, target: Path, but) -> None:
    target.mkdir(exist_ok=True)
    for path in source.iterdir():
        if path.name not in but:
            (target / path.name).symlink_to(path)


def _serve(listener: socket.socket) -> None:
    """Forks for each client until stdin ends, without waiting for the forks."""
    if INSTALLED_VARIABLE in os.environ:
        assert _TESTS.parent not in Path(cns_drake.__file__).parents
    gc.set_threshold(50_000)
    os.fsync = os.fstat  # As in the process of the tests.
    for package in map(
        importlib.import_module, ("cns_drake", "evaluation", "worlds")
    ):
        prefix = f"{package.__name__}."
        for found in pkgutil.walk_packages(package.__path__, prefix):
            if "map_closures" not in found.name:  # It needs an extra.
                importlib.import_module(found.name)
    start_compiler()
    # Forks need not load the compiled loops of each recording.
    with tempfile.TemporaryDirectory() as folder:
        simulate(tiny_scenario(Path(folder), frames=2), folder)
    # Jobs are forks, too: else each command would import all modules again.
    processes._context = multiprocessing.get_context("fork")
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
    """Runs a client's program, and sends its exit status."""
    request, streams, _, _ = socket.recv_fds(client, _LONGEST, 3)
    words, folder, environment = json.loads(request)
    process = os.fork()
    if process == 0:
        client.close()
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
            os.close(stream)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        name = Path(words[0]).name
        if name == "python":
            sys.argv = words[1:]
            sys.path.insert(0, str(Path(words[1]).resolve().parent))
            runpy.run_path(words[1], run_name="__main__")
            sys.exit()
        sys.argv = words
        if METHODS_VARIABLE in environment:
            methods = tuple(environment[METHODS_VARIABLE].split())
            chosen_methods.shipped_methods = lambda: methods
            leave_figures_unrendered(MonkeyPatch())
        sys.exit(importlib.import_module(_PROGRAMS[name]).main())
    status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    client.send(bytes([status if status >= 0 else 128 - status]))


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])))
