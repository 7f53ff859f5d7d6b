"""Which version of the program made a result."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

import evaluation

# What shows results, or has them made, and makes none itself: measurements
# stay valid when it changes.
_SHOWING = (
    "cli.py",
    "cluster.py",
    "console.py",
    "curve_figures.py",
    "drawing.py",
    "figures.py",
    "findings.py",
    "interrupts.py",
    "job_process.py",
    "job_progress.py",
    "jobs.py",
    "page.py",
    "page_data.py",
    "page_routes.py",
    "page_template",
    "paper",
    "point_rendering.py",
    "progress.py",
    "progress_bars.py",
    "report.py",
    "study/assembly.py",
    "study/figure_files.py",
    "study/plan.py",
    "study/views.py",
    "tables.py",
    "trend.py",
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
    root = Path(evaluation.__file__).parent
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
