"""The error that a user can mend."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError

_LONGEST = 2000


class InputError(Exception):
    """Input that cannot be used; the message is one line for the user.

    The message names the file (or argument), the field where there is one,
    and the fault. The command line prints it and exits with status 2.

    Attributes:
        exit_status: of a command that ends with it.

    Example:
        from evaluation import InputError, open_sequence

        try:
            open_sequence("nowhere")
        except InputError as error:
            print(error)
    """

    exit_status = 2

    def __init__(self, message: object):
        """Takes what to tell; see `one_line`."""
        super().__init__(one_line(message))


class FailedJobsError(InputError):
    """Some jobs of many could not be done; the message names them all.

    As everything else was done, the exit status is another one.
    """

    exit_status = 1


def one_line(message: object) -> str:
    """Returns a message as one printable line of bounded length.

    What it quotes of a file may hold anything: line breaks, and what steers
    a terminal.
    """
    text = str(message)
    shown = "".join(c if c.isprintable() else " " for c in text[:_LONGEST])
    return shown if len(text) <= _LONGEST else f"{shown} ..."


def describe_validation_error(source: object, error: ValidationError) -> str:
    """Returns one line for the first fault that pydantic found.

    Args:
        source: the file or object that was validated.
        error: a `pydantic.ValidationError`.
    """
    fault = error.errors()[0]
    field = ".".join(str(part) for part in fault["loc"]) or "(top level)"
    # pydantic puts this before what our own validators say.
    message = fault["msg"].removeprefix("Value error, ")
    more = error.error_count() - 1
    tail = f" (and {more} more)" if more else ""
    return f"{source}: {field}: {message}{tail}"
