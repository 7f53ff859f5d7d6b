"""Options that several commands and the diagram scripts share."""

from pathlib import Path
from typing import Annotated

import typer

Output = Annotated[
    Path,
    typer.Option(
        help="Folder for the recordings; created if it does not exist."
    ),
]
Results = Annotated[
    Path,
    typer.Option(help="Folder for the results; created if it does not exist."),
]
Frames = Annotated[
    int | None,
    typer.Option(
        min=1,
        metavar="N",
        help="Number of frames to record, counted from the start of the drive; "
        "by default a second has 20 frames.",
    ),
]
LIDAR_OPTION = typer.Option(
    metavar="PRESET",
    help="Preset of the LiDAR to simulate: cns, os0-128, os1-32, os1-64,"
    " os1-128, os1-64-33, os1-128-42, vlp-16, hdl-64e, hdl-32e, alpha-prime,"
    " hesai-pandar64, hesai-pandar-xt32, hokuyo-ust-20lx, mid-70, avia or"
    " mid-360.",
)
LidarPreset = Annotated[str | None, LIDAR_OPTION]
Recording = Annotated[
    Path | None,
    typer.Option(
        help="Web page of the drive to save as well; its name ends in .html."
    ),
]
Graphviz = Annotated[
    Path | None,
    typer.Option(
        help="File to which to save Drake's Diagram as well, as Graphviz text."
    ),
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace existing recordings.")
]
Maps = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="MAP",
        help="Names or folders of maps; by default all shipped maps.",
    ),
]


MethodFiles = Annotated[
    list[Path] | None,
    typer.Option(
        help="Python file that registers a method of yours, to run in addition "
        "to the shipped ones; may be repeated."
    ),
]
