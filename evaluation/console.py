"""How the command line talks: results, progress, and one-line errors."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import json
import math
import os
import sys
import time
from typing import Any

import typer

from evaluation.errors import InputError
from evaluation.interrupts import INTERRUPTED, interrupt_on_termination
from evaluation.progress import LINE_INTERVAL

# Typer brings click along, in new versions under a private name. The base
# class of all its usage errors is reached through the one that is public.
_USAGE_ERRORS = typer.BadParameter.__mro__[2]


def run(app: typer.Typer, program: str) -> int:
    """Runs a command line and returns its exit status.

    Args:
        app: the commands.
        program: the name under which errors are reported.

    Returns:
        0 on success; 2 on bad usage or input and 1 for jobs that failed,
        after one line on stderr;
        130 if the user interrupted, also by SIGTERM.
    """
    try:
        interrupt_on_termination()
        status = app(prog_name=program, standalone_mode=False)
        if status == INTERRUPTED:  # Typer has caught the interrupt itself.
            return _fail(program, "interrupted", status)
        sys.stdout.flush()
    except _USAGE_ERRORS as error:
        if not sys.argv[1:]:
            # Without arguments the help is shown; that says it all.
            return 2
        return _fail(program, error.format_message())
    except InputError as error:
        return _fail(program, str(error), error.exit_status)
    except (KeyboardInterrupt, typer.Abort):
        return _fail(program, "interrupted", INTERRUPTED)
    except BrokenPipeError:
        # Whoever read the results has seen enough of them. Python flushes
        # once more at its end, which must not fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except MemoryError:
        return _fail(program, "not enough memory for this input")
    except OSError as error:
        where = error.filename or "standard output"
        return _fail(program, f"{where}: {error.strerror or error}")
    return status if isinstance(status, int) else 0


def track(items: Iterable[Any], description: str, total: int) -> Iterable[Any]:
    """Shows progress on stderr: a bar, or lines where that is no terminal."""
    from rich.console import Console
    from rich.progress import track as rich_track

    console = Console(stderr=True)
    if not console.is_terminal:
        return _track_by_lines(items, description, total)
    return rich_track(
        items,
        description=description,
        total=total,
        console=console,
        transient=True,
    )


def _track_by_lines(items, description: str, total: int) -> Iterator[Any]:
    """Says every few seconds how many of the items are done."""
    said = time.monotonic()
    for done, item in enumerate(items):
        if time.monotonic() - said >= LINE_INTERVAL:
            note(f"{description}: {done} of {total}")
            said = time.monotonic()
        yield item


def note(message: str) -> None:
    """Tells the user something that is no result."""
    print(message, file=sys.stderr)


def print_json(values: dict) -> None:
    """Prints a result as one JSON object."""
    print(json.dumps(values, indent=2, allow_nan=False))


def print_rows(rows: Iterable[tuple[str, str]]) -> None:
    """Prints a result as lines of a name and a value."""
    rows = list(rows)
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"{name:<{width}}  {value}")


def number(value: float | None) -> str:
    """Returns a ratio with four decimals, as the paper prints them."""
    if value is None or math.isnan(value):
        return "undefined"
    return f"{value:.4f}"


def _fail(program: str, message: str, status: int = 2) -> int:
    line = " ".join(message.split())
    print(f"{program}: error: {line}", file=sys.stderr)
    return status
