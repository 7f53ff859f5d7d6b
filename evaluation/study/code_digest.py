"""Which version of the program made a result."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

# What shows results, or has them made, and makes none itself: measurements
# stay valid when it changes.
_SHOWING = (
    "command_line",
    "jobs",
    "report",
    "study/assembly.py",
    "study/benchmark.py",
    "study/figure_files.py",
    "study/plan.py",
    "study/trend.py",
    "study/views.py",
    "support",
)


@functools.cache
def measuring_code() -> str:
    """Returns a digest of all code that measures."""
    return _digest(_SHOWING)


@functools.cache
def all_code() -> str:
    """Returns a digest of all code, that which draws included."""
    return _digest(())


def _digest(left_out: tuple[str, ...]) -> str:
    root = Path(__file__).parents[1]
    total = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        name = path.relative_to(root).as_posix()
        if not any(
            name == one or name.startswith(f"{one}/") for one in left_out
        ):
            total.update(f"{name}\n".encode())
            # Line ends may differ between the machines of a cluster.
            total.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return total.hexdigest()[:32]
