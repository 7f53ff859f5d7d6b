"""Errors that a user can fix."""

from __future__ import annotations

import contextlib
import difflib
import sys
from types import NoneType
import typing
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import (
        Collection,
        Iterable,
        Iterator,
        Mapping,
        Sequence,
    )

    from pydantic import BaseModel, ValidationError

_Model = typing.TypeVar("_Model", bound="BaseModel")
TRACEBACK_OPTION = "--traceback"
# Longest message [characters].
_LONGEST = 2000


class InputError(Exception):
    """An error in the user's input, with a message of one line.

    The message names the file (or argument), the field if there is one, and the
    fault. The command line prints the message and exits with status 2.

    Attributes:
        exit_status: exit status of a command that ends with this error.
        field: name of the outermost field at fault, if it is known; or "".

    Example:
        from evaluation import InputError, open_drive

        try:
            open_drive("nowhere")
        except InputError as error:
            print(error)
    """

    exit_status = 2

    def __init__(self, message: object, field: str = ""):
        """Makes an error with a message of one line.

        Args:
            message: the message; line breaks and control characters are
                replaced.
            field: see `InputError`.
        """
        super().__init__(one_line(message))
        self.field = field


class FailedJobsError(InputError):
    """Some of many jobs failed; the message names each of them.

    The exit status differs from InputError's, since all other jobs were done.
    """

    exit_status = 1


@contextlib.contextmanager
def value_errors(place: object) -> Iterator[None]:
    """Turns a ValueError of the `with` block into an InputError at a place.

    The message then begins with the place: a file or field, for example.

    Raises:
        InputError: if the block raises ValueError.
    """
    try:
        yield
    except ValueError as error:
        raise InputError(f"{place}: {error}") from error


@contextlib.contextmanager
def errors_at(
    place: object, instead_of: str = "", field: str = ""
) -> Iterator[None]:
    """Puts a place before the message of an InputError in a `with` block.

    Args:
        place: file, field or other place, in words.
        instead_of: text that is removed from the beginning of the message
            before the place is added.
        field: the field at fault, if the error knows none.

    Raises:
        InputError: if the block raises InputError.
    """
    try:
        yield
    except InputError as error:
        fault = str(error).removeprefix(instead_of)
        raise InputError(f"{place}: {fault}", error.field or field) from error


@contextlib.contextmanager
def errors_at_option(option: str, argument: str) -> Iterator[None]:
    """Names the option of a command where an InputError names an argument.

    A message of the `with` block that begins with the argument, such as
    `name: missing`, then begins with the option, as in `--method: missing`.
    All other messages stay as they are.

    Args:
        option: the option, with its dashes.
        argument: name of the argument that gets the option's value.

    Raises:
        InputError: if the block raises InputError.
    """
    try:
        yield
    except InputError as error:
        place, colon, fault = str(error).partition(": ")
        if not colon or place != argument:
            raise
        raise InputError(f"{option}: {fault}") from error


def one_line(message: object) -> str:
    """Returns a message as one printable line of bounded length.

    Line breaks and control characters, which can come from a quoted file, are
    replaced.
    """
    text = str(message)
    shown = printable(text[:_LONGEST]).replace("\n", " ")
    return shown if len(text) <= _LONGEST else f"{shown} ..."


def printable(text: str) -> str:
    """Returns a text without characters that control a terminal."""
    return "".join(c if c.isprintable() or c == "\n" else " " for c in text)


def validated(model: type[_Model], values: object, source: object) -> _Model:
    """Returns the values of a file or argument as a validated model.

    Args:
        model: class of the model.
        values: the values, usually a mapping field -> value.
        source: name of the file or argument, with which an error message
            begins.

    Raises:
        InputError: a field is missing, unknown or not usable.
    """
    from pydantic import ValidationError

    try:
        return model.model_validate(values)
    except ValidationError as error:
        fault = describe_validation_error(source, error, model)
        place = min(error.errors(), key=_urgency)["loc"]
        raise InputError(fault, str(place[0]) if place else "") from None


