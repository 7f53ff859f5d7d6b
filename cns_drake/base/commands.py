"""How both programs make commands of functions, and the options they share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import functools
import inspect
import textwrap
from typing import Annotated, Any, get_args

import typer

from cns_drake.base.terminal import check_finite

Jobs = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="Work on this machine, on N jobs side by side; by default one "
        "for each core.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Work on the cluster of this Dask scheduler, which shares the "
        "file system, such as tcp://10.0.0.1:8786; by default "
        "DASK_SCHEDULER_ADDRESS, if set.",
    ),
]
SessionSpacing = Annotated[
    float,
    typer.Option(
        metavar="METRES",
        min=0.01,
        help="Distance along the way between two scans of a map.",
    ),
]
MethodSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="METHOD.NAME=VALUE",
        help="A parameter of a method; may be repeated. Several numbers are"
        " separated by commas.",
    ),
]
Costs = Annotated[
    bool,
    typer.Option(
        "--costs/--no-costs",
        help="Also measure what methods cost in time and memory, which "
        "differs from run to run.",
    ),
]

# The name of an option's parameter -> its type with the option, and its
# default.
Options = Mapping[str, tuple[Any, Any]]


def explained(command: Callable[..., None]) -> Callable[..., None]:
    """Returns a command whose docstring explains its options to the user.

    Args:
        command: the section `Args` of its docstring has the help of options
            and arguments; those without an entry have one already.
    """
    text, _, entries = inspect.getdoc(command).partition("\n\nArgs:\n")  # type: ignore[union-attr]  # Each command has one.
    helps: dict[str, str] = {}
    for line in textwrap.dedent(entries).splitlines():
        if not line.startswith(" "):
            name, _, line = line.partition(": ")
            helps[name] = line
        else:
            helps[name] += f" {line.strip()}"
    parameters = []
    for one in _parameters(command):
        if one.name in helps:
            is_required = one.default is inspect.Parameter.empty
            info: Any = typer.Argument() if is_required else typer.Option()
            kind = one.annotation
            if hasattr(kind, "__metadata__"):
                kind, info = get_args(kind)
            info.help = helps[one.name]
            one = one.replace(annotation=Annotated[kind, info])
        parameters.append(one)
    return _called(command, command, parameters, text)


def with_options(
    keyword: str, options: Options, make: Callable[..., Any]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Returns a decorator that gives a command a group of options.

    Args:
        keyword: the command's parameter that gets them as one value.
        options: the options.
        make: makes that value of the options' values.
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
        def run(**values: Any) -> None:
            chosen = {name: values.pop(name) for name in options}
            command(**values, **{keyword: make(**chosen)})

        own = [
            one.replace(kind=inspect.Parameter.KEYWORD_ONLY)
            for one in _parameters(command)
            if one.name != keyword
        ]
        return _called(command, run, [*own, *added])

    return decorate


def _parameters(command: Callable[..., None]) -> list[inspect.Parameter]:
    signature = inspect.signature(command, eval_str=True)
    return list(signature.parameters.values())


def _called(
    command: Callable[..., None],
    run: Callable[..., None],
    parameters: Sequence[inspect.Parameter],
    text: str | None = None,
) -> Callable[..., None]:
    """Returns a command as another function runs it, with its parameters.

    Its docstring is the text; that of the command by default.
    """

    ranged = [
        one.name
        for one in parameters
        for info in getattr(one.annotation, "__metadata__", ())
        if getattr(info, "min", None) is not None
    ]

    @functools.wraps(command)
    def wrapper(**values: Any) -> None:
        # Others are checked where they are used.
        check_finite({name: values[name] for name in ranged if name in values})
        run(**values)

    wrapper.__doc__ = text or command.__doc__
    wrapper.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    wrapper.__annotations__ = {one.name: one.annotation for one in parameters}
    return wrapper
