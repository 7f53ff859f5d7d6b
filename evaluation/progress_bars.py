"""Progress bars on stderr, each one line however narrow the terminal."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
)
from rich.table import Column
from rich.text import Text


class _ShortenedColumn(TextColumn):
    """Text that gives way in a narrow terminal instead of wrapping."""

    def render(self, task: Task) -> Text:
        text = super().render(task)
        text.no_wrap = True
        text.overflow = "ellipsis"
        return text


def fixed_column() -> Column:
    """Returns the layout of what is never wrapped."""
    return Column(no_wrap=True)


@contextlib.contextmanager
def show_bars(
    *columns: ProgressColumn, console: Console | None = None
) -> Iterator[Progress]:
    """Shows progress bars, each one line.

    The field `note` of a task is shown behind its bar. Where there is no
    terminal, no bar is drawn: it would be drawn once, at the end, beside an
    error's line.

    Args:
        columns: shown between bar and note.
        console: where; stderr by default.
    """
    progress = Progress(
        TextColumn("{task.description}", table_column=fixed_column()),
        BarColumn(table_column=Column(max_width=40)),
        TextColumn("{task.percentage:>3.0f} %", table_column=fixed_column()),
        *columns,
        _ShortenedColumn("{task.fields[note]}", table_column=Column()),
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
    # Where there is no terminal, a line stays one line.
    progress.console.print(text, soft_wrap=True, markup=False, highlight=False)
