"""Output on the terminal: results on stdout, notes for the user on stderr."""

from collections.abc import Iterable, Iterator, Mapping
import contextlib
from json import dumps
import math
from pathlib import Path
import shlex
import shutil
import sys
import textwrap

from evaluation.base.errors import printable


def note(message: str) -> None:
    """Prints a note for the user on stderr.

    On a terminal, long lines are broken at spaces.
    """
    lines = printable(message).split("\n")
    if sys.stderr.isatty():
        wrap = textwrap.TextWrapper(
            shutil.get_terminal_size().columns,
            break_long_words=False,
            break_on_hyphens=False,
        )
        lines = [wrap.fill(line) for line in lines]
    print("\n".join(lines), file=sys.stderr)


@contextlib.contextmanager
def resumable() -> Iterator[None]:
    """Prints a note if the block is interrupted: the work can be resumed.

    The note says that finished work is kept, and that the same command
    continues the work.

    Raises:
        KeyboardInterrupt: if the block is interrupted.
    """
    try:
        yield
    except KeyboardInterrupt as error:
        told = "Finished work is kept. To continue, run the same command again."
        # Work that goes on may be a part of other such work.
        if told not in error.args:
            note(told)
        raise KeyboardInterrupt(told) from None


def next_command(program: str, *words: object) -> None:
    """Prints the command that usually comes next, on stderr.

    It works as printed in the shell that runs this program.

    Args:
        program: `cns-drake` or `cns-eval`.
        words: the words of the command.
    """
    beside = Path(sys.argv[0]).with_name(program)
    found = shutil.which(program)
    if beside.is_file() and not (found and beside.samefile(found)):
        program = str(beside)
    note(f"next: {shlex.join(map(str, (program, *words)))}")


def next_page(page: Path | str) -> None:
    """Prints that a page is what to open next, on stderr."""
    note(f"next: open {page} in a browser")


def print_rows(rows: Iterable[tuple[str, str]]) -> None:
    """Prints a result as lines, each with a name and a value."""
    rows = list(rows)
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(printable(f"{name:<{width}}  {value}"))


def show(
    values: Mapping,
    rows: Iterable[tuple[str, str]] | str,
    *,
    json: bool,
) -> None:
    """Prints a result as a JSON object, or for people: as rows or text."""
    if json:
        print(dumps(dict(values), indent=2, allow_nan=False))
    elif isinstance(rows, str):
        print(rows)
    else:
        print_rows(rows)


def number_text(value: float | None) -> str:
    """Returns a number as text with four decimals.

    None and NaN become "undefined".
    """
    if value is None or math.isnan(value):
        return "undefined"
    return f"{value:.4f}"
