"""A process that feeds damaged files to readers.

If a reader crashes, hangs or takes all memory, the failure is reported with its
input, like any other.
"""

from collections.abc import Callable
import contextlib
from dataclasses import dataclass
import faulthandler
import multiprocessing
import os
from pathlib import Path
import resource
import shutil
import traceback
import warnings

import numpy as np

from helpers.fuzz_mutations import mutate, mutate_bytes

# A case takes milliseconds; the limit is for a busy machine.
DEADLINE_S = 600.0
# Memory that one case may take beyond that of the libraries [bytes].
_MEMORY_BYTES = 3 << 30


@dataclass(frozen=True)
class Target:
    """Something that reads files.

    Attributes:
        name: of the target.
        share: of all mutations, relative to the other targets'.
        build: writes valid files into a folder, which exists.
        mutated: glob patterns of the files to mutate.
        use: reads the files of a folder; may write into `<folder>/out`.
        exact: whether it finds all damage: it then returns the same for a
            damaged file as for the whole one.
        only_bytes: whether to mutate bytes alone, once a case.
        mutate: returns a file mutated in some other way.
    """

    name: str
    share: float
    build: Callable[[Path], object]
    mutated: tuple[str, ...]
    use: Callable[[Path], object]
    exact: bool = False
    only_bytes: bool = False
    mutate: Callable[[Path, bytes, np.random.Generator], bytes] | None = None


class Bench:
    """A folder with a target's files; one at a time is damaged."""

    def __init__(self, target: Target, folder: Path):
        """Builds the files, and uses them undamaged.

        Args:
            target: the reader.
            folder: a new folder; only `<folder>/a/b/c/out` may change.
        """
        self.target = target
        self._top = folder
        self._folder = folder / "a" / "b" / "c"
        self._folder.mkdir(parents=True)
        target.build(self._folder)
        self._files = sorted(
            {
                path
                for pattern in target.mutated
                for path in self._folder.glob(pattern)
                if path.is_file()
            }
        )
        self._originals = {path: path.read_bytes() for path in self._files}
        self._output = self._folder / "out"
        self._output.mkdir()
        self._result = target.use(self._folder)
        self._clear()
        self._contents = self._list()

    def damage(self, seed: int, number: int) -> Path:
        """Damages a file in the way that a number selects."""
        rng = np.random.default_rng([seed, number])
        path = self._files[int(rng.integers(len(self._files)))]
        data = self._originals[path]
        if self.target.mutate is not None:
            path.write_bytes(self.target.mutate(path, data, rng))
        elif self.target.only_bytes:
            path.write_bytes(mutate_bytes(data, rng))
        else:
            path.write_bytes(mutate(path, data, rng))
        return path

    def restore(self, path: Path) -> None:
        path.write_bytes(self._originals[path])
        self._clear()

    def fault(self, refusals: tuple[type[Exception], ...], printed) -> str:
        """Uses the files; returns the fault of the reader, "" without one.

        Args:
            refusals: errors that a reader may raise.
            printed: returns the text printed meanwhile.
        """
        refused = None
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            try:
                result = self.target.use(self._folder)
            except refusals as error:
                refused = str(error)
            except BaseException:
                return traceback.format_exc()
        if warned:
            return f"warning: {warned[0].filename}: {warned[0].message}"
        if self._list() != self._contents and refused is not None:
            return f"left {self._list() ^ self._contents} after: {refused}"
        outside = {
            name
            for name in self._list() ^ self._contents
            if self._output not in name.parents
        }
        if outside:
            return f"changed outside its folder: {outside}"
        if refused is not None:
            return _one_line_fault(refused) or printed()
        if self.target.exact and result != self._result:
            return "another result, without a word"
        return ""

    def _list(self) -> set[Path]:
        return {
            Path(folder, name)
            for folder, _, names in os.walk(self._top)
            for name in names
            # An unfinished file must not have its final name.
            if not name.endswith(".part")
        }

    def _clear(self) -> None:
        if self._output.is_dir() and any(self._output.iterdir()):
            shutil.rmtree(self._output)
        self._output.mkdir(exist_ok=True)


