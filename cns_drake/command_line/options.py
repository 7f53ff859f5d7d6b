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
        help="Number of frames (LiDAR scans) to record, from the start of the "
        "drive; by default the whole drive. Usually there are 20 frames per "
        "second.",
    ),
]
LIDAR_OPTION = typer.Option(
    metavar="PRESET",
    help="Model of LiDAR to simulate, by the name of its preset: cns, os0-128,"
    " os1-32, os1-64, os1-128, os1-64-33, os1-128-42, vlp-16, hdl-64e, hdl-32e,"
    " alpha-prime, hesai-pandar64, hesai-pandar-xt32, hokuyo-ust-20lx, mid-70,"
    " avia or mid-360.",
)
LidarPreset = Annotated[str | None, LIDAR_OPTION]
Traffic = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=2000,
        metavar="N",
        help="Number of moving vehicles. The same number of pedestrians is "
        "added. By default the traffic of the scenario.",
    ),
]
Recording = Annotated[
    Path | None,
    typer.Option(
        help="File for a web page (.html) that replays the drive in a browser, "
        "with Meshcat. An existing file is replaced. By default no page is "
        "written."
    ),
]
Graphviz = Annotated[
    Path | None,
    typer.Option(
        help="File for a graph of the connected systems in Drake's Diagram, as "
        "Graphviz text. An existing file is replaced. By default no graph is "
        "written."
    ),
]
Overwrite = Annotated[
    bool,
    typer.Option(
        "--overwrite",
        help="Replace existing recordings. By default, existing recordings are "
        "not changed.",
    ),
]
Vary = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE.yaml",
        help="Shipped experiment, or experiment file, whose drives are added "
        "to the drives that you name. The command writes the experiment's "
        "scenario files to <output>/scenarios, and its generated cities to "
        "<output>/cities.",
    ),
]
Maps = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="MAP",
        help="Names of shipped maps, or folders of your own; by default all "
        "shipped maps.",
    ),
]