def describe_validation_error(
    source: object,
    error: ValidationError,
    model: type[BaseModel] | None = None,
) -> str:
    """Returns one line about the most important fault that pydantic found.

    Unknown fields are reported first, and missing fields last: an unknown field
    may be a misspelt missing field.

    Args:
        source: name of the file or argument, with which the line begins.
        error: what pydantic raised.
        model: the model that was validated. If given, the line suggests a name
            for an unknown field, or lists the known fields.
    """
    fault = min(error.errors(), key=_urgency)
    # pydantic puts this before the message of one of our validators.
    message = fault["msg"].removeprefix("Value error, ")
    if fault["type"] in _WORDS:
        message = _WORDS[fault["type"]].format_map(fault.get("ctx", {}))
    message += _advice(fault, model)
    field = ".".join(str(part) for part in fault["loc"])
    if not field and fault["type"] == "value_error":
        # A validator of the whole model, whose message names the fields.
        return f"{source}: {message}"
    return f"{source}: {field or '(top level)'}: {message}"


# Faults for which pydantic has words of Python -> words of YAML.
_WORDS = {
    "dict_type": "not a mapping",
    "int_type": "not a whole number",
    "list_type": "not a list",
    "model_type": "not a mapping",
    "string_type": "not a text",
    "too_short": "at least {min_length} needed",
    "tuple_type": "not a list",
}


def _urgency(fault: Mapping[str, Any]) -> int:
    if fault["type"] == "extra_forbidden":
        return 0
    # Wrong values of a list are missing from it, too.
    if fault["type"] == "too_short":
        return 3
    return 2 if fault["type"] == "missing" or fault["input"] is None else 1


def _advice(fault: Mapping[str, Any], model: type[BaseModel] | None) -> str:
    """Returns advice on how to mend a fault; "" if no remedy is obvious."""
    place, given = fault["loc"], fault["input"]
    if fault["type"] == "extra_forbidden" and model is not None and place:
        names = list(dict.fromkeys(_fields_at(model, place[:-1])))
        if names:
            near = did_you_mean(place[-1], sorted(names))
            return near or f"; there are: {', '.join(names)}"
    is_number = isinstance(given, int | float) and not isinstance(given, bool)
    if fault["type"] == "string_type" and is_number and place:
        return f'; quote it: {place[-1]}: "{given}"'
    return ""


def check_type(argument: str, value: object, *types: type) -> None:
    """Checks the type of an argument.

    Args:
        argument: name of the argument, with which the message begins.
        value: its value.
        types: the types that it may have.

    Raises:
        TypeError: it has another type.
    """
    if not isinstance(value, types):
        names = [one.__name__ for one in types if one is not NoneType]
        given = " ".join(repr(value).split())
        raise TypeError(f"{argument}: {given} is no {' or '.join(names)}")


def no_such(noun: str, given: object, names: Collection[str]) -> str:
    """Returns the fault of an unknown name: "no <noun> <given> (there are: …)".

    Args:
        noun: what the names are of, such as "method".
        given: the unknown name.
        names: the known names. A similar one is suggested.
    """
    there = ", ".join(names) or "none"
    return (
        f"no {noun} {given!r} (there are: {there}){did_you_mean(given, names)}"
    )


def did_you_mean(given: object, names: Iterable[str]) -> str:
    """Returns a suggestion for a misspelt name: "; did you mean <name>?".

    Args:
        given: the misspelt name.
        names: the known names. If no known name is similar, in letters of any
            case, the result is "".
    """
    known = {name.lower(): name for name in names}
    close = difflib.get_close_matches(str(given).lower(), list(known), n=1)
    return f"; did you mean {known[close[0]]}?" if close else ""


def _fields_at(kind: Any, place: Sequence[str | int]) -> Iterator[str]:
    """Yields the fields that a value of the type `kind` can have at `place`."""
    if hasattr(kind, "model_fields"):
        for name, field in kind.model_fields.items():
            if not place:
                yield field.alias or name
            elif place[0] in (name, field.alias):
                yield from _fields_at(field.annotation, place[1:])
        # The place has the name of one of the models to choose from.
        if place and place[0] == kind.__name__:
            yield from _fields_at(kind, place[1:])
    elif typing.get_origin(kind) not in (list, dict, tuple):
        for inner in typing.get_args(kind):
            yield from _fields_at(inner, place)
    elif place:
        for inner in typing.get_args(kind):
            yield from _fields_at(inner, place[1:])


def shows_traceback() -> bool:
    """Returns whether `--traceback` was given on the command line.

    The process of a job has the arguments of its parent process, so the result
    is the same in both.
    """
    return TRACEBACK_OPTION in sys.argv
