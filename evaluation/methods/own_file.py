"""Loads a user's method from a Python file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import functools
import importlib.util
import inspect
from pathlib import Path
import sys
import traceback
from typing import Any

from cns_drake.base.errors import InputError
from evaluation.methods.method import Method

# The methods of the interface, which the author may have written.
_CALLED = (
    *("__init__", "describe", "describe_place", "describe_batch"),
    *("build_database", "score", "score_in_drive", "rerank"),
    *("relative_pose", "relative_poses"),
)


def load_method(path: Path) -> type[Method]:
    """Runs a Python file and returns the method that it defines.

    Exceptions in it, then and later, become one line for its author.

    Args:
        path: a file with one subclass of Method of its own, registered.

    Raises:
        InputError: if there is no such file, it fails, or it registers no
            method, several or one that is not whole.
    """
    if not path.is_file():
        raise InputError(f"--method: {path}: no such file")
    # Entered like any import, since dataclasses look their module up; under
    # a name that no other module has.
    name = f"own_method_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"--method: {path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    with _faults(path):
        spec.loader.exec_module(module)
    found = [
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, Method)
        and value.__module__ == name
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
    scans = method.scans_per_place
    if not isinstance(scans, int) or scans < 1:
        raise InputError(
            f"{path}: {method.__name__}: scans_per_place: {scans!r} is not a"
            " positive whole number"
        )
    for name in _CALLED:
        if name in vars(method):
            setattr(
                method, name, _with_named_faults(getattr(method, name), path)
            )
    return method


def _with_named_faults(function: Callable, path: Path) -> Callable:
    """Returns a function whose exceptions become one line."""

    @functools.wraps(function)
    def call(*arguments: Any, **options: Any) -> Any:
        with _faults(path):
            return function(*arguments, **options)

    return call


@contextlib.contextmanager
def _faults(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError:
        raise
    # A SystemExit in the file would end the program without an error.
    except (Exception, SystemExit) as error:
        lines = [
            frame.lineno
            for frame in traceback.extract_tb(error.__traceback__)
            if frame.filename == str(path)
        ]
        where = f"line {lines[-1]}: " if lines else ""
        raise InputError(
            f"{path}: {where}{type(error).__name__}: {error}"
        ) from error
