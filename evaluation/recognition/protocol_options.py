"""The options of the commands that compare two drives by a protocol."""

from dataclasses import replace
from typing import Annotated, Any, Literal

import typer

from cns_drake.base.commands import Options, with_options
from evaluation.recognition.protocol import (
    DEFAULT_PROTOCOL,
    PROTOCOLS,
    RetrievalProtocol,
)

_NAMED: Options = {
    "named_protocol": (
        Annotated[
            Literal["fair", "paper", "recorded"],
            typer.Option(
                "--protocol",
                help="Queries turned and tilted at random, as the paper asked "
                "them, or as recorded.",
            ),
        ],
        "fair",
    )
}
_FIELDS: Options = {
    name: (Annotated[kind, typer.Option(help=text, metavar=metavar)], default)
    for name, kind, default, text, metavar in (
        (
            "radius",
            float,
            DEFAULT_PROTOCOL.radius,
            "A place is a match within this distance [m].",
            None,
        ),
        (
            "query_spacing",
            float,
            DEFAULT_PROTOCOL.query_spacing,
            "Distance between two queries along the path [m].",
            None,
        ),
        (
            "place_spacing",
            float,
            DEFAULT_PROTOCOL.place_spacing,
            "Distance between two places of the database [m].",
            None,
        ),
        (
            "max_range",
            float,
            DEFAULT_PROTOCOL.max_range,
            "Leave out points farther than this along an axis [m].",
            None,
        ),
        (
            "scans_per_place",
            int | None,
            None,
            "Merge N scans for every method; by default each method has its "
            "own number.",
            "N",
        ),
        (
            "exclude_recent",
            float | None,
            None,
            "Loop closure: each drive is also its own database, with places it "
            "passed at least S seconds before.",
            "S",
        ),
    )
}
_GATE: Options = {
    "gate": (
        Annotated[
            bool,
            typer.Option(
                "--gate",
                help="Reject, among the best places of a query, those that are "
                "beyond the radius by the method's own pose; for methods that "
                "estimate poses.",
            ),
        ],
        False,
    )
}


def _named(named_protocol: str, **fields: Any) -> RetrievalProtocol:
    return replace(PROTOCOLS[named_protocol], **fields)


# Gives a command the options of the protocol, which replace its keyword
# `protocol`.
with_protocol = with_options("protocol", {**_NAMED, **_FIELDS, **_GATE}, _named)
