"""Options that several commands share."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer


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
