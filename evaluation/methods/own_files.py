"""A wall: Python files of users, which share the process with the program.

A user's file defines a method of place recognition, or an estimator of poses.
The file runs once. Afterwards the search path of modules and the working
directory are as before, and the modules beside the file belong to it alone. Its
functions run in the context `users_code`: what they print goes to stderr,
because stdout contains the program's results, and a fault is reported in one
line.
"""

from collections.abc import Callable, Iterator
import contextlib
import functools
import hashlib
import importlib.util
import inspect
import os
from pathlib import Path
import sys
import sysconfig
import threading
import traceback
from types import ModuleType
from typing import Any

from evaluation.base import InputError, errors_at
from evaluation.methods.method import Method

# Functions of the interface that a method's author may have written.
_WRITTEN_BY_USERS = (
    "__init__",
    "describe",
    "describe_place",
    "describe_batch",
    "build_database",
    "score",
    "score_in_drive",
    "num_shortlisted",
    "shortlist",
    "score_best",
    "rerank",
    "relative_pose",
    "relative_poses",
    "for_lidar",
    "assumption",
)


def load_method(path: Path) -> type[Method]:
    """Returns the method that a user's Python file defines.

    The functions of the method run in the context `users_code`.

    Args:
        path: Python file that defines and registers one subclass of Method.

    Raises:
        InputError: there is no such file, it fails, or it does not register
            exactly one complete method.
    """
    method = _registered_method(run_module(path), path)
    method._file = path
    for name in _WRITTEN_BY_USERS:
        # Also functions that another class of the file defines.
        function = inspect.getattr_static(method, name)
        if function is inspect.getattr_static(Method, name):
            continue
        if isinstance(function, staticmethod | classmethod):
            own = as_users_code(function.__func__, path)
            setattr(method, name, type(function)(own))
        elif isinstance(function, property):
            assert function.fget is not None
            own = as_users_code(function.fget, path)
            setattr(method, name, function.getter(own))
        else:
            setattr(method, name, as_users_code(function, path))
    return method


def _registered_method(module: ModuleType, path: Path) -> type[Method]:
    found = [
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, Method)
        and value.__module__ == module.__name__
        and "name" in vars(value)
    ]
    if len(found) != 1:
        raise InputError(
            f"{path}: registers {len(found)} methods instead of one"
        )
    return found[0]


# The process has one stdout, so the code of one file runs at a time.
_turn = threading.RLock()


def run_module(path: Path) -> ModuleType:
    """Returns the module of a user's Python file, after running it.

    Raises:
        InputError: if there is no such file, or it fails.
    """
    if not path.is_file():
        raise InputError(f"--method: {path}: no such file")
    place = os.path.abspath(path)
    # Files of one name in different folders are different modules.
    where = hashlib.sha256(place.encode("utf-8", "surrogateescape"))
    name = f"own_method_{path.stem}_{where.hexdigest()[:8]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"--method: {path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    # Dataclasses look up their module there.
    sys.modules[name] = module
    with users_code(path), errors_at(path, f"{place}: "), _kept_apart(place):
        spec.loader.exec_module(module)
    return module


def as_users_code(function: Callable, path: Path) -> Callable:
    """Returns a function of a user's file that runs in `users_code`."""

    # The file may change the directory in which a relative path begins.
    place = os.path.abspath(path)

    @functools.wraps(function)
    def call(*arguments: Any, **options: Any) -> Any:
        with users_code(path, place):
            return function(*arguments, **options)

    return call


@contextlib.contextmanager
def users_code(path: Path, place: str | None = None) -> Iterator[None]:
    """Runs code of a user's file; inside, stdout is stderr.

    Args:
        path: the file, as errors name it.
        place: its absolute path, if known.

    Raises:
        InputError: the code in the context raised an exception. The error has
            one line, with the file and the number of the line that failed.
    """
    place = place or os.path.abspath(path)
    with _turn, _named_faults(path, place), _stdout_on_stderr():
        yield


@contextlib.contextmanager
def _stdout_on_stderr() -> Iterator[None]:
    """Sends to stderr what Python code, libraries and child processes print."""
    with contextlib.redirect_stdout(sys.stderr):
        try:
            kept = os.dup(1)
        except OSError:  # The program has no stdout.
            yield
            return
        try:
            # Python's own buffer still belongs to stdout.
            if sys.__stdout__ is not None:
                sys.__stdout__.flush()
            with contextlib.suppress(OSError):
                os.dup2(2, 1)
            yield
        finally:
            os.dup2(kept, 1)
            os.close(kept)


@contextlib.contextmanager
def _kept_apart(place: str) -> Iterator[None]:
    """Takes back what a file changes for others while it is run.

    Modules in its folders are forgotten: other files have some of these names.
    """
    directory, folders = os.getcwd(), list(sys.path)
    modules = set(sys.modules)
    try:
        yield
    finally:
        os.chdir(directory)
        added = [one for one in sys.path if one not in folders]
        sys.path[:] = folders
        for name in set(sys.modules) - modules:
            if _lies_in(sys.modules[name], (os.path.dirname(place), *added)):
                del sys.modules[name]


def _lies_in(module: ModuleType, folders: tuple[str, ...]) -> bool:
    """Returns whether a module lies in folders, and is not installed."""
    file = getattr(module, "__file__", None)
    places = [file] if file else list(getattr(module, "__path__", ()))
    return any(
        _is_below(place, folders) and not _is_below(place, _installed())
        for place in places
        if isinstance(place, str)
    )


def _is_below(place: str, folders: tuple[str, ...]) -> bool:
    place = os.path.realpath(place)
    return any(
        place.startswith(os.path.join(os.path.realpath(folder or "."), ""))
        for folder in folders
    )


@functools.cache
def _installed() -> tuple[str, ...]:
    """Returns the folders of Python, of its packages and of this project."""
    project = Path(__file__).parents[2]
    ours = [
        str(project / name) for name in ("evaluation", "worlds", "cns_drake")
    ]
    return (*sysconfig.get_paths().values(), *ours)


@contextlib.contextmanager
def _named_faults(path: Path, place: str) -> Iterator[None]:
    """Turns an exception of a user's file into an error that names the file."""
    try:
        yield
    except (InputError, KeyboardInterrupt):
        raise
    # A SystemExit in the file would end the program without an error.
    except BaseException as error:
        # Python makes the name of a module's file absolute.
        lines = [
            frame.lineno
            for frame in traceback.extract_tb(error.__traceback__)
            if os.path.abspath(frame.filename) == place
        ]
        where = f"line {lines[-1]}: " if lines else ""
        advice = ""
        if "read-only" in str(error):
            advice = " (all methods share a cloud; change a copy of it)"
        raise InputError(
            f"{path}: {where}{type(error).__name__}: {error}{advice}"
        ) from error
