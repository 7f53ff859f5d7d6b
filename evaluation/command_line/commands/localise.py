"""The command `localise`."""

from __future__ import annotations

from collections.abc import Iterator
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base import shared_options, terminal
from evaluation.command_line import options

if TYPE_CHECKING:
    import numpy as np

    from cns_drake.drives import Drive
    from evaluation.study import Engine, LocaliseTask, Pair

GROUP = "Localise, and keep maps"

# Drift of the odometry by default, as a share of the distance.
_USUAL_DRIFT = 0.01


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
    lidar: shared_options.LidarName = None,
    columns: shared_options.Columns = None,
    jobs: shared_options.Jobs = None,
    output: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    json: shared_options.Json = False,
) -> None:
    """Localise scans in a map.

    Each scan of QUERY is aligned to MAP by registration, from an initial guess
    of the scan's pose: the ground-truth pose, moved by --start in a random
    direction and rotated by --start-turn about a random axis. With --track, the
    initial guess is instead the estimated pose of the previous scan, moved by
    the odometry. The results are pose errors and success rates.

    MAP and QUERY are drives (MCAP, or as a public data set has them) or point
    clouds (.pcd .ply .npy .bin). If MAP is a drive, its scans are merged at
    their ground-truth poses. If QUERY is a point cloud, it counts as one scan,
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
        track: Track the whole drive instead of localising single scans. The
            initial guess of each scan is the estimated pose of the previous
            scan, moved by the odometry.
        odometry_drift: Drift of the simulated odometry that --track uses, as a
            share of the distance driven. With 0.01, the default, lengths are
            wrong by about 1 %, and the heading drifts by about 0.01 deg per
            metre.
        output: Folder for the results; created if it does not exist. The tables
            results.csv and queries.csv have the columns of a study's tables;
            localisation.csv contains all values of each query. With --track,
            the folder also contains a picture.

    Example:
        cns-eval localise drives/metropolis_01 \\
            drives/metropolis_04 --method gicp --start 1
    """
    from cns_drake.base import InputError, choose_cluster
    from evaluation.localisation import (
        FEWEST_POINTS,
        Starts,
        default_settings,
        localisation_summary,
        make_estimator,
        tracking_summary,
    )
    from evaluation.results import make_output
    from evaluation.study import (
        LocaliseTask,
        OpenSource,
        method_settings,
        pair_of,
    )

    _check_together(query_spacing, odometry_drift, track=track)
    if odometry_drift is None:
        odometry_drift = _USUAL_DRIFT
    num_jobs = choose_cluster(jobs, None).num_workers
    Starts(start, start_turn, seed)  # It checks them.
    name = Path(method).stem
    given = method_settings(parameter or [], [name])[name]
    # Faults are told before the slow work.
    chosen = default_settings(method).with_values(given.items(), method)
    make_estimator(method, chosen)
    source, drive = _opened(place, query, align, lidar, columns)
    if output is not None:
        make_output(output, ["localise"])
    settings: dict = {
        "methods": [method],
        "starts": [[start, start_turn]],
        "seed": seed,
        "estimator": given,
        "odometry_drift": odometry_drift if track else None,
    }
    if query_spacing is not None:
        settings["spacing"] = query_spacing
    pair = pair_of(
        OpenSource(source, columns),
        OpenSource(drive),
        (source.name, drive.name),
    )
    task = LocaliseTask(settings, "localise")
    engine, rows, notes = _localised(pair, task, output, num_jobs)
    if all(map(math.isnan, rows["unmapped"])):
        raise InputError(
            f"{drive.name}: no scan has {FEWEST_POINTS} points in"
            f" different voxels of {chosen.scan_voxel:g} m"
        )
    for note in notes:
        terminal.note(note)
    values: dict = {
        "method": name,
        "map": source.name,
        "query": drive.name,
        "start": start,
        "start_turn_deg": start_turn,
        "seed": seed,
    }
    if track:
        values |= {"odometry_drift": odometry_drift}
        values |= tracking_summary(rows)
    values |= localisation_summary(rows)
    if output is not None:
        title = f"{drive.name}, tracked by {name} in the map of {source.name}"
        _write_results(engine, rows, output, title if track else None)
    terminal.show(values, _rows(values), json=json)


def _localised(
    pair: Pair, task: LocaliseTask, output: Path | None, num_jobs: int
) -> tuple[Engine, np.ndarray, list[str]]:
    """Localises the scans of a pair.

    Returns:
        The engine; (K,) results, one per query; the notes.

    Raises:
        InputError: the scans cannot be localised.
    """
    from cns_drake.base import InputError
    from evaluation.study import (
        NOT_LOCALISED,
        measure_pairs,
    )

    notes: list[str] = []
    engine = measure_pairs(
        "localise",
        [pair],
        [task],
        output,
        on_note=notes.append,
        processes=num_jobs,
    )
    if not (measured := engine.found(pair, task.name)):
        raise InputError(notes[-1].removesuffix(NOT_LOCALISED))
    (rows,) = measured
    return engine, rows, notes


