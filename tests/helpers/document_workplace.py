"""A folder in which the documents are followed, recipe after recipe."""

from collections.abc import Mapping
import contextlib
import os
from pathlib import Path
import queue
import re
import subprocess
import threading

from helpers import documents
from helpers.document_recipes import NOT_RUN, RECIPES
from helpers.internal.command_server import METHODS_VARIABLE, CommandServer

# Studies take most of their time for the methods, one after the other.
_METHODS = "scan-context++ solid"

# A program with its first word: what a recipe shows the use of.
_USE = re.compile(r"\bcns-(?:drake|eval) [a-z-]+|\bpython \S+\.py")

# A machine that runs other tests as well may answer late.
_PATIENT = {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "300s"}


def claims(piece: documents.Piece) -> list[str]:
    """Returns the recipes of a piece, or the reasons not to run it."""
    # Several pieces may have the same reason.
    starts = [(name, recipe.start) for name, recipe in RECIPES.items()]
    starts += [(reason, start) for start, reason in NOT_RUN.items()]
    return [name for name, start in starts if piece.text.startswith(start)]


def daily() -> set[str]:
    """Returns the names of the recipes that each run of the tests follows.

    They hold the first use of each command, in the order of the recipes, and
    what uses no command. A server alone shows nothing. Recipes for the night
    are left out.
    """
    texts = {
        name: piece.text
        for page in documents.pages()
        for piece in documents.pieces(page)
        for name in claims(piece)
    }
    used: set[str] = set()
    found = set()
    for name, recipe in RECIPES.items():
        runs = recipe.file is None or recipe.command is not None
        uses = set(_USE.findall(f"{texts[name]} {recipe.command}" * runs))
        is_daily = recipe.ready is None and not recipe.by_night
        if is_daily and not (uses and uses <= used):
            found.add(name)
            used |= uses
    return found


class Workplace:
    """Commands run as they are written, with the programs under test.

    Each recipe runs once; so does a command of several recipes. `close` ends
    commands that do not end by themselves. The programs are forks of one
    process, see `command_server`; `test_wheel` runs them as installed.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self._started = contextlib.ExitStack()
        self._values: dict[str, str] = {}
        self._pieces = [
            piece
            for page in documents.pages()
            for piece in documents.pieces(page)
        ]
        self._followed: dict[str, str] = {}
        self._printed: dict[tuple[str, bool], str] = {}
        server = CommandServer(folder / ".venv")
        self._started.callback(server.close)
        for name in ("diagrams", "pyproject.toml"):
            (folder / name).symlink_to(documents.ROOT / name)

    def follow(self, name: str) -> str:
        """Follows a recipe, after those that it needs; returns its stdout."""
        if name not in self._followed:
            for needed in RECIPES[name].after:
                self.follow(needed)
            self._followed[name] = self._follow(name)
        return self._followed[name]

    def close(self) -> None:
        """Ends the commands that are still running."""
        self._started.close()

    def _follow(self, name: str) -> str:
        recipe = RECIPES[name]
        (piece,) = (p for p in self._pieces if name in claims(p))
        text = piece.text
        for old, new in recipe.changes:
            assert old in text, f"{piece.place}: no {old!r} to change"
            text = text.replace(old, new.format(**self._values))
        commands = text.splitlines()
        if recipe.file is not None:
            path = self.folder / recipe.file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            commands = [recipe.command] if recipe.command else []
        if recipe.ready is not None:
            self._start(text, recipe.ready)
            commands = []
        more = {} if recipe.all_methods else {METHODS_VARIABLE: _METHODS}
        printed = [
            self._run(piece.place, command, os.environ | more)
            for command in commands
        ]
        if recipe.prepare is not None:
            recipe.prepare(self.folder)
        return "".join(printed)

    def _run(
        self, place: str, command: str, environment: Mapping[str, str]
    ) -> str:
        # The help of commands names them without their folder.
        command = f".venv/bin/{command.removeprefix('.venv/bin/')}"
        # A study of other methods is another run.
        key = command, METHODS_VARIABLE in environment
        if key not in self._printed:
            done = subprocess.run(
                ["bash", "-euo", "pipefail", "-c", command],
                cwd=self.folder,
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            assert done.returncode == 0, f"{place}: {command}\n{done.stderr}"
            self._printed[key] = done.stdout
        return self._printed[key]

    def _start(self, command: str, ready: str) -> None:
        process = subprocess.Popen(
            ["bash", "-c", f"exec {command}"],
            cwd=self.folder,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | _PATIENT,
        )
        # The pipe is read to the end, because a full pipe stops the process.
        lines = queue.SimpleQueue()
        reader = threading.Thread(target=_pass_on, args=(process, lines))
        reader.start()
        self._started.callback(reader.join)
        self._started.callback(process.wait)
        self._started.callback(process.terminate)
        printed = []
        while (line := lines.get()) is not None:
            printed.append(line)
            if match := re.search(ready, line):
                self._values |= match.groupdict()
                return
        raise AssertionError(f"{command}\n{''.join(printed)}")


def _pass_on(process, lines: queue.SimpleQueue) -> None:
    """Puts the lines of a process's stderr into a queue, and None."""
    with process.stderr:
        for line in process.stderr:
            lines.put(line)
    lines.put(None)
