"""Compilation of the few loops that NumPy cannot express."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
from typing import TypeVar

import numba

_Function = TypeVar("_Function", bound=Callable)


def compiled(function: _Function) -> _Function:
    """Compiles a function of arrays to machine code, on its first call.

    The code is kept between runs in the user's folder for such things, where
    uninstalling need not find it; where none can be written, each process
    compiles anew.
    """
    # Numba asks where to keep code while it decorates, and asks nobody else.
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = before or str(_cache_folder())
    try:
        return numba.njit(cache=True, nogil=True)(function)
    except RuntimeError:
        return numba.njit(nogil=True)(function)
    finally:
        numba.config.CACHE_DIR = before


def _cache_folder() -> Path:
    """Returns where the XDG base directory specification has it."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    folder = Path(base) if os.path.isabs(base) else Path("~/.cache")
    return Path(os.path.expanduser(folder)) / "cns-drake" / "compiled"
