"""What commands share: options, drives that are opened, results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
import functools
import inspect
import math
from pathlib import Path
import textwrap
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from cns_drake.base import terminal
from cns_drake.base.errors import InputError
from evaluation.recognition.protocol import DEFAULT_PROTOCOL, PROTOCOLS

if TYPE_CHECKING:
    from evaluation.drives import Drive


# When drives are aligned to one world.
When = Literal["auto", "always", "never"]
Align = Annotated[
    When,
    typer.Option(
        help="Align drives: those whose world frames differ, all, or none."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
MethodName = Annotated[
    str,
    typer.Option(
        "--method",
        help="Place-recognition method, or a Python file that registers one.",
    ),
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="A parameter of the method; may be repeated. Several numbers"
        " are separated by commas.",
    ),
]
SensorHeight = Annotated[
    float, typer.Option(help="Height of the LiDAR above the ground [m].")
]
SessionSpacing = Annotated[
    float,
    typer.Option(
        metavar="METRES", min=0.01, help="Way between two scans of a map."
    ),
]
LidarName = Annotated[
    str | None,
    typer.Option(
        "--lidar",
        metavar="NAME",
        help="LiDAR to read, of recordings with several: its topic is "
        "/NAME/points.",
    ),
]
OwnMethods = Annotated[
    list[Path] | None,
    typer.Option(
        help="Method to run besides the shipped ones: a Python file that "
        "registers it, or map-closures; may be repeated."
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="Number of processes that work side by side; by default one for "
        "each core.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Scheduler of a Dask cluster with a shared file system, such as "
        "tcp://10.0.0.1:8786; by default DASK_SCHEDULER_ADDRESS, if set.",
    ),
]
Settings = Annotated[
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
        help="Also measure the costs of methods in time and memory, which "
        "differ from run to run.",
    ),
]


def open_noted(*paths: Path, lidar: str | None) -> list[Drive]:
    """Opens drives, and shows the notes on how they were read."""
    from evaluation.drives import open_drive

    drives = [open_drive(path, lidar) for path in paths]
    for drive in drives:
        for note in drive.notes:
            terminal.note(note)
    return drives


def aligned(
    drives: Sequence[Drive], when: When, *, across_maps: bool = False
) -> tuple[Drive, Drive]:
    """Returns two drives in one world, with a note if one was moved."""
    from evaluation.alignment import in_one_world

    first, second = drives
    alignment = in_one_world(
        first, second, when, terminal.track, across_maps=across_maps
    )
    if alignment is None:
        return first, second
    terminal.note(alignment.report.to_text())
    return alignment.first, alignment.second


def show(
    values: Mapping, rows: Iterable[tuple[str, str]], *, json: bool
) -> None:
    """Prints values as JSON, or as rows."""
    if json:
        terminal.print_json(dict(values))
    else:
        terminal.print_rows(rows)


def overlap_of(truth: str) -> float | None:
    """Returns the least overlap, of `overlap:PART`; None for `radius`.

    Raises:
        InputError: if it is neither.
    """
    if truth == "radius":
        return None
    kind, _, part = truth.partition(":")
    try:
        least = float(part) if kind == "overlap" else math.nan
    except ValueError:
        least = math.nan
    if not 0.0 < least <= 1.0:
        raise InputError(
            f"--truth: {truth!r} is neither 'radius' nor 'overlap:PART' with a"
            " part above 0 and up to 1, such as overlap:0.5"
        )
    return least


def _protocol(
    named_protocol: Annotated[
        Literal["fair", "paper"], typer.Option("--protocol")
    ] = "fair",
    radius: float = DEFAULT_PROTOCOL.radius,
    query_spacing: float = DEFAULT_PROTOCOL.query_spacing,
    place_spacing: float = DEFAULT_PROTOCOL.place_spacing,
    max_range: float = DEFAULT_PROTOCOL.max_range,
    scans_per_place: Annotated[int | None, typer.Option(metavar="N")] = None,
    exclude_recent: Annotated[float | None, typer.Option(metavar="S")] = None,
    gate: Annotated[bool, typer.Option("--gate")] = False,
) -> None:
    """The options of the protocol, see `with_protocol`.

    Args:
        named_protocol: Queries turned and tilted at random, or as the paper
            asked.
        radius: A place is a match within this distance [m].
        query_spacing: Distance between two queries along the path [m].
        place_spacing: Distance between two places of the database [m].
        max_range: Leave out points farther than this along an axis [m].
        scans_per_place: Merge N scans for every method; by default each method
            has its own number.
        exclude_recent: Loop closure: each drive is also its own database, with
            places it passed at least S seconds before.
        gate: Reject, among the best places of a query, those that are beyond
            the radius by the method's own pose; for methods that estimate
            poses.
    """


def with_protocol(
    command: Callable[..., None], *, named: bool = False
) -> Callable[..., None]:
    """Gives a command the options of the protocol.

    On the command line they replace its keyword `protocol`, a
    `RetrievalProtocol`. If named, `--protocol` says what the rest is; else it
    is the default.
    """
    _, *options = shown = _parameters(explained(_protocol))
    if named:
        options = shown

    def run(**values: Any) -> None:
        chosen = {one.name: values.pop(one.name) for one in options}
        base = DEFAULT_PROTOCOL
        if named:
            base = PROTOCOLS[chosen.pop("named_protocol")]
        command(**values, protocol=replace(base, **chosen))

    parameters = [
        one.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for one in (*_parameters(command), *options)
        if one.name != "protocol"
    ]
    return _called(command, run, parameters)


with_named_protocol = functools.partial(with_protocol, named=True)


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
        terminal.check_finite({name: values[name] for name in ranged})
        run(**values)

    wrapper.__doc__ = text or command.__doc__
    wrapper.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    wrapper.__annotations__ = {one.name: one.annotation for one in parameters}
    return wrapper
