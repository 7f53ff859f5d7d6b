"""Progress bars on stderr, one line per bar at any terminal width."""

from collections.abc import Callable, Iterator
import contextlib
import datetime
import time

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
)
from rich.table import Column
from rich.text import Text

from cns_drake.base.progress import LINE_INTERVAL


def fixed_column() -> Column:
    """Returns a column of text that is never wrapped."""
    return Column(no_wrap=True)


@contextlib.contextmanager
def show_bars(
    *columns: ProgressColumn, console: Console | None = None
) -> Iterator[Progress]:
    """Shows progress bars while the `with` block runs, each on one line.

    The text in a task's field `note` is shown after its bar. Without a terminal
    no bar is drawn: Rich would print it only once, at the end, next to a
    possible error message.

    Args:
        columns: columns that are shown between bar and note.
        console: where the bars are shown; stderr by default.
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
    progress.console.print(
        text,
        # Without a terminal a line is not wrapped.
        soft_wrap=not progress.console.is_terminal,
        markup=False,
        highlight=False,
    )


def shown_times(elapsed: float, left: float | None) -> str:
    """Returns elapsed time and time left as text, both given in [s].

    The time left is omitted if it is None.
    """
    text = f"elapsed {_clock(elapsed)}"
    return text if left is None else f"{text}, about {_clock(left)} left"


def _clock(seconds: float) -> str:
    text = str(datetime.timedelta(seconds=round(seconds)))
    return text.removeprefix("0:").removeprefix("0")


class _Times(ProgressColumn):
    """A column with elapsed time and time left, the task's field `left`."""

    def render(self, task: Task) -> Text:
        return Text(shown_times(task.elapsed or 0.0, task.fields.get("left")))


def show_progress(
    console: Console | None = None,
) -> contextlib.AbstractContextManager[Progress]:
    """Shows progress bars, with elapsed and remaining time, in a `with` block.

    Each bar is one line. Without a terminal, no bar is drawn; in this case,
    `count_progress` prints lines.

    Args:
        console: where the bars are shown; stderr by default.

    Returns:
        A context manager whose value is the Rich `Progress` to which tasks are
        added, see `cns_drake.base.progress_bars.show_bars`.
    """
    return show_bars(_Times(table_column=fixed_column()), console=console)


def count_progress(
    progress: Progress, task: TaskID, unit: str = "frames", after: str = ""
) -> Callable[[int, int], None]:
    """Returns a callback `(done, total)` that shows the progress of a task.

    On a terminal the bar moves; elsewhere a line is printed every few seconds.

    Args:
        progress: the progress bars.
        task: the task, one of those of `progress`.
        unit: what `done` and `total` count.
        after: text that is shown when all is done, such as the work that
            follows.
    """
    console = progress.console
    interval = 0.5 if console.is_terminal else LINE_INTERVAL
    shown = 0.0
    # The estimate of the time left counts neither the time for loading nor
    # frames of an earlier run.
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
        is_measured = new > 0 and done < total
        left = elapsed * (total - done) / new if is_measured else None
        note = after if done >= total else ""
        progress.update(task, completed=done, total=total, note=note, left=left)
        if not console.is_terminal:
            name = progress.tasks[task].description
            times = shown_times(progress.tasks[task].elapsed or 0.0, left)
            counted = f"{name}: {done}/{total} {unit}, {times}"
            print_note(progress, "; ".join(filter(None, (counted, note))))

    return on_frame
