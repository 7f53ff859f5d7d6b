"""Garbage collection, and work that is better off without it."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import gc


@contextlib.contextmanager
def uncollected() -> Iterator[None]:
    """Has Python look for no garbage meanwhile.

    A process that builds up millions of objects, and drops few, looks through
    all of them again and again. What no reference cycle holds is freed as ever.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
