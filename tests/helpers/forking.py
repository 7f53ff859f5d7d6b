"""Python programs as forks of one process that has imported libraries.

An interpreter takes seconds to import what most programs need. A fork is as new
as it is in all that a program imports itself.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
import subprocess
import sys

_SERVER = """
import gc, importlib, json, os, runpy, sys

setting, *modules = sys.argv[1:]
for module in modules:
    importlib.import_module(module)
exec(setting)
gc.freeze()
for line in sys.stdin:
    *outputs, folder, path, words = json.loads(line)
    if os.fork() == 0:
        for number, output in enumerate(outputs, start=1):
            with open(output, "w") as printed:
                os.dup2(printed.fileno(), number)
        os.chdir(folder)
        sys.path[:0] = path
        if words[0] == "-m":
            sys.argv = words[1:]
            runpy.run_module(words[1], run_name="__main__", alter_sys=True)
        else:
            sys.argv = words
            runpy.run_path(words[0], run_name="__main__")
        sys.exit()
    print(os.waitstatus_to_exitcode(os.wait()[1]), flush=True)
"""


class ForkingPython:
    """A process that imports modules, and forks for each program."""

    def __init__(self, folder: Path, modules, setting: str = "", path=()):
        """Starts the process; `close` ends it.

        Args:
            folder: for what the programs print.
            modules: to import.
            setting: code that it runs then.
            path: folders that come first where it looks for modules.
        """
        self._printed = [folder / "printed", folder / "errors"]
        self._process = subprocess.Popen(
            [sys.executable, "-c", _SERVER, setting, *modules],
            env=os.environ
            | {"PYTHONPATH": os.pathsep.join(map(str, [*path, *sys.path]))},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, words, folder: Path, path=()) -> subprocess.CompletedProcess:
        """Runs a script, or `-m` and a module, with its arguments.

        Args:
            words: as those of a command, without the interpreter.
            folder: in which it runs.
            path: folders that come first where it looks for modules.
        """
        words = list(map(str, words))
        order = [*map(str, self._printed), str(folder), [*path], words]
        print(json.dumps(order), file=self._process.stdin, flush=True)
        status = int(self._process.stdout.readline())
        printed = [file.read_text() for file in self._printed]
        return subprocess.CompletedProcess(words, status, *printed)

    def close(self) -> None:
        """Ends the process."""
        self._process.communicate()
