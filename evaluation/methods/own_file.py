"""Methods of one's own, from a Python file anywhere."""

from __future__ import annotations

import importlib.util
from pathlib import Path
import sys

from evaluation.methods.method import Method
from evaluation.support.errors import InputError


def load_method(path: Path) -> type[Method]:
    """Runs a Python file and returns the method that it defines.

    Args:
        path: a file with one subclass of Method of its own, registered.

    Raises:
        InputError: if there is no such file, it fails, or it registers no
            method or several.
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
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"{path}: {type(error).__name__}: {error}") from error
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
    return found[0]