def _one_line_fault(message: str) -> str:
    if not message.strip():
        return "an error without a word"
    if len(message.splitlines()) != 1 or not message.isprintable():
        return f"not a printable line: {message!r}"
    if len(message) > 3000:
        return f"an error of {len(message)} characters: {message[:200]}"
    return ""


class Worker:
    """A process that feeds damaged files to targets."""

    def __init__(self, folder: Path, find: Callable[[str], Target], refusals):
        """Starts the process.

        Args:
            folder: for its files, and for the inputs on which readers fail.
            find: module-level function: name -> target.
            refusals: errors that readers may raise.
        """
        self._folder = folder
        self._arguments = (find, refusals)
        self._context = multiprocessing.get_context("spawn")
        self._start()

    def run(self, name: str, seed: int, count: int) -> list[str]:
        """Feeds a number of damaged files; returns the faults."""
        faults = []
        number = 0
        self._pipe.send((name, seed, number, count))
        while True:
            message = self._receive()
            if isinstance(message, int):
                number = message
                continue
            if message is None:
                return faults
            kept = self._keep(name, number)
            faults.append(f"{name} {number}: {message}\n(input: {kept})")
            if self._process.is_alive():
                self._pipe.send("kept")
            else:
                self._start()
                number += 1
                self._pipe.send((name, seed, number, count))

    def close(self) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.join()

    def _start(self) -> None:
        self._own = self._folder / f"worker_{len(os.listdir(self._folder))}"
        self._own.mkdir()
        self._pipe, other = self._context.Pipe()
        self._process = self._context.Process(
            target=_work, args=(other, self._own, *self._arguments), daemon=True
        )
        self._process.start()
        other.close()
        # There is no deadline, because imports may be slow.
        self._pipe.recv()

    def _receive(self) -> int | str | None:
        """Returns the number of the next case, a fault, or None at the end.

        A fault that the process does not report itself ends the process.
        """
        try:
            if self._pipe.poll(DEADLINE_S):
                return self._pipe.recv()
            fault = f"no answer in {DEADLINE_S:.0f} s"
            self._process.kill()
        except EOFError:
            fault = "the process ended"
        self._process.join()
        printed = (self._own / "printed").read_text(errors="replace")
        return f"{fault}, status {self._process.exitcode}\n{printed[-3000:]}"

    def _keep(self, name: str, number: int) -> Path:
        """Copies the files of a case that failed."""
        source = self._own / name / "a" / "b" / "c"
        kept = self._folder / f"failed_{name}_{number}"
        if source.is_dir():
            shutil.copytree(source, kept)
        return kept


def _work(pipe, folder: Path, find, refusals) -> None:
    """Feeds the requested cases until the other end is closed."""
    log = open(folder / "printed", "w+b", buffering=0)  # noqa: SIM115
    for number in (1, 2):
        os.dup2(log.fileno(), number)
    faulthandler.enable()
    pipe.send("started")

    def printed() -> str:
        """Returns the text printed since the last call."""
        log.seek(0)
        text = log.read().decode(errors="replace")
        log.seek(0)
        log.truncate()
        return text and f"printed beside its error: {text}"

    benches: dict[str, Bench] = {}
    with contextlib.suppress(EOFError):
        while True:
            name, seed, begin, end = pipe.recv()
            _limit_memory(None)
            if name not in benches:
                try:
                    benches[name] = Bench(find(name), folder / name)
                except BaseException:
                    # If the reader fails on whole files, damaged ones show
                    # nothing.
                    pipe.send(traceback.format_exc())
                    pipe.recv()
                    pipe.send(None)
                    continue
            bench = benches[name]
            _limit_memory(_MEMORY_BYTES)
            for number in range(begin, end):
                printed()
                path = bench.damage(seed, number)
                pipe.send(number)
                # Prints the place of a hang before the parent ends the process.
                faulthandler.dump_traceback_later(DEADLINE_S - 5)
                fault = bench.fault(refusals, printed)
                faulthandler.cancel_dump_traceback_later()
                if fault:
                    pipe.send(fault)
                    pipe.recv()
                bench.restore(path)
            pipe.send(None)


def _limit_memory(more: int | None) -> None:
    """Limits the memory of this process to a little more than it has."""
    size = resource.RLIM_INFINITY
    if more is not None:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        size = pages * resource.getpagesize() + more
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (size, hard))
