"""The options of the protocol, the same for every command that asks drives."""

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
        help="Among the best places of a query, reject those that the"
        " method's own pose puts beyond the radius; for every method that"
        " estimates poses.",
    ),
]
_OPTIONS: dict[str, tuple[object, object]] = {
    "radius": (
        Radius,
        PAPER_PROTOCOL.radius,
    ),
    "query_spacing": (
        Annotated[
            float, typer.Option(help="Between two queries, along the path [m].")
        ],
        PAPER_PROTOCOL.query_spacing,
    ),
    "place_spacing": (
        Annotated[
            float,
            typer.Option(help="Between two places of the database [m]."),
        ],
        PAPER_PROTOCOL.place_spacing,
    ),
    "max_range": (
        Annotated[
            float, typer.Option(help="Points farther along an axis go [m].")
        ],
        PAPER_PROTOCOL.max_range,
    ),
    "scans_per_place": (
        Annotated[
            int | None,
            typer.Option(
                metavar="N",
                help="Merge N scans for every method; each has its own number"
                " if left out.",
            ),
        ],
        None,
    ),
    "exclude_recent": (
        Annotated[
            float | None,
            typer.Option(
                metavar="S",
                help="Loop closure: a drive is also its own database, with"
                " the places that it passed at least S seconds before.",
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
        help="Also measure what the methods cost, in time and room: all that"
        " differs from run to run.",
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
        command: has a keyword `protocol`, a `RetrievalProtocol`, in place of
            which the options stand on the command line.
    """

    @functools.wraps(command)
    def asking(**values: Any) -> None:
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
    asking.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    asking.__annotations__ = {one.name: one.annotation for one in parameters}
    return asking
