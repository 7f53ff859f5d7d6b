"""The command `localise`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from evaluation.base import shared_options, terminal
from evaluation.command_line import options
from evaluation.command_line.printed_text import metric_rows

if TYPE_CHECKING:
    from evaluation.verbs import Localisation

GROUP = "Localise, and keep maps"


def localise(
    place: Annotated[Path, typer.Argument(metavar="MAP")],
    query: Annotated[Path, typer.Argument(metavar="QUERY")],
    method: Annotated[str, typer.Option(metavar="NAME|FILE.py")],
    start: float = 0.5,
    start_turn: float = 2.0,
    seed: int = 0,
    parameter: shared_options.MethodSettings = None,
    query_spacing: float | None = None,
    track: Annotated[bool, typer.Option("--track")] = False,
    odometry_drift: Annotated[
        float | None, typer.Option(metavar="PART")
    ] = None,
    align: options.Align = "auto",
    lidar: shared_options.Lidars = None,
    odometry: shared_options.Odometry = None,
    poses: shared_options.Poses = None,
    pose_gap: shared_options.PoseGap = None,
    columns: shared_options.ColumnsOfEach = None,
    jobs: shared_options.Jobs = None,
    output: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    json: shared_options.Json = False,
) -> None:
    """Localise scans in a map.

    Each scan of QUERY is aligned to MAP by registration, from an initial guess:
    the ground-truth pose, moved by --start in a random direction and rotated by
    --start-turn about a random axis; with --track, the estimated pose of the
    previous scan, moved by the odometry.

    MAP and QUERY are drives (MCAP, or as a public data set has them) or point
    clouds (.pcd .ply .npy .bin). A point cloud as QUERY counts as one scan,
    whose ground-truth pose is the origin of the map.

    Args:
        place: Drive or point cloud to use as the map.
        query: Drive or point cloud whose scans are localised in the map.
        method: Registration method: icp, plane-icp, gicp, vgicp,
            robust-plane-icp, robust-gicp or kiss-matcher; or a Python file with
            a function of your own.
        start: Distance of the initial guess from the ground truth [m]. A larger
            distance makes the task harder.
        start_turn: Angle between the initial guess and the ground truth [deg].
        seed: Seed of the random directions in which the initial guesses are
            moved and rotated.
        query_spacing: Distance that the car drives between two queries [m]; by
            default 10. Not with --track.
        track: Track the whole drive instead of localising single scans.
        odometry_drift: Drift of the simulated odometry that --track uses, as a
            share of the distance driven. With 0.01, the default, lengths are
            wrong by about 1 %, and the heading drifts by about 0.01 deg per
            metre.
        output: Folder for the results: the tables results.csv and queries.csv,
            localisation.csv with all values of each query, and, with --track, a
            picture.

    Example:
        cns-eval localise drives/metropolis_01 \\
            drives/metropolis_04 --method gicp --start 1
    """
    from evaluation.base import choose_cluster
    from evaluation.recognition import method_settings
    from evaluation.results import make_output
    from evaluation.verbs import localise as localise_scans

    name = Path(method).stem
    if output is not None:
        make_output(output, ["localise"])
    found = localise_scans(
        place,
        query,
        method,
        start=start,
        start_turn=start_turn,
        seed=seed,
        settings=method_settings(parameter or [], [name])[name],
        query_spacing=query_spacing,
        track=track,
        odometry_drift=odometry_drift,
        align=align,
        **shared_options.readings(lidar, odometry, poses, columns, pose_gap),
        processes=choose_cluster(jobs, None).num_workers,
    )
    if output is not None:
        title = (
            f"{found.query_name}, tracked by {name} in the map of"
            f" {found.map_name}"
        )
        _write_results(found, output, title if track else None)
    rows = [
        ("method", found.method),
        ("map <- query", f"{found.map_name} <- {found.query_name}"),
        ("initial guess", f"{start:g} m, {start_turn:g} deg"),
        *metric_rows(found),
    ]
    terminal.show(found.to_json(), rows, json=json)


def _write_results(
    found: Localisation, output: Path, title: str | None
) -> None:
    """Writes the tables and, of a tracked drive, the picture.

    Args:
        found: what was measured.
        output: folder of the files.
        title: title of the picture; None if no drive is tracked.
    """
    from evaluation.localisation import write_rows

    options.write_tables(found, output)
    write_rows(found.rows, output / "localisation.csv")
    terminal.note(f"wrote {output / 'localisation.csv'}")
    # A picture that fails takes no number along.
    if title:
        from evaluation.results import draw_track

        draw_track(found.rows, output / "track", title)
