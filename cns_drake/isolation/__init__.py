"""Our `evaluation` where a package of the user's has that name as well.

Many a project has a folder `evaluation`, and Python takes the first that
`sys.path` or `sys.modules` leads to. Where that is not ours, which lies beside
`cns_drake`, a program of ours puts the folders that hold another one last.
Anybody else's process keeps its own: there ours is loaded as
`cns_drake._evaluation`, and in the modules of both `import evaluation` means
that one. An import statement asks the `__builtins__` of its module for
`__import__`, so that no other module notices.

In a process where nothing stands in the way, nothing of this happens.

The limits: in a process with two, ours is reached as `cns_drake.evaluation`
only; and what was ours when `cns_drake` was imported remains so.
"""

from __future__ import annotations

import builtins
import importlib
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import spec_from_file_location
import os
import sys
from types import ModuleType
from typing import Any

_ROOT = os.path.dirname(os.path.dirname(os.path.dirname(__file__)))
_OURS = os.path.join(_ROOT, "evaluation", "__init__.py")
_PRIVATE = "cns_drake._evaluation"


def isolate() -> None:
    """Sees that the modules of `cns_drake` get our `evaluation`."""
    if _Finder not in sys.meta_path and _is_hidden():
        sys.meta_path.insert(0, _Finder)


def prefer_ours() -> None:
    """Sees that `evaluation` is ours, in a process that is ours alone."""
    sys.path.sort(key=_holds_another)  # Stable: all else stays in order.
    if _Finder in sys.meta_path and not _is_hidden():
        sys.meta_path.remove(_Finder)


def our_evaluation() -> ModuleType:
    """Returns our package, under whatever name it is loaded."""
    is_private = _Finder in sys.meta_path
    return importlib.import_module(_PRIVATE if is_private else "evaluation")


def _is_hidden() -> bool:
    """Whether `import evaluation` would give another package, or none."""
    if "evaluation" in sys.modules:
        origin = getattr(sys.modules["evaluation"], "__file__", None)
    else:
        spec = PathFinder.find_spec("evaluation")
        origin = spec and spec.origin
    return not origin or os.path.realpath(origin) != os.path.realpath(_OURS)


def _holds_another(folder: str) -> bool:
    name = os.path.join(folder, "evaluation")
    return (
        os.path.isdir(name) or os.path.isfile(f"{name}.py")
    ) and os.path.realpath(name) != os.path.realpath(os.path.dirname(_OURS))


class _Finder:
    """Finds the modules of `cns_drake`, and of `evaluation` as its part."""

    @staticmethod
    def find_spec(
        name: str, path: Any = None, target: Any = None
    ) -> ModuleSpec | None:
        # A program is no part: it sees to its own imports.
        if not name.startswith("cns_drake.") or name == "cns_drake.__main__":
            return None
        if name == _PRIVATE:
            spec = spec_from_file_location(name, _OURS)
        else:
            spec = PathFinder.find_spec(name, path, target)
        if spec and spec.origin and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(name, spec.origin)
        return spec


class _Loader(SourceFileLoader):
    def exec_module(self, module: ModuleType) -> None:
        vars(module)["__builtins__"] = {**vars(builtins), "__import__": _import}
        super().exec_module(module)


def _import(name: str, *scope_and_list: Any, **options: Any) -> Any:
    """Imports as the statement does, `evaluation` under its other name."""
    top, dot, rest = name.partition(".")
    if top != "evaluation":
        return builtins.__import__(name, *scope_and_list, **options)
    module = builtins.__import__(
        f"{_PRIVATE}{dot}{rest}", *scope_and_list, **options
    )
    # Without a list of names the statement binds the first part.
    return sys.modules[_PRIVATE] if module.__name__ == "cns_drake" else module
