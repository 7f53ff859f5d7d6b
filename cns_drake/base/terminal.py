"""Output of the command line: results, progress, and one-line errors."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
import contextlib
from json import dumps
import logging
import math
import os
import shlex
import shutil
import sys
import textwrap
import traceback
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from cns_drake.base import interrupts
from cns_drake.base.errors import (
    TRACEBACK_OPTION,
    InputError,
    has_utf8,
    missing_library,
    one_line,
    printable,
    shows_traceback,
)
from cns_drake.base.process import collect_garbage_seldom
from cns_drake.base.progress import doing
from cns_drake.base.version import __version__

# All errors of usage are click's UsageError. New versions of Typer contain it
# under a private name; only this derived class is public.
_UsageError: Any = typer.BadParameter.__base__
# Help is as wide as the terminal.
WIDE_HELP = {"max_content_width": 1000}


def plain_app(**settings: Any) -> typer.Typer:
    """Returns a Typer program without commands, whose help is plain text.

    Rich would take units such as "[m, rad]" for markup, and its frames and
    columns leave little room for words on a narrow terminal.
    """
    return typer.Typer(
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings=WIDE_HELP,
        **settings,
    )


def make_program(
    name: str,
    summary: str,
    epilog: str,
    renamed: Mapping[str, str] | None = None,
    groups: Mapping[str, Sequence[str]] | None = None,
) -> typer.Typer:
    """Returns an empty command-line program, to which commands are added.

    The program has the option `--version` and the options for shell completion.
    The program shows its help when called without arguments.

    Args:
        name: name of the program, as it is typed.
        summary: text at the beginning of the program's help.
        epilog: text at the end of the program's help.
        renamed: name of a former command -> the command that replaces it, such
            as `simulate`, or `cns-eval pr --scores` if the command belongs to
            another program. Calling a former command is an error whose message
            names the new command.
        groups: heading -> commands that the help lists under it; by default
            there is a single heading for all commands.
    """

    class Program(TyperGroup):
        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            if renamed is not None and cmd_name in renamed:
                new = renamed[cmd_name]
                if not new.startswith("cns-"):
                    new = f"{name} {new}"
                # Typer adds a similar command to errors of usage.
                raise InputError(f"'{name} {cmd_name}' is now '{new}'")
            return super().get_command(ctx, cmd_name)

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            if groups is None:
                super().format_commands(ctx, formatter)
            widest = max(map(len, self.commands))
            for heading, names in (groups or {}).items():
                with formatter.section(heading):
                    formatter.write_dl(
                        [
                            (
                                f"{one:<{widest}}",
                                self.commands[one].get_short_help_str(500),
                            )
                            for one in names
                        ]
                    )

    app = plain_app(cls=Program, help=summary, epilog=epilog)

    @app.callback(invoke_without_command=True)
    def start(
        context: typer.Context,
        version: Annotated[
            bool, typer.Option("--version", help="Show the version and exit.")
        ] = False,
        _traceback: Annotated[
            bool,
            typer.Option(
                TRACEBACK_OPTION,
                help="With any command: show where an error comes from.",
            ),
        ] = False,
    ) -> None:
        if version:
            print(name, __version__)
            raise typer.Exit
        if context.invoked_subcommand is None:
            print(context.get_help())

    return app


def example(*lines: str) -> str:
    """Returns text for the end of a command's help: an example to type."""
    # What follows \b is not wrapped.
    return "\n  ".join(("\b\nExample:", *lines))


