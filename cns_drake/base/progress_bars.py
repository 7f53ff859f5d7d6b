"""Progress bars on stderr; each takes one line in any terminal."""

from collections.abc import Callable, Iterator
import contextlib
import time

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column

from cns_drake.base.progress import LINE_INTERVAL


def fixed_column() -> Column:
    """Returns a column of text that is never wrapped."""
    return Column(no_wrap=True)


@contextlib.contextmanager
def show_bars(
    *columns: ProgressColumn, console: Console | None = None
) -> Iterator[Progress]:
    """Shows progress bars, each one line.

    The field `note` of a task is shown behind its bar. Without a terminal no
    bar is drawn: it would appear only once, at the end, beside an error's line.

    Args:
        columns: shown between bar and note.
    """
    progress = Progress(
        TextColumn("{task.description}", table_column=fixed_column()),
        BarColumn(table_column=Column(max_width=40)),
        TextColumn("{task.percentage:>3.0f} %", table_column=fixed_column()),
        *columns,
        # In a narrow terminal it is shortened instead of wrapped.
        TextColumn(
            "{task.fields[note]}",
            table_column=Column(no_wrap=True, overflow="ellipsis"),
        ),
        console=console or Console(stderr=True),
        refresh_per_second=2,
    )
    if progress.console.is_terminal:
        with progress:
            yield progress
    else:
        yield progress


def print_note(progress: Progress, text: str) -> None:
    """Prints a line above the progress bars."""
    # Without a terminal a line is not wrapped.
    progress.console.print(text, soft_wrap=True, markup=False, highlight=False)


def show_progress(
    console: Console | None = None,
) -> contextlib.AbstractContextManager[Progress]:
    """Shows progress bars, each one line, with elapsed and remaining time.

    See `show_bars`; without a terminal see `count_progress`.
    """
    return show_bars(
        TimeElapsedColumn(table_column=fixed_column()),
        TextColumn("left", table_column=fixed_column()),
        TimeRemainingColumn(table_column=fixed_column()),
        console=console,
    )


def count_progress(
    progress: Progress, task: TaskID, unit: str = "frames"
) -> Callable[[int, int], None]:
    """Returns a callback that shows how many frames of how many are done.

    On a terminal the bar moves; elsewhere a line is printed every few seconds.
    """
    console = progress.console
    interval = 0.5 if console.is_terminal else LINE_INTERVAL
    shown = 0.0
    # The time left follows neither from loading nor from an earlier run.
    first: tuple[float, int] | None = None

    def on_frame(done: int, total: int) -> None:
        nonlocal shown, first
        now = time.monotonic()
        if first is None:
            first, shown = (now, done), now
        is_early = done < total and now - shown < interval
        if is_early or progress.tasks[task].finished:
            return
        shown = now
        elapsed, new = now - first[0], done - first[1]
        progress.update(task, completed=done, total=total, note="")
        if not console.is_terminal:
            name = progress.tasks[task].description
            left = elapsed * (total - done) / max(new, 1)
            counted = f"{name}: {done}/{total} {unit}"
            print_note(progress, f"{counted}, {left:.0f} s left")

    return on_frame
