"""Functions of the tests' jobs; the processes of jobs import them."""

from collections.abc import Callable
from dataclasses import dataclass
import multiprocessing
import os
from pathlib import Path
import select
import signal
import threading

from evaluation.base import InputError, Step


@dataclass(frozen=True)
class Call(Step):
    """Calls a function of this module if another one finds that it must."""

    function: Callable
    arguments: tuple = ()
    place: Path | None = None
    done: Callable | None = None

    @property
    def output(self):
        return self.place

    def is_done(self):
        return self.done is not None and self.done(*self.arguments)

    def run(self, reporter):
        self.function(*self.arguments, reporter)


def join(inputs, path, reporter):
    """Writes the contents of files, one after the other."""
    for done, file in enumerate(inputs):
        reporter.doing("joining", done, len(inputs))
        assert file.is_file()
    path.write_text("+".join(file.read_text() for file in inputs) or path.name)


def is_there(inputs, path):
    return path.is_file()


def mark(path, marks, reporter):
    """Writes a file, and its name to another file with the marks of others."""
    path.touch()
    with marks.open("a") as stream:
        stream.write(path.name)


def is_made(path, marks):
    return path.is_file()


def yes(*arguments):
    return True


def cannot_check(*arguments):
    raise InputError("FILE: cannot be read")


def note_process(path, reporter):
    """Writes the process's number, its session, and its parents' numbers."""
    import psutil

    reporter.note("here I am")
    numbers = [os.getpid(), os.getsid(0)]
    numbers += [parent.pid for parent in psutil.Process().parents()[:2]]
    path.write_text(" ".join(map(str, numbers)))


def kill_parent(path, reporter):
    """Kills the process from which this one was forked."""
    os.kill(os.getppid(), signal.SIGKILL)
    path.write_text("at last")


def leave_a_trace(path, reporter):
    """Changes the process after writing the state that it found."""
    path.write_text(os.environ.get("LEFT_BY_A_JOB", "nothing"))
    os.environ["LEFT_BY_A_JOB"] = "a trace"


def refuse(reporter):
    raise InputError("FILE: field: cannot be used")


def stumble(reporter):
    raise ZeroDivisionError("over nothing")


def die(tries, reporter):
    """Ends its process each time, and leaves a mark."""
    with tries.open("a") as stream:
        stream.write("x")
    os.kill(os.getpid(), signal.SIGKILL)


def die_first(tries, path, reporter):
    """Ends its process twice, by two causes, then succeeds."""
    with tries.open("a") as stream:
        stream.write("x")
    tried = len(tries.read_text())
    if tried == 1:
        os._exit(3)
    if tried == 2:
        raise MemoryError
    path.write_text("at last")


def hold(pipe: Path, reporter):
    """Writes its process to a named pipe, then works for ever."""
    with pipe.open("w") as stream:
        stream.write(str(os.getpid()))
    # A signal at any moment is noticed.
    while not threading.Event().wait(0.1):
        pass


def read_holder(pipe: Path) -> int:
    """Returns the holding process as soon as it has written its number.

    The pipe is open for reading and writing, so that a process that fails
    before is not waited for.
    """
    reader = os.open(pipe, os.O_RDWR)
    try:
        assert select.select([reader], [], [], 600)[0], "no job began"
        return int(os.read(reader, 100))
    finally:
        os.close(reader)


def kill_worker(tries, reporter):
    """Ends its own process and the worker, and leaves a mark."""
    with tries.open("a") as stream:
        stream.write("x")
    os.kill(multiprocessing.parent_process().pid, signal.SIGKILL)
    threading.Event().wait()


def note_variable(name, output, reporter):
    output.write_text(repr(os.environ.get(name)))


def note_ports(path, reporter):
    """Writes the number of processes, and the ports they listen on."""
    import psutil

    processes = [psutil.Process(), *psutil.Process().parents()[:2]]
    ports = [
        connection.laddr
        for process in processes
        for connection in process.net_connections("inet")
    ]
    path.write_text(f"processes {len(processes)}, ports {ports}")