def run(
    app: typer.Typer,
    program: str,
    display: contextlib.AbstractContextManager[None],
) -> NoReturn:
    """Runs the command line of a program, and ends the process.

    The exit status is 0 on success, 1 if jobs failed, and 130 after an
    interrupt or SIGTERM; open files are closed first. For bad usage or input,
    unusable files, lack of memory and missing system libraries, the exit status
    is 2. In all these cases of failure, one line on stderr names the fault. A
    traceback is shown only with `--traceback`.

    Args:
        app: the command line.
        program: name of the program, with which messages begin.
        display: shows what the program does while the display is open. The
            display is closed before the line that names a fault is written.
    """
    message: str | None = None
    collect_garbage_seldom()
    _open_standard_streams()
    if not has_utf8():
        # Drake would print a traceback of its own.
        logging.getLogger("drake").disabled = True
    try:
        interrupts.interrupt_on_termination()
        _check_arguments()
        # This option may stand anywhere.
        words = [word for word in sys.argv[1:] if word != TRACEBACK_OPTION]
        try:
            with display:
                doing("loading the program")
                status = app(words, prog_name=program, standalone_mode=False)
        except Exception:
            if shows_traceback():
                traceback.print_exc()
            raise
        status = status or 0
        if status == interrupts.INTERRUPTED:  # Typer has caught it already.
            message = "interrupted"
        sys.stdout.flush()
    except _UsageError as error:
        message, status = f"error: {error.format_message()}", 2
    except InputError as error:
        message, status = f"error: {error}", error.exit_status
    except (KeyboardInterrupt, typer.Abort):
        message, status = "interrupted", interrupts.INTERRUPTED
    except BrokenPipeError:
        # The reader of the results has closed the pipe.
        _forget_results()
        status = 0
    except MemoryError:
        message, status = "error: not enough memory for this input", 2
    except OSError as error:
        where = error.filename or "standard output"
        message = f"error: {where}: {error.strerror or error}"
        status = 2
        if error.filename is None:
            _forget_results()
    except RuntimeError as error:
        # `Path.resolve` has no error of its own for a link to itself.
        if not str(error).startswith("Symlink loop"):
            raise
        message, status = f"error: {error}", 2
    except ImportError as error:
        fault = missing_library(error)
        if fault is None:
            raise
        message, status = f"error: {fault}", 2
    except SystemExit as error:
        # Drake's C++ raises SystemExit when one of its own checks fails.
        status = error.code if isinstance(error.code, int) else 2
        # Typer takes a closed pipe for a failure.
        if isinstance(error.__context__, BrokenPipeError):
            status = 0
        if isinstance(error.code, str):
            message = f"error: {error.code}"
    except UnicodeError as error:
        message, status = f"error: a name that is no text ({error})", 2
    # The command has done its work; nothing is left to interrupt.
    interrupts.ignore_interrupts()
    if message is not None:
        note(f"{program}: {one_line(' '.join(message.split()))}")
    if status == interrupts.INTERRUPTED:
        interrupts.end_interrupted()
    raise SystemExit(status)


def _open_standard_streams() -> None:
    """Opens standard streams that a process lacks.

    Otherwise the next opened file would get the number of a missing stream, and
    receive the printed text.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            # stdout is opened for reading, so that a lost result is an error;
            # messages on stderr may be lost.
            writes = os.O_WRONLY if name == "stderr" else os.O_RDONLY
            opened = os.open(os.devnull, writes)
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
            if name != "stdin":
                setattr(sys, name, os.fdopen(number, "w", closefd=False))


def _check_arguments() -> None:
    """Refuses arguments that can be neither printed nor recorded."""
    for word in sys.argv[1:]:
        try:
            word.encode()
        except UnicodeEncodeError:
            text = os.fsencode(word).decode(errors="replace")
            raise InputError(f"{text}: not UTF-8 text") from None


def _forget_results() -> None:
    """Discards output that is still to be printed.

    Python flushes once more at its end, which must not fail again.
    """
    # In a test the stream is no file.
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def check_finite(values: Mapping[str, object]) -> None:
    """Raises an error if an option's value is not a finite number.

    Typer lets NaN pass any bound.

    Args:
        values: name of an option's parameter -> value, or tuple of values.

    Raises:
        InputError: a value is infinite or NaN; the message names the option.
    """
    for name, value in values.items():
        for one in value if isinstance(value, tuple) else (value,):
            if isinstance(one, float) and not math.isfinite(one):
                option = name.replace("_", "-")
                raise InputError(f"--{option}: {one} is not a finite number")


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


def next_command(*words: object) -> None:
    """Prints the command that usually comes next, on stderr."""
    note(f"next: {shlex.join(map(str, words))}")


def print_json(values: dict) -> None:
    """Prints a result as one JSON object."""
    print(dumps(values, indent=2, allow_nan=False))


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
    """Prints a result as JSON, or in a form for people: rows or text."""
    if json:
        print_json(dict(values))
    elif isinstance(rows, str):
        print(rows)
    else:
        print_rows(rows)


def number(value: float | None) -> str:
    """Returns a number as text with four decimals.

    None and NaN become "undefined".
    """
    if value is None or math.isnan(value):
        return "undefined"
    return f"{value:.4f}"
