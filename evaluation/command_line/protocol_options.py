"""The options of the protocol, the same for all commands."""

from __future__ import annotations

from collections.abc import Callable
import functools
import inspect
import math
from typing import Annotated, Any

import typer

from cns_drake.base.errors import InputError
from evaluation.recognition.protocol import (
    PAPER_PROTOCOL,
    RetrievalProtocol,
)

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
            options replace on the command line.
    """

    @functools.wraps(command)
    def with_options(**values: Any) -> None:
        chosen = {name: values.pop(name) for name in _OPTIONS}
        command(**values, protocol=RetrievalProtocol(**chosen))

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
