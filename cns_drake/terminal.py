"""What the commands have in common: errors, signals and progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import os
import sys
import time

from rich.console import Console
from rich.progress import (
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
import typer

from cns_drake.errors import InputError
from cns_drake.frame_clock import FRAME_PERIOD
from evaluation.interrupts import (
    INTERRUPTED,
    end_interrupted,
    ignore_interrupts,
    interrupt_on_termination,
)
from evaluation.progress import LINE_INTERVAL
from evaluation.progress_bars import fixed_column, print_note, show_bars

# What typer raises for bad usage; which module defines it depends on typer's
# version.
_UsageError = typer.BadParameter.__mro__[1]

_BAD_INPUT = 2


def run(app: typer.Typer) -> None:
    """Runs a command line; bad usage and bad input never show a traceback.

    Exits with 2 and one line on stderr for an InputError, for words that the
    command line does not take, for files that cannot be used and for lack of
    memory; with 1 for jobs that failed; with 130 when interrupted (also by
    SIGTERM, so that recordings are closed).
    """
    message, status = None, 0
    try:
        interrupt_on_termination()
        status = app(standalone_mode=False)
        if status == INTERRUPTED:  # Typer has caught the interrupt itself.
            message = "interrupted"
        sys.stdout.flush()
    except InputError as error:
        message, status = f"error: {error}", error.exit_status
    except _UsageError as error:
        message, status = f"error: {error.format_message()}", _BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        message, status = "interrupted", INTERRUPTED
    except BrokenPipeError:
        # Whoever read the results has seen enough of them. Python flushes
        # once more at its end, which must not fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except MemoryError:
        message, status = "error: not enough memory", _BAD_INPUT
    except OSError as error:
        where = error.filename or "standard output"
        message = f"error: {where}: {error.strerror or error}"
        status = _BAD_INPUT
    # What the command does is done; nothing is left to interrupt.
    ignore_interrupts()
    if message is not None:
        print(message, file=sys.stderr)
    if status == INTERRUPTED:
        end_interrupted()
    raise SystemExit(status)


@contextlib.contextmanager
def show_progress(console: Console | None = None) -> Iterator[Progress]:
    """Shows progress bars, each one line, with elapsed and remaining time.

    See `show_bars`; where there is no terminal, see `count_progress`.

    Args:
        console: where; stderr by default.
    """
    with show_bars(
        TimeElapsedColumn(table_column=fixed_column()),
        TextColumn("left", table_column=fixed_column()),
        TimeRemainingColumn(table_column=fixed_column()),
        console=console,
    ) as progress:
        yield progress


def frame_progress(progress: Progress, task) -> Callable[[int, int], None]:
    """Returns a callback that shows the frames of a simulation.

    It is `count_progress` with simulated time and real-time factor.
    """

    def note(done: int, new: int, elapsed: float) -> str:
        factor = new * FRAME_PERIOD / max(elapsed, 1e-9)
        simulated = done * FRAME_PERIOD
        return f"{simulated:.1f} s simulated, {factor:.1f} x real time"

    return count_progress(progress, task, note)


def count_progress(
    progress: Progress,
    task,
    note: Callable[[int, int, float], str] = lambda done, new, elapsed: "",
    unit: str = "frames",
) -> Callable[[int, int], None]:
    """Returns a callback that shows how many frames of how many are done.

    On a terminal the bar moves; elsewhere a line tells the same every few
    seconds.

    Args:
        progress: where the task is shown.
        task: its id.
        note: of the frames done, how many of them are new since the first
            call, and the time [s] they took -> what to add.
        unit: what is counted.
    """
    console = progress.console
    interval = 0.5 if console.is_terminal else LINE_INTERVAL
    shown = 0.0
    # Neither loading nor what an earlier run had done tells the speed.
    first: tuple[float, int] | None = None

    def on_frame(done: int, total: int) -> None:
        nonlocal shown, first
        now = time.monotonic()
        if first is None:
            first, shown = (now, done), now
        if done < total and now - shown < interval:
            return
        shown = now
        elapsed, new = now - first[0], done - first[1]
        text = note(done, new, elapsed)
        progress.update(task, completed=done, total=total, note=text)
        if not console.is_terminal:
            name = progress.tasks[task].description
            left = elapsed * (total - done) / max(new, 1)
            parts = [f"{name}: {done}/{total} {unit}", text]
            parts.append(f"{left:.0f} s left")
            print_note(progress, ", ".join(part for part in parts if part))

    return on_frame
