"""What the commands have in common: errors, signals and progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import signal
import sys
import time

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
import typer

from cns_drake.errors import InputError
from cns_drake.frame_clock import FRAME_PERIOD

# What typer raises for bad usage; which module defines it depends on typer's
# version.
_UsageError = typer.BadParameter.__mro__[1]

_BAD_INPUT = 2
_INTERRUPTED = 130
# Where there is no terminal, a line of progress this often [s].
_LINE_INTERVAL = 5.0


def run(app: typer.Typer) -> None:
    """Runs a command line; bad usage and bad input never show a traceback.

    Exits with 2 and one line on stderr for an InputError and for words that
    the command line does not take, with 130 when interrupted (also by
    SIGTERM, so that recordings are closed).
    """
    interrupt_on_termination()
    try:
        raise SystemExit(app(standalone_mode=False))
    except InputError as error:
        message, status = f"error: {error}", _BAD_INPUT
    except _UsageError as error:
        message, status = f"error: {error.format_message()}", _BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        message, status = "interrupted", _INTERRUPTED
    print(message, file=sys.stderr)
    raise SystemExit(status)


def interrupt_on_termination() -> None:
    """Makes SIGTERM an exception, so that open recordings are closed."""

    def interrupt(signal_number, frame):
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)


@contextlib.contextmanager
def show_progress() -> Iterator[Progress]:
    """Shows progress bars on stderr, with elapsed and remaining time.

    The field `note` of a task is shown behind its bar.
    """
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
        console=Console(stderr=True),
        refresh_per_second=2,
    )
    with progress:
        yield progress


def frame_progress(progress: Progress, task) -> Callable[[int, int], None]:
    """Returns a callback that shows the frames of a simulation.

    As `count_progress`, with simulated time and real-time factor behind.
    """

    def note(done: int, elapsed: float) -> str:
        simulated = done * FRAME_PERIOD
        factor = simulated / max(elapsed, 1e-9)
        return f"{simulated:.1f} s simulated, {factor:.1f} x real time"

    return count_progress(progress, task, note)


def count_progress(
    progress: Progress,
    task,
    note: Callable[[int, float], str] = lambda done, elapsed: "",
) -> Callable[[int, int], None]:
    """Returns a callback that shows how many frames of how many are done.

    On a terminal the bar moves; elsewhere a line tells the same every few
    seconds.

    Args:
        progress: where the task is shown.
        task: its id.
        note: of the frames done and the time [s] they took -> what to add.
    """
    console = progress.console
    interval = 0.5 if console.is_terminal else _LINE_INTERVAL
    start = shown = time.monotonic()

    def on_frame(done: int, total: int) -> None:
        nonlocal shown
        now = time.monotonic()
        if done < total and now - shown < interval:
            return
        shown = now
        elapsed = now - start
        text = note(done, elapsed)
        progress.update(task, completed=done, total=total, note=text)
        if not console.is_terminal:
            name = progress.tasks[task].description
            left = elapsed * (total - done) / done
            parts = [f"{name}: {done}/{total} frames", text]
            parts.append(f"{left:.0f} s left")
            console.print(", ".join(part for part in parts if part))

    return on_frame
