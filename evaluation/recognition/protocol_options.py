"""The options of the commands that compare two drives by a protocol."""

from dataclasses import replace
from typing import Annotated, Any, Literal

import typer

from cns_drake.base.commands import Options, with_options
from evaluation.recognition.protocol import (
    PROTOCOLS,
    RECORDED_PROTOCOL,
    RetrievalProtocol,
)

_NAMED: Options = {
    "named_protocol": (
        Annotated[
            Literal["fair", "paper", "recorded"],
            typer.Option(
                "--protocol",
                help="How the scans of the query drive become queries. fair "
                "gives each scan a random yaw and tilt, so that no method "
                "profits from equal headings. paper follows the CNS paper. "
                "recorded leaves the scans as they are.",
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
            RECORDED_PROTOCOL.radius,
            "Greatest distance at which a place counts as a match of a query "
            "[m].",
            None,
        ),
        (
            "query_spacing",
            float,
            RECORDED_PROTOCOL.query_spacing,
            "Distance that the car drives between two queries [m].",
            None,
        ),
        (
            "place_spacing",
            float,
            RECORDED_PROTOCOL.place_spacing,
            "Distance that the car drives between two places of the database "
            "[m].",
            None,
        ),
        (
            "max_range",
            float,
            RECORDED_PROTOCOL.max_range,
            "Leave out points that are farther than this along x, y or z in "
            "the LiDAR's frame [m].",
            None,
        ),
        (
            "scans_per_place",
            int | None,
            None,
            "Number of consecutive scans that are merged for each place and "
            "each query, with every method. By default each method's own "
            "number.",
            "N",
        ),
        (
            "exclude_recent",
            float | None,
            None,
            "Turn on loop closure: each drive is also compared with itself. A "
            "query is then compared only with places that the car passed at "
            "least this long before [s], such as 30. Every method scores all "
            "of these places, even a method that otherwise scores only a few "
            "candidates, such as scan-context++.",
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
                help="Geometric verification: reject top-ranked places that "
                "are farther from the query than --radius, according to the "
                "method's own pose estimate. The option has no effect on "
                "methods that estimate no pose.",
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
