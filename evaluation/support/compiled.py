"""Compilation of the few loops that NumPy cannot express."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numba

_Function = TypeVar("_Function", bound=Callable)


def compiled(function: _Function) -> _Function:
    """Compiles a function of arrays to machine code, on its first call.

    The code is kept on disk between runs where a folder for it can be
    written; an installation without one compiles in each process instead.
    """
    # What is kept names its module, but is found by its file: it is of no use
    # where this package goes by another name (see `cns_drake.isolation`).
    is_kept = "._" not in function.__module__
    try:
        return numba.njit(cache=is_kept, nogil=True)(function)
    except RuntimeError:
        return numba.njit(nogil=True)(function)
