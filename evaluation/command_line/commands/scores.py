"""The command `scores`."""

from pathlib import Path
from typing import Annotated

import typer

from evaluation.base import errors_at_option, shared_options, terminal
from evaluation.command_line import options
from evaluation.recognition import RECORDED_PROTOCOL

GROUP = "Recognise places"


def scores(
    database: Annotated[Path, typer.Argument(metavar="DATABASE")],
    query: Annotated[Path, typer.Argument(metavar="QUERY")],
    method: options.MethodName,
    output: Annotated[Path, typer.Option(metavar="FILE.csv")],
    parameter: shared_options.MethodSettings = None,
    sensor_height: options.SensorHeight = 1.6,
    verified: Annotated[bool, typer.Option("--verified")] = False,
    radius: float = RECORDED_PROTOCOL.radius,
    columns: shared_options.Columns = None,
) -> None:
    """Score each pair of scans of two folders.

    DATABASE and QUERY are folders with .bin, .pcd, .npy or .ply files, without
    poses: the command computes only scores, of every query with every place.
    Higher is more similar; the score of a place that the method rejects is
    empty.

    Args:
        database: Folder with the scans of the known places.
        query: Folder with the scans to recognise.
        output: CSV file to write, with the columns query, database and score.
            An existing file is replaced.
        verified: Use geometric verification: reject a place if the method's own
            pose estimate puts the query farther than --radius from that place.
        radius: Radius of the geometric verification [m].

    Example:
        cns-eval scores kitti/sequences/01/velodyne \\
            kitti/sequences/04/velodyne --method solid \\
            --output scores.csv
    """
    from evaluation.recognition import choose_method, write_scores

    choice = choose_method(method, parameter or ()).at_height(sensor_height)
    with errors_at_option("--method", "name"):
        made = choice.make()
    write_scores(
        made,
        database,
        query,
        output,
        verification_radius=radius if verified else None,
        columns=columns,
        on_note=terminal.note,
    )
    terminal.note(f"wrote {output}")
