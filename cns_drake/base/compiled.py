"""Compilation of the few loops that NumPy cannot express."""

from collections.abc import Callable
import contextlib
import fcntl
import functools
import hashlib
from pathlib import Path
from typing import TypeVar

import numba

from cns_drake.base.files import cache_folder

_Function = TypeVar("_Function", bound=Callable)


def compiled(function: _Function) -> _Function:
    """Compiles a function of arrays to machine code, on its first call.

    The machine code is kept between runs in the user's cache folder. If that
    folder cannot be written, each process compiles anew. Numba notices a change
    only in the file of the function itself. A compiled function may therefore
    call compiled functions of its own folder and no others: a change in that
    folder recompiles all of them. One of several processes side by side
    compiles a function, and the others wait for it.

    Write arrays number by number. Where an array is assigned to a part of
    another one, numba also compiles a message about shapes, which takes
    seconds.
    """
    # Numba reads the cache folder while it decorates, and only from here.
    before = numba.config.CACHE_DIR
    own_folder = Path(function.__code__.co_filename).parent
    kept = Path(before or cache_folder() / "compiled") / _state_of(own_folder)
    numba.config.CACHE_DIR = str(kept)
    # Nothing calls these functions as those of C.
    options = {"nogil": True, "no_cfunc_wrapper": True}
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
        name = f"{function.__module__}.{function.__qualname__}.lock"
        dispatcher.compile = _for_all(dispatcher.compile, kept / name)
        return dispatcher
    except RuntimeError:
        return numba.njit(**options)(function)
    finally:
        numba.config.CACHE_DIR = before


def _for_all(
    compile_for: Callable[[tuple], object], file: Path
) -> Callable[[tuple], object]:
    """Returns a function that compiles what others need not compile again.

    That is, processes side by side, and calls with a number that is written
    out: numba would compile for that one number.
    """

    def compile_once(types: tuple) -> object:
        with contextlib.ExitStack() as stack:
            # Such a lock binds processes and not threads, which numba lets
            # compile one by one: theirs could wait for each other. It is not
            # forked. Where there is none, each process compiles.
            with contextlib.suppress(OSError):
                file.parent.mkdir(parents=True, exist_ok=True)
                stream = stack.enter_context(file.open("a"))
                fcntl.lockf(stream, fcntl.LOCK_EX)
            return compile_for(tuple(map(numba.types.unliteral, types)))

    return compile_once


@functools.cache
def start_compiler() -> None:
    """Makes Numba load its modules now instead of on the first call."""
    numba.njit(lambda: None)()


@functools.cache
def _state_of(folder: Path) -> str:
    """Returns a short text that changes when a module in a folder does."""
    files = sorted(folder.glob("*.py"))
    stamps = [(f.name, f.stat().st_size, f.stat().st_mtime_ns) for f in files]
    return hashlib.sha256(repr(stamps).encode()).hexdigest()[:16]