def _write_results(
    engine: Engine, rows: np.ndarray, output: Path, title: str | None
) -> None:
    """Writes the tables and, of a tracked drive, the picture.

    Args:
        engine: has the tables.
        rows: (K,) results, one per query.
        output: folder of the files.
        title: title of the picture; None if no drive is tracked.
    """
    from evaluation.localisation import write_rows

    options.write_tables(engine)
    write_rows(rows, output / "localisation.csv")
    terminal.note(f"wrote {output / 'localisation.csv'}")
    # A picture that fails takes no number along.
    if title:
        from evaluation.results import draw_track

        draw_track(rows, output / "track", title)


def _check_together(
    query_spacing: float | None,
    odometry_drift: float | None,
    *,
    track: bool,
) -> None:
    """Checks which options are given together, and the ranges of options.

    Raises:
        InputError: an option cannot be used.
    """
    from cns_drake.base import InputError

    if track and query_spacing is not None:
        raise InputError("--query-spacing: not together with --track")
    if not track and odometry_drift is not None:
        raise InputError("--odometry-drift: only together with --track")
    if query_spacing is not None and not 0.0 < query_spacing < math.inf:
        raise InputError(f"--query-spacing: {query_spacing:g} is not above 0")
    if odometry_drift is not None and not 0.0 <= odometry_drift <= 1.0:
        raise InputError(
            f"--odometry-drift: {odometry_drift:g} is not from 0 to 1"
        )


def _opened(
    place: Path,
    query: Path,
    align: options.When,
    lidar: str | None,
    columns: int | None,
) -> tuple[Drive | Path, Drive]:
    """Returns the map and the drive of the queries, and shows notes on them.

    Two drives are in one world. A point cloud as the map stays a path; a point
    cloud as the query becomes a drive of one scan.

    Raises:
        InputError: a path cannot be opened, or the drives cannot be aligned.
    """
    from cns_drake.base import InputError
    from cns_drake.drives import Drive, check_same_world
    from evaluation.change import open_source
    from evaluation.localisation import OneScan

    source = open_source(place, lidar, columns)
    asked = open_source(query, lidar, columns)
    drive = asked if isinstance(asked, Drive) else OneScan(asked, columns)
    for opened in (source, drive):
        for note in opened.notes if isinstance(opened, Drive) else ():
            terminal.note(note)
    if align == "always" and not isinstance(source, Drive):
        raise InputError(f"--align: {place} is no drive, and stays as it is")
    if isinstance(source, Drive):
        source, drive = options.aligned((source, drive), align)
        check_same_world(source, drive)
    return source, drive


def _rows(values: dict) -> Iterator[tuple[str, str]]:
    """Yields names and values of the results."""

    def text(name: str) -> str:
        value = values[name]
        return "undefined" if value is None else f"{value:.3f}"

    yield "method", values["method"]
    yield "map <- query", f"{values['map']} <- {values['query']}"
    yield (
        "initial guess",
        f"{values['start']:g} m, {values['start_turn_deg']:g} deg",
    )
    if "within_03m" in values:
        yield "path in the map", f"{values['way']:.0f} m"
        yield "  within 0.3 m", text("within_03m")
        yield (
            "  lost",
            f"{text('lost_per_km')} a kilometre ({values['lost']} times,"
            f" {values['lost_for_good']} for good)",
        )
        yield "  recovered after", f"{text('back_after_median')} m"
    yield (
        "scans",
        f"{values['queries']}, {values['without_pose']} without a pose",
    )
    yield "within 0.3 m and 1 deg", text("success_03m_1deg")
    yield "within 2 m and 5 deg", text("success_2m_5deg")
    for name, unit in (("translation", "m"), ("rotation", "deg")):
        ending = "_deg" if unit == "deg" else ""
        yield (
            f"{name} error, median, 95 %",
            f"{text(f'{name}_median{ending}')} {unit},"
            f" {text(f'{name}_95{ending}')} {unit}",
        )
    yield (
        "  along, across, up",
        ", ".join(text(f"{axis}_median") for axis in ("along", "across", "up")),
    )
    yield (
        "AUROC of the estimator's score",
        f"{text('auroc_own_score')}  (fit {text('auroc_fit')}, residual"
        f" {text('auroc_residual')}, Hessian {text('auroc_hessian')})",
    )
    yield (
        "wrong, but confident",
        f"{text('confident_wrong')} of all results,"
        f" {text('confident_of_wrong')} of the wrong ones",
    )
    yield "share of a scan that the map lacks", text("unmapped_mean")
