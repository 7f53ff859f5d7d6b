"""Compilation of the few loops that NumPy cannot express."""

from collections.abc import Callable, Iterator
import contextlib
import fcntl
import functools
import hashlib
import os
from pathlib import Path
import tempfile
from typing import TypeVar

import numba
from numba.core.caching import FunctionCache

from evaluation.base.budget import not_counted
from evaluation.base.caches import cache_folder, is_own, remove_unused
from evaluation.base.files import user_errors
from evaluation.base.interrupts import uninterrupted
from evaluation.base.progress import interlude

_Function = TypeVar("_Function", bound=Callable)
_Made = TypeVar("_Made")
# Number of digits of the hash that names a cache folder.
_HASH_DIGITS = 16


def compiled(function: _Function) -> _Function:
    """Compiles a function of arrays to machine code, on its first call.

    The machine code stays in the user's cache folder between runs, under a hash
    of the source code, so that all installations and releases with the same
    source code share the compiled function. If the cache folder cannot be
    written, each process compiles the function again. If several processes need
    the same function at once, one process compiles the function, and the others
    wait.

    A compiled function may call only compiled functions of its own folder,
    because changes in other folders go unnoticed. If any file in the folder
    changes, all functions of the folder are compiled again.

    In compiled functions, assign array elements one at a time. If an array is
    assigned to a slice of another, numba also compiles an error message about
    shapes, which takes seconds.
    """
    # No C code calls these functions.
    options = {"nogil": True, "no_cfunc_wrapper": True}
    with _our_settings():
        try:
            dispatcher = numba.njit(cache=True, **options)(function)
        except RuntimeError:
            # Numba raises this error if no locator finds a cache folder: here,
            # if `_ByContent.from_function` returns None.
            return numba.njit(**options)(function)
    lock = f"{function.__module__}.{function.__qualname__}.lock"
    dispatcher.compile = _compiling_once(
        dispatcher.compile,
        function,
        Path(dispatcher.stats.cache_path) / lock,
    )
    return dispatcher


@functools.cache
def compiled_callback(function: Callable) -> int:
    """Compiles a function that C code calls; returns its address.

    The function takes one address and returns nothing.
    It may call compiled functions. Its machine code is kept as that of
    `compiled`.
    """
    signature = numba.void(numba.intp)
    options = {"nopython": True}
    with (
        interlude(f"compiling {function.__name__}"),
        not_counted(),
        uninterrupted(),
        _our_settings(),
    ):
        try:
            made = _despite_damage(
                lambda: numba.cfunc(signature, cache=True, **options)(function),
                function,
            )
        except RuntimeError:  # See `compiled`.
            made = numba.cfunc(signature, **options)(function)
    _CALLBACKS.append(made)
    return int(made.address)


# The machine code lives as long as these.
_CALLBACKS: list[object] = []


@contextlib.contextmanager
def _our_settings() -> Iterator[None]:
    """Makes Numba compile what it decorates, and `_ByContent` find folders.

    Compiled functions call each other, so NUMBA_DISABLE_JIT cannot spare them.
    """
    # Numba reads the first while it decorates, and only from here.
    config = numba.config
    before = config.CACHE_LOCATOR_CLASSES, config.DISABLE_JIT
    config.CACHE_LOCATOR_CLASSES = f"{__name__}.{_ByContent.__name__}"
    config.DISABLE_JIT = 0
    try:
        yield
    finally:
        config.CACHE_LOCATOR_CLASSES, config.DISABLE_JIT = before


class _ByContent:
    """Cache folder of a function, named by the contents of its source folder.

    Numba's own locators name the cache folder by the path of the source. This
    class has the methods that Numba calls; see NUMBA_CACHE_LOCATOR_CLASSES in
    Numba's manual.

    Numba unpickles what it finds in the folder. Another user must therefore not
    be able to write there.
    """

    def __init__(self, function: Callable, folder: Path, root: Path) -> None:
        self._line = function.__code__.co_firstlineno
        # Numba names it where it warns that it cannot cache a function.
        self._py_file = function.__code__.co_filename
        self._content = _content_hash(folder)
        self._place = root / self._content

    @classmethod
    def from_function(
        cls, function: Callable, file: str
    ) -> "_ByContent | None":
        """Returns a function's locator; None if there is no safe folder."""
        # Numba's own setting may come from a file in the working directory,
        # which may belong to an unpacked recording.
        root = os.environ.get("NUMBA_CACHE_DIR", "")
        if not os.path.isabs(root):
            own = cache_folder()
            if own is None:
                return None
            root = str(own / "compiled")
        place = cls(function, Path(file).parent, Path(root))
        try:
            place.ensure_cache_path()
        except OSError:
            return None
        return place

    def ensure_cache_path(self) -> None:
        if not self._place.exists():
            remove_unused(self._place.parent, "[0-9a-f]" * _HASH_DIGITS)
        self._place.parent.mkdir(parents=True, exist_ok=True)
        self._place.mkdir(mode=0o700, exist_ok=True)
        if not is_own(self._place):
            raise PermissionError(f"{self._place}: others can write there")
        # This also marks the folder as used.
        tempfile.TemporaryFile(dir=self._place).close()

    def get_cache_path(self) -> str:
        return str(self._place)

    def get_source_stamp(self) -> str:
        return self._content

    def get_disambiguator(self) -> str:
        return str(self._line)


def _compiling_once(
    compile_for: Callable[[tuple], object], function: Callable, file: Path
) -> Callable[[tuple], object]:
    """Returns a function that compiles once for all processes.

    Processes that run side by side wait for the result of the first process.
    For a literal number among the arguments, the compiled function takes all
    numbers of the same type; otherwise numba would compile the function for
    that single number.

    Args:
        compile_for: function that compiles for types of arguments.
        function: the function in Python.
        file: file that is locked during the compilation.
    """

    def compile_once(types: tuple) -> object:
        with contextlib.ExitStack() as stack:
            stack.enter_context(interlude(f"compiling {function.__name__}"))
            # This lock excludes other processes but not other threads: numba
            # compiles one thread at a time already, and a second lock could
            # deadlock. A forked process does not inherit it. Without locks in
            # the file system, each process compiles.
            with contextlib.suppress(OSError):
                file.parent.mkdir(parents=True, exist_ok=True)
                stream = stack.enter_context(file.open("a"))
                fcntl.lockf(stream, fcntl.LOCK_EX)
            # LLVM crashes if an interrupt ends a function that it calls.
            with not_counted(), _our_settings(), uninterrupted():
                plain = tuple(map(numba.types.unliteral, types))
                return _despite_damage(lambda: compile_for(plain), function)

    return compile_once


def _despite_damage(
    compile_it: Callable[[], _Made], function: Callable
) -> _Made:
    """Compiles a function again if its files in the cache are damaged.

    Numba unpickles them, which can raise any error.
    """
    try:
        return compile_it()
    except RuntimeError:  # There is no cache: see `compiled`.
        raise
    except Exception:
        cache = FunctionCache(function)
        with user_errors(cache.cache_path):
            cache.flush()
        return compile_it()


@functools.cache
def start_compiler() -> None:
    """Makes Numba load its modules now instead of on the first call."""
    numba.njit(lambda: None)()


@functools.cache
def _content_hash(folder: Path) -> str:
    """Returns a short hash that changes when a module in the folder changes."""
    content = hashlib.sha256()
    for file in sorted(folder.glob("*.py")):
        content.update(repr((file.name, file.read_bytes())).encode())
    return content.hexdigest()[:_HASH_DIGITS]
