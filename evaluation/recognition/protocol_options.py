"""The options of the commands that compare two drives by a protocol."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from enum import Enum
from typing import Annotated, Any

import typer

from evaluation.base import with_options
from evaluation.recognition.protocol import (
    PROTOCOLS,
    RECORDED_PROTOCOL,
    RetrievalProtocol,
)

# Parameter name -> its type, annotated with the option, and its default.
_Options = Mapping[str, tuple[Any, Any]]


class _Name(str, Enum):
    """The name of a protocol. Typer knows lists of these, not of literals."""

    RANDOM_YAW = "random-yaw"
    PAPER = "paper"
    RECORDED = "recorded"


_WHAT = (
    "Protocol of the queries. random-yaw rotates each scan by a random yaw and "
    "tilt, so that no method profits from equal headings; paper follows the "
    "CNS paper; recorded leaves the scans unchanged."
)
_NAMED: _Options = {
    "named_protocol": (
        Annotated[_Name, typer.Option("--protocol", help=_WHAT)],
        "random-yaw",
    )
}
_SeveralNames = Annotated[
    list[_Name],
    typer.Option(
        "--protocol",
        metavar="|".join(one.value for one in _Name),
        help=f"{_WHAT} May be repeated to measure by several protocols. The "
        "page compares results by the protocol paper with the paper's tables.",
    ),
]
_FIELDS: _Options = {
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
            "half_extent",
            float,
            RECORDED_PROTOCOL.half_extent,
            "Largest absolute x, y and z of a point in the LiDAR's frame [m]. "
            "Points beyond this limit are left out.",
            None,
        ),
        (
            "scans_per_place",
            int | None,
            None,
            "Number of consecutive scans to merge for each place and each "
            "query, with all methods. By default each method uses its own "
            "number.",
            "N",
        ),
        (
            "exclude_recent",
            float | None,
            None,
            "Measure loop closure: also compare each drive with itself, a "
            "query with all places that the car passed at least S seconds "
            "before, such as 30.",
            "S",
        ),
    )
}
_VERIFIED: _Options = {
    "verified": (
        Annotated[
            bool,
            typer.Option(
                "--verified",
                help="Use geometric verification: reject a top-ranked place "
                "if the method's own pose estimate puts the query farther "
                "than --radius from that place. Methods without pose "
                "estimates are not affected.",
            ),
        ],
        False,
    )
}


def _named(named_protocol: str, **fields: Any) -> RetrievalProtocol:
    return replace(PROTOCOLS[named_protocol], **fields)


# Decorator: the command gets the protocol's options in place of its keyword
# `protocol`.
with_protocol = with_options(
    "protocol", {**_NAMED, **_FIELDS, **_VERIFIED}, _named
)


def with_protocols(
    *default: str,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Returns a decorator like `with_protocol`, for a study.

    The command gets a mapping from name to protocol in place of its keyword
    `protocols`; the first protocol is the main one. Geometric verification is
    no option, because a study measures with and without it.

    Args:
        default: names of the default protocols.
    """

    def all_named(
        named_protocols: list[_Name], **fields: Any
    ) -> dict[str, RetrievalProtocol]:
        return {
            one.value: replace(PROTOCOLS[one.value], **fields)
            for one in named_protocols
        }

    names: _Options = {
        "named_protocols": (_SeveralNames, [*map(_Name, default)])
    }
    return with_options("protocols", {**names, **_FIELDS}, all_named)
