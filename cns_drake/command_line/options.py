"""Options that several commands and the diagram scripts share."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.units import LIDAR_PRESETS

_PRESETS = list(LIDAR_PRESETS)
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
    metavar="PRESET|FILE.yaml",
    help="Model of LiDAR to simulate: the file of a data sheet of your own, or"
    f" the name of a preset: {', '.join(_PRESETS[:-1])} or {_PRESETS[-1]}.",
)
LidarUnit = Annotated[str | None, LIDAR_OPTION]
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
