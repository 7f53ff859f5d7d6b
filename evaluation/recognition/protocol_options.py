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
                help="How queries are made: fair turns and tilts them at "
                "random, paper follows the protocol of the CNS paper, recorded "
                "leaves the scans as recorded.",
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
            "Greatest distance between a query and its match [m].",
            None,
        ),
        (
            "query_spacing",
            float,
            DEFAULT_PROTOCOL.query_spacing,
            "Distance driven between two queries [m].",
            None,
        ),
        (
            "place_spacing",
            float,
            DEFAULT_PROTOCOL.place_spacing,
            "Distance driven between two places of the database [m].",
            None,
        ),
        (
            "max_range",
            float,
            DEFAULT_PROTOCOL.max_range,
            "Largest x, y or z of a point in the LiDAR's frame [m]; farther "
            "points are left out.",
            None,
        ),
        (
            "scans_per_place",
            int | None,
            None,
            "Number of consecutive scans that are merged into one, for every "
            "method; by default each method's own number.",
            "N",
        ),
        (
            "exclude_recent",
            float | None,
            None,
            "Least time between a query and an earlier place of the same drive "
            "[s]. Turns on loop closure: each drive is also compared with "
            "itself.",
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
                help="Reject top-ranked places that lie beyond the radius "
                "according to the method's own pose estimate. Only for methods "
                "that estimate poses.",
            ),
        ],
        False,
    )
}


def _named(named_protocol: str, **fields: Any) -> RetrievalProtocol:
    return replace(PROTOCOLS[named_protocol], **fields)


# Decorator: the command gets the protocol's options in place of its keyword
# `protocol`.
with_protocol = with_options("protocol", {**_NAMED, **_FIELDS, **_GATE}, _named)
