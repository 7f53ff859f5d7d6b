"""Loads Python files of users, and reports a fault in a file in one line.

A user's file defines a method of place recognition, or an estimator of poses.
"""

from collections.abc import Callable, Iterator
import contextlib
import functools
import importlib.util
import inspect
import os
from pathlib import Path
import sys
import traceback
from types import ModuleType
from typing import Any

from cns_drake.base import InputError
from evaluation.methods.method import Method, MethodConfig

# Functions of the interface that a method's author may have written.
_WRITTEN_BY_USERS = (
    "__init__",
    "describe",
    "describe_place",
    "describe_batch",
    "build_database",
    "score",
    "score_in_drive",
    "rerank",
    "relative_pose",
    "relative_poses",
    "for_lidar",
    "assumption",
)


def load_method(path: Path) -> type[Method]:
    """Returns the method that a user's Python file defines.

    The functions of the method are wrapped by `with_named_faults`.

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
            own = with_named_faults(function.__func__, path)
            setattr(method, name, type(function)(own))
        else:
            setattr(method, name, with_named_faults(function, path))
    return method


def _registered_method(module: ModuleType, path: Path) -> type[Method]:
    """Returns the one method that a module registers.

    Raises:
        InputError: the module does not register exactly one complete method.
    """
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
    method = found[0]
    if inspect.isabstract(method):
        missing = ", ".join(sorted(method.__abstractmethods__))
        raise InputError(f"{path}: {method.__name__}: lacks {missing}")
    kind = method.Config
    if not (isinstance(kind, type) and issubclass(kind, MethodConfig)):
        raise InputError(
            f"{path}: {method.__name__}: Config: {kind!r} is no MethodConfig"
        )
    scans = method.scans_per_place
    if not isinstance(scans, int) or scans < 1:
        raise InputError(
            f"{path}: {method.__name__}: scans_per_place: {scans!r} is not a"
            " positive whole number"
        )
    if method.divides and method.rerank_best:
        raise InputError(
            f"{path}: {method.__name__}: divides: a database that is searched "
            "part by part keeps no clouds for rerank_best; set one of the two"
        )
    return method


def run_module(path: Path) -> ModuleType:
    """Returns the module of a user's Python file, after running it.

    Raises:
        InputError: if there is no such file, or it fails.
    """
    if not path.is_file():
        raise InputError(f"--method: {path}: no such file")
    name = f"own_method_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"--method: {path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    # Dataclasses look up their module there.
    sys.modules[name] = module
    with named_faults(path):
        spec.loader.exec_module(module)
    return module


def with_named_faults(function: Callable, path: Path) -> Callable:
    """Returns a function of a user's file, wrapped in `named_faults`."""

    @functools.wraps(function)
    def call(*arguments: Any, **options: Any) -> Any:
        with named_faults(path):
            return function(*arguments, **options)

    return call


@contextlib.contextmanager
def named_faults(path: Path) -> Iterator[None]:
    """Turns an exception of a user's file into an error that names the file.

    Raises:
        InputError: the code in the context raised an exception. The error has
            one line, with the file and the number of the line that failed.
    """
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
            if os.path.abspath(frame.filename) == os.path.abspath(path)
        ]
        where = f"line {lines[-1]}: " if lines else ""
        advice = ""
        if "read-only" in str(error):
            advice = " (all methods share a cloud; change a copy of it)"
        raise InputError(
            f"{path}: {where}{type(error).__name__}: {error}{advice}"
        ) from error
