"""Keeps code and settings of the working folder out: a wall.

The working folder may have come from somebody else, as a world or a recording.
Of what lies there, programs read what they are told to read, and nothing else.
"""

from collections.abc import Iterator, Sequence
import contextlib
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
import os
import subprocess
import sys
from types import ModuleType

# The folder that holds this package.
_ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "../.."))
# Module that reads settings from the working folder -> name of their file.
_SETTINGS = {
    "matplotlib": "matplotlibrc",
    "numba.core.config": ".numba_config.yaml",
}
_START = """
import runpy, sys
sys.path[:] = sys.argv[2:]
runpy.run_module(sys.argv[1], run_name="__main__")
"""


def leave_out_folder(search_path: list[str]) -> None:
    """Removes the working folder from a search path for modules.

    `python -m` and an empty part of PYTHONPATH add it. A working folder that
    contains this package is not removed.

    Args:
        search_path: `sys.path` or a copy, which is changed in place.
    """
    here = os.path.realpath(os.curdir)
    if here != _ROOT:
        search_path[:] = [
            folder for folder in search_path if os.path.realpath(folder) != here
        ]


def leave_working_folder() -> None:
    """Removes the working folder from `sys.path`.

    The process ends with a line on stderr if the folder is not there any more.
    """
    try:
        leave_out_folder(sys.path)
    except FileNotFoundError:
        print(
            "error: the working folder is not there any more", file=sys.stderr
        )
        sys.exit(2)


def start_python(module: str) -> subprocess.Popen[bytes]:
    """Runs a module in a Python of its own, which works in the root folder.

    The process imports from where this process does, but for the working
    folder. It is given absolute paths.

    Args:
        module: name of the module, which is run as `__main__`.

    Returns:
        The process; its input and output are pipes, and its messages are lost.
    """
    search_path = [os.path.abspath(folder) for folder in sys.path]
    leave_out_folder(search_path)
    return subprocess.Popen(
        [sys.executable, "-I", "-c", _START, module, *search_path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        # Libraries load other libraries and settings from the working folder.
        cwd="/",
    )


def ignore_local_settings() -> None:
    """Hides settings in the working folder from libraries imported from now on.

    A user's own settings, in the home folder or in variables, count.
    """
    if not any(isinstance(one, _SettingsFinder) for one in sys.meta_path):
        sys.meta_path.insert(0, _SettingsFinder())


class _SettingsFinder(MetaPathFinder):
    """Finds the modules that read settings, and hides these meanwhile."""

    def find_spec(
        self,
        name: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        if name not in _SETTINGS:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_unset(module: ModuleType) -> None:
                with _hidden(_SETTINGS[name]):
                    execute(module)
                # Numba reads the file again whenever it compiles.
                vars(module)["_config_fname"] = ""

            # It is the loader of this module alone.
            vars(spec.loader)["exec_module"] = execute_unset
        return spec


@contextlib.contextmanager
def _hidden(file: str) -> Iterator[None]:
    """Makes a file seem not to exist, by its relative name."""
    exists = os.path.exists
    os.path.exists = lambda path: path != file and exists(path)
    try:
        yield
    finally:
        os.path.exists = exists
