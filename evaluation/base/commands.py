"""Commands made from functions, with help from their docstrings."""

from collections.abc import Callable, Mapping
import functools
import inspect
import math
import re
import textwrap
from typing import Any

import typer
from typer.core import TyperCommand

from evaluation.base.errors import InputError


class Command(TyperCommand):
    """A command-line command whose help comes from its function's docstring.

    The section `Args` of the docstring contains the help of options and
    arguments. An option without an entry in this section keeps the help of its
    own declaration. The section `Example`, the last one, ends the help.
    """

    def __init__(
        self, *args: Any, help: str | None, params: list, **settings: Any
    ):
        """Copies each parameter's help from the docstring.

        With `python -OO` there are no docstrings, and no help.
        """
        text, _, lines = (help or "").partition("\n\nExample:\n")
        text, _, entries = text.partition("\n\nArgs:\n")
        helps = {}
        for entry in re.split(r"\n(?! )", textwrap.dedent(entries)):
            name, _, meaning = entry.partition(": ")
            helps[name] = " ".join(meaning.split())
        for param in params:
            param.help = helps.get(param.name, param.help)
            if param.param_type_name == "argument":
                # Since 0.29, Typer shows Python's type behind the name.
                param.display_type_rich = lambda ctx: None
        if lines:
            settings["epilog"] = example(*textwrap.dedent(lines).splitlines())
        super().__init__(*args, help=text, params=params, **settings)

    def invoke(self, ctx: Any) -> Any:
        """Runs the command, after checking that its numbers are finite."""
        # Only options with a lower limit are checked here; others are checked
        # where they are used. Before typer 0.28, the limits belonged to the
        # option's type.
        check_finite(
            {
                str(param.name): ctx.params[str(param.name)]
                for param in self.params
                if getattr(getattr(param, "type", param), "min", None)
                is not None
            }
        )
        return super().invoke(ctx)


def example(*lines: str) -> str:
    """Returns text for the end of a command's help: an example to type."""
    # What follows \b is not wrapped.
    return "\n  ".join(("\b\nExample:", *lines))


def check_finite(values: Mapping[str, object]) -> None:
    """Raises an error if an option's value is not a finite number.

    Typer lets NaN pass any bound.

    Args:
        values: name of an option's parameter -> value, or tuple of values.

    Raises:
        InputError: a value is infinite or NaN; the message names the option.
    """
    for name, value in values.items():
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float) and not math.isfinite(number):
                option = name.replace("_", "-")
                raise InputError(f"--{option}: {number} is not a finite number")


def given_options(context: typer.Context) -> list[str]:
    """Returns the names of parameters that the user gave on the command line.

    The result excludes parameters whose values are defaults or come from the
    environment.
    """
    sources = {
        str(param.name): context.get_parameter_source(str(param.name))
        for param in context.command.params
    }
    return [
        name
        for name, source in sources.items()
        if source is not None and source.name == "COMMANDLINE"
    ]


def with_options(
    keyword: str,
    options: Mapping[str, tuple[Any, Any]],
    make: Callable[..., Any],
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Returns a decorator that adds a group of options to a command.

    The decorated function has one parameter for the whole group. On the command
    line, the parameter is replaced by the options of the group.

    Args:
        keyword: name of the parameter for the whole group.
        options: name -> (type, default) of each option of the group. The type
            is annotated with the option.
        make: function that is called with the options' values as keyword
            arguments. The result of this function is passed to the command as
            `keyword`.
    """
    added = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=default,
            annotation=kind,
        )
        for name, (kind, default) in options.items()
    ]

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def run(**values: Any) -> None:
            chosen = {name: values.pop(name) for name in options}
            command(**values, **{keyword: make(**chosen)})

        own = inspect.signature(command, eval_str=True).parameters.values()
        parameters = [
            *(
                parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
                for parameter in own
                if parameter.name != keyword
            ),
            *added,
        ]
        run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {
            parameter.name: parameter.annotation for parameter in parameters
        }
        return run

    return decorate
