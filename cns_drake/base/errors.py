"""Errors that a user can mend."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import BaseModel, ValidationError

_LONGEST = 2000


class InputError(Exception):
    """Input that cannot be used; the message is one line for the user.

    The message names the file (or argument), the field where there is one,
    and the fault. The command line prints it and exits with status 2.

    Attributes:
        exit_status: exit status of a command that ends with this error.

    Example:
        from evaluation import InputError, open_drive

        try:
            open_drive("nowhere")
        except InputError as error:
            print(error)
    """

    exit_status = 2

    def __init__(self, message: object):
        """Takes the message; see `one_line`."""
        super().__init__(one_line(message))


class FailedJobsError(InputError):
    """Some jobs of many could not be done; the message names them all.

    The exit status differs from InputError's, since all other jobs were done.
    """

    exit_status = 1


def one_line(message: object) -> str:
    """Returns a message as one printable line of bounded length.

    Text that the message quotes from a file may hold line breaks and control
    characters of a terminal.
    """
    text = str(message)
    shown = "".join(c if c.isprintable() else " " for c in text[:_LONGEST])
    return shown if len(text) <= _LONGEST else f"{shown} ..."


def describe_validation_error(
    source: object,
    error: ValidationError,
    model: type[BaseModel] | None = None,
) -> str:
    """Returns one line for the first fault that pydantic found.

    Args:
        source: the file or object that was validated.
        error: a `pydantic.ValidationError`.
        model: the pydantic model, used to suggest the names of misspelt fields.
    """
    fault = error.errors()[0]
    field = ".".join(str(part) for part in fault["loc"]) or "(top level)"
    # pydantic puts this before the message of one of our validators.
    message = fault["msg"].removeprefix("Value error, ")
    message += _advice(fault, model)
    more = error.error_count() - 1
    tail = f" (and {more} more)" if more else ""
    return f"{source}: {field}: {message}{tail}"


def _advice(fault: Mapping[str, Any], model: type[BaseModel] | None) -> str:
    """Returns advice on what to write instead; "" if none is obvious."""
    place, given = fault["loc"], fault["input"]
    if fault["type"] == "extra_forbidden" and model is not None and place:
        # Slow to import, and rarely needed.
        from cns_drake.base.field_names import nearest_field

        name = nearest_field(model, place)
        return f"; did you mean {name}?" if name else ""
    is_number = isinstance(given, int | float) and not isinstance(given, bool)
    if fault["type"] == "string_type" and is_number and place:
        # YAML takes 02 for the number 2.
        is_stage = place[-1] == "stage" and isinstance(given, int)
        text = f"{given:02d}" if is_stage else f"{given}"
        return f'; quote it: {place[-1]}: "{text}"'
    return ""
