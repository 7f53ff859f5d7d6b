"""Command-line programs: their help, their run, and errors in one line."""

from collections.abc import Mapping, Sequence
import contextlib
import itertools
import logging
import os
import sys
import traceback
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from evaluation.base import interrupts
from evaluation.base.commands import Command
from evaluation.base.errors import (
    TRACEBACK_OPTION,
    InputError,
    did_you_mean,
    one_line,
    shows_traceback,
)
from evaluation.base.plugins import import_modules, plugin_fault
from evaluation.base.process import collect_garbage_seldom
from evaluation.base.progress import doing
from evaluation.base.system_libraries import has_utf8, missing_library
from evaluation.base.terminal import note
from evaluation.base.version import __version__

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
    commands: str | None = None,
    groups: Sequence[str] = (),
    gone: Mapping[str, str] | None = None,
) -> typer.Typer:
    """Returns a command-line program.

    The program has the option `--version` and the options for shell completion.
    The program shows its help when called without arguments.

    Args:
        name: name of the program, as it is typed.
        summary: text at the beginning of the program's help.
        epilog: text at the end of the program's help.
        commands: package whose modules are the program's commands: each has a
            function of the module's name, and the variable `GROUP`, which is
            the heading of the command in the help. `CONTEXT_SETTINGS`, if there
            are any, are settings of click.
        groups: the headings, in their order.
        gone: command, or command and option, of earlier versions -> what to use
            instead, for the error of whoever still gives it.
    """
    gone = gone or {}
    headings: dict[str, str] = {}

    def _check_not_gone(words: str) -> None:
        if words in gone:
            raise InputError(f"{words}: gone; use {gone[words]}")

    class Program(TyperGroup):
        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            command = super().get_command(ctx, cmd_name)
            if command is None:
                _check_not_gone(cmd_name)
                raise InputError(
                    f"unknown command '{cmd_name}'; there are: "
                    f"{', '.join(self.commands)}"
                    f"{did_you_mean(cmd_name, self.commands)}"
                )
            return command

        def invoke(self, ctx: Any) -> Any:
            try:
                return super().invoke(ctx)
            except _UsageError as error:
                option = getattr(error, "option_name", None)
                _check_not_gone(f"{ctx.invoked_subcommand} {option}")
                raise

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            widest = max(map(len, self.commands))
            for heading, names in itertools.groupby(
                self.commands, headings.get
            ):
                with formatter.section(heading or "Commands"):
                    formatter.write_dl(
                        [
                            (
                                f"{name:<{widest}}",
                                self.commands[name].get_short_help_str(500),
                            )
                            for name in names
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

    modules = {} if commands is None else import_modules(commands)
    for own_name, module in sorted(
        modules.items(), key=lambda one: groups.index(one[1].GROUP)
    ):
        # An underscore stands behind a keyword of Python.
        command = own_name.rstrip("_").replace("_", "-")
        headings[command] = module.GROUP
        settings = getattr(module, "CONTEXT_SETTINGS", None)
        add = app.command(command, cls=Command, context_settings=settings)
        add(getattr(module, own_name))
    return app


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
    was_interrupted = interrupts.interrupt_on_termination()
    try:
        _check_arguments()
        status = _run_commands(app, program, display)
        if status == interrupts.INTERRUPTED:  # Typer has caught it already.
            message = "interrupted"
        sys.stdout.flush()
    except BaseException as error:
        failure = _failure_of(error)
        if was_interrupted():
            # Libraries report some interrupts as faults of other kinds.
            failure = "interrupted", interrupts.INTERRUPTED
        if failure is None:
            raise
        message, status = failure
    # The command has done its work; nothing is left to interrupt.
    interrupts.ignore_interrupts()
    if message is not None:
        note(f"{program}: {one_line(' '.join(message.split()))}")
    if status == interrupts.INTERRUPTED:
        interrupts.end_interrupted()
    raise SystemExit(status)


def _run_commands(
    app: typer.Typer,
    program: str,
    display: contextlib.AbstractContextManager[None],
) -> int:
    """Runs the command line, and returns the exit status."""
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
    return status or 0


def _failure_of(error: BaseException) -> tuple[str | None, int] | None:
    """Returns message and exit status after an error of the command line.

    The message is None if nothing is to be printed. The result is None for a
    fault of this program.
    """
    if isinstance(error, _UsageError):
        # Only the suggested options that continue the given name are named, if
        # there are such options; the others are somewhat similar.
        usage: Any = error
        name = getattr(usage, "option_name", None)
        possible = getattr(usage, "possibilities", None) or ()
        if longer := [one for one in possible if name and one.startswith(name)]:
            usage.possibilities = longer
        # Typer shows pydantic's words for a value that an Enum lacks.
        message = usage.format_message().replace(": Value error, ", ": ")
        return f"error: {message}", 2
    if isinstance(error, InputError):
        return f"error: {error}", error.exit_status
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return "interrupted", interrupts.INTERRUPTED
    if isinstance(error, BrokenPipeError):
        # The reader of the results has closed the pipe.
        _forget_results()
        return None, 0
    if isinstance(error, MemoryError):
        return "error: not enough memory for this input", 2
    if isinstance(error, OSError):
        if error.filename is None:
            if fault := plugin_fault(error):
                return f"error: {fault}", 2
            _forget_results()
        where = error.filename or "standard output"
        return f"error: {where}: {error.strerror or error}", 2
    # `Path.resolve` has no error of its own for a link to itself.
    is_loop = str(error).startswith("Symlink loop")
    if isinstance(error, RuntimeError) and is_loop:
        return f"error: {error}", 2
    if isinstance(error, SystemExit) and not plugin_fault(error):
        # Drake's C++ raises SystemExit when one of its own checks fails.
        message = (
            f"error: {error.code}" if isinstance(error.code, str) else None
        )
        status = error.code if isinstance(error.code, int) else 2
        # Typer takes a closed pipe for a failure.
        is_closed = isinstance(error.__context__, BrokenPipeError)
        return message, 0 if is_closed else status
    if isinstance(error, UnicodeError):
        return f"error: a name that is no text ({error})", 2
    fault = plugin_fault(error)
    if fault is None and isinstance(error, ImportError):
        fault = missing_library(error)
    return None if fault is None else (f"error: {fault}", 2)


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

    Python flushes once more at its end, and this flush must not fail again.
    """
    # In a test the stream is no file.
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
