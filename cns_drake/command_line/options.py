"""Options that several commands and the diagram scripts share."""

from pathlib import Path
from typing import Annotated

import typer

Output = Annotated[
    Path, typer.Option(help="Folder for recordings; created if need be.")
]
Results = Annotated[
    Path, typer.Option(help="Folder for the results; created if need be.")
]
Frames = Annotated[
    int | None,
    typer.Option(
        min=1,
        metavar="N",
        help="Record only the first N frames (20 a second by default).",
    ),
]
LIDAR_OPTION = typer.Option(
    metavar="PRESET",
    help="Replace the LiDAR: cns, os0-128, os1-32, os1-64, os1-128, os1-64-33,"
    " os1-128-42, vlp-16, hdl-64e, hdl-32e, alpha-prime, hesai-pandar64,"
    " hesai-pandar-xt32, hokuyo-ust-20lx, mid-70, avia or mid-360.",
)
LidarPreset = Annotated[str | None, LIDAR_OPTION]
Recording = Annotated[
    Path | None,
    typer.Option(help="Also save a web page of the drive, FILE.html."),
]
Graphviz = Annotated[
    Path | None, typer.Option(help="Also save the Diagram as Graphviz text.")
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace an existing recording.")
]
Maps = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="MAP",
        help="Maps, by name or folder; all shipped ones by default.",
    ),
]


MethodFiles = Annotated[
    list[Path] | None,
    typer.Option(
        help="Python file that registers a method to run besides those of "
        "cns-eval; may be repeated."
    ),
]
