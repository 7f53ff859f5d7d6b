"""Options that both command-line programs have."""

from pathlib import Path
from typing import Annotated, Any

import typer

Jobs = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="Number of jobs that run at once on this machine; by default one "
        "per core. Give a smaller number if memory runs out.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Address of a Dask scheduler, such as tcp://10.0.0.1:8786, which "
        "runs the jobs on several machines. All need the output folder under "
        "the same path. By default the environment variable "
        "DASK_SCHEDULER_ADDRESS.",
    ),
]
Methods = Annotated[
    list[str] | None,
    typer.Option(
        "--method",
        metavar="NAME|FILE.py",
        help="Method to run: the name of a shipped method, a Python file with "
        "your own method, or the word standard, which means all standard "
        "methods. By default all standard methods run. May be repeated.",
    ),
]
MethodSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="METHOD.NAME=VALUE",
        help="New value for a setting of a method, such as btc.candidates=20. "
        "Separate the numbers of a list by commas. If only one method runs, "
        "you may leave out the method's name: candidates=20. May be repeated.",
    ),
]
Costs = Annotated[
    bool,
    typer.Option(
        "--costs/--no-costs",
        help="Whether the page shows the time and memory that each method "
        "took. They differ from run to run.",
    ),
]

Width = Annotated[
    str | None,
    typer.Option(
        metavar="LENGTH",
        help="Width of the charts for print, such as 3.5in, 89mm or 252pt; "
        "their letters then have 8 pt.",
    ),
]
Font = Annotated[
    str | None,
    typer.Option(
        metavar="serif|sans-serif|monospace|NAME",
        help="Font of the charts for print; NAME is an installed one.",
    ),
]
Title = Annotated[
    bool,
    typer.Option(
        "--title/--no-title",
        help="Whether the charts for print have a title.",
    ),
]
# What an option means in each command that has it.
LIDAR = (
    "LiDAR whose scans are read, if a recording has several LiDARs. Give NAME "
    "from the topic /NAME/points, or the whole topic."
)
COLUMNS = (
    "Number of float32 values per point in .bin files, including x, y and z. "
    "By default four, or five in files named *.pcd.bin, as those of nuScenes."
)
_ODOMETRY = "Topic of the poses, if a recording has several."
Json = Annotated[
    bool, typer.Option("--json", help="Print the results as one JSON object.")
]
# Options of commands that open one drive or several.
_EACH = " Give it once for all drives, or once for each, in order."
Lidars = Annotated[
    list[str] | None,
    typer.Option("--lidar", metavar="NAME", help=LIDAR + _EACH),
]
Odometry = Annotated[
    list[str] | None,
    typer.Option(
        metavar="TOPIC",
        help=_ODOMETRY + _EACH,
    ),
]
OdometryTopic = Annotated[
    str | None, typer.Option("--odometry", metavar="TOPIC", help=_ODOMETRY)
]
Poses = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE",
        help="File with poses of the LiDAR that are used instead of those of "
        "the recording, in the form of TUM (seconds, x y z, quaternion x y z "
        "w), of a table whose header names these columns, or of KITTI (a "
        f"3 x 4 matrix for each scan).{_EACH}",
    ),
]
ColumnsOfEach = Annotated[
    list[int] | None,
    typer.Option(
        "--columns",
        metavar="N",
        min=3,  # x, y, z
        help=COLUMNS + _EACH,
    ),
]
LidarName = Annotated[
    str | None,
    typer.Option(
        "--lidar",
        metavar="NAME",
        help=LIDAR,
    ),
]
Columns = Annotated[
    int | None,
    typer.Option(
        "--columns",
        metavar="N",
        min=3,  # x, y, z
        help=COLUMNS,
    ),
]
PoseGap = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="Greatest time between two recorded poses that are interpolated; "
        "by default 1.",
    ),
]


def readings(
    lidar: list[str] | None,
    odometry: list[str] | None,
    poses: list[Path] | None,
    columns: list[int] | None,
    pose_gap: float | None = None,
) -> dict[str, Any]:
    """Returns how drives are read, from the options that were given."""
    given = {
        "lidar": lidar,
        "odometry": odometry,
        "poses": poses,
        "columns": columns,
        "pose_gap": pose_gap,
    }
    return {
        name: values
        for name, values in given.items()
        if values is not None and values != []
    }
