"""Options that several commands share, such as those of the protocol."""

from collections.abc import Callable
from dataclasses import replace
from enum import Enum
import functools
import inspect
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from cns_drake.base.errors import InputError
from evaluation.recognition.protocol import PAPER_PROTOCOL


class ModeName(str, Enum):
    """The queries of a precision-recall curve."""

    ALL = "all"
    FILTERED = "filtered"


class AlignName(str, Enum):
    """When drives are aligned to one world."""

    AUTO = "auto"
    ALWAYS = "always"
    NEVER = "never"


Align = Annotated[
    AlignName,
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
Radius = Annotated[
    float,
    typer.Option(help="A place is a match within this distance [m]."),
]
Gate = Annotated[
    bool,
    typer.Option(
        "--gate",
        help="Reject, among the best places of a query, those that are beyond "
        "the radius by the method's own pose; for methods that estimate "
        "poses.",
    ),
]
QuerySpacing = Annotated[
    float,
    typer.Option(help="Distance between two queries along the path [m]."),
]
PlaceSpacing = Annotated[
    float,
    typer.Option(
        help="Distance between two places of the database [m].",
    ),
]
MaxRange = Annotated[
    float,
    typer.Option(
        help="Leave out points farther than this along an axis [m].",
    ),
]
_OPTIONS: dict[str, tuple[object, object]] = {
    "radius": (Radius, PAPER_PROTOCOL.radius),
    "query_spacing": (QuerySpacing, PAPER_PROTOCOL.query_spacing),
    "place_spacing": (PlaceSpacing, PAPER_PROTOCOL.place_spacing),
    "max_range": (MaxRange, PAPER_PROTOCOL.max_range),
    "scans_per_place": (
        Annotated[
            int | None,
            typer.Option(
                metavar="N",
                help="Merge N scans for every method; by default each method "
                "has its own number.",
            ),
        ],
        None,
    ),
    "exclude_recent": (
        Annotated[
            float | None,
            typer.Option(
                metavar="S",
                help="Loop closure: each drive is also its own database, with "
                "places it passed at least S seconds before.",
            ),
        ],
        None,
    ),
    "gate": (Gate, PAPER_PROTOCOL.gate),
}


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


def overlap_of(truth: str) -> float | None:
    """Returns the least overlap of a match; None for matches by radius.

    Args:
        truth: `radius` or `overlap:PART`.

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


def with_protocol(command: Callable[..., None]) -> Callable[..., None]:
    """Gives a command the options of the protocol.

    Args:
        command: has a keyword `protocol`, a `RetrievalProtocol`, which the
            options replace on the command line; the rest is the paper's.
    """

    @functools.wraps(command)
    def with_options(**values: Any) -> None:
        chosen = {name: values.pop(name) for name in _OPTIONS}
        command(**values, protocol=replace(PAPER_PROTOCOL, **chosen))

    signature = inspect.signature(command, eval_str=True)
    own = [p for p in signature.parameters.values() if p.name != "protocol"]
    added = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=default,
            annotation=annotation,
        )
        for name, (annotation, default) in _OPTIONS.items()
    ]
    parameters = [
        one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in own
    ] + added
    with_options.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    with_options.__annotations__ = {
        one.name: one.annotation for one in parameters
    }
    return with_options
