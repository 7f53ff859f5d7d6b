"""Options that several commands and the diagram scripts share."""

from pathlib import Path
from typing import Annotated

import typer

Output = Annotated[
    Path,
    typer.Option(help="Folder for the recordings."),
]
Results = Annotated[
    Path,
    typer.Option(help="Folder for the results."),
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
        "to the drives that you name. Its scenario files and generated cities "
        "are in the folders scenarios and cities of --output, and the pairs "
        "that it compares in pairs.csv.",
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
