"""Which package of the name `evaluation` a process finds.

Many a project has a folder `evaluation`. The simulator needs ours for studies
alone, and says so where another one stands in its place.
"""

from __future__ import annotations

from importlib.util import find_spec
import os

from cns_drake.base.errors import InputError

# Where `cns_drake` and `evaluation` lie side by side.
_ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "../.."))


def leave_out_folder(search_path: list[str]) -> None:
    """Takes the current folder off the search path of a program.

    `python -m` puts it there. It stays if it holds this package.

    Args:
        search_path: `sys.path`, which is changed.
    """
    here = os.path.realpath(os.curdir)
    if here != _ROOT:
        search_path[:] = [
            folder for folder in search_path if os.path.realpath(folder) != here
        ]


def check_evaluation() -> None:
    """Refuses a process in which `import evaluation` gives another package.

    Raises:
        InputError: the package that stands in the way, and what to do.
    """
    spec = find_spec("evaluation")
    ours = os.path.join(_ROOT, "evaluation", "__init__.py")
    if spec is not None and spec.origin is not None:
        found = os.path.realpath(spec.origin)
        if found == ours:
            return
        raise InputError(
            f"{found}: this 'evaluation' hides the package of that name which"
            " cns-drake evaluates with; rename it, or take its folder out of"
            " PYTHONPATH"
        )
    raise InputError(f"{ours}: the package 'evaluation' is not installed")
