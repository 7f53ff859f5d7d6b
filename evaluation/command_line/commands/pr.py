"""The command `pr`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from evaluation.base import (
    InputError,
    check_writable,
    errors_at_option,
    shared_options,
    terminal,
)
from evaluation.command_line import options
from evaluation.command_line.printed_text import metric_rows
from evaluation.recognition import RetrievalProtocol, with_protocol

if TYPE_CHECKING:
    from evaluation.verbs import Recognition

GROUP = "Recognise places"


@with_protocol
def pr(
    database: Annotated[Path, typer.Argument(metavar="DATABASE")],
    query: Annotated[Path, typer.Argument(metavar="QUERY")],
    method: options.MethodName,
    mode: Literal["all", "filtered"] = "all",
    metric: Annotated[
        list[Path] | None, typer.Option(metavar="FILE.py")
    ] = None,
    parameter: shared_options.MethodSettings = None,
    sensor_height: options.SensorHeight = 1.6,
    align: options.Align = "auto",
    lidar: shared_options.Lidars = None,
    odometry: shared_options.Odometry = None,
    poses: shared_options.Poses = None,
    pose_gap: shared_options.PoseGap = None,
    columns: shared_options.ColumnsOfEach = None,
    across_maps: Annotated[bool, typer.Option("--across-maps")] = False,
    truth: Annotated[
        str, typer.Option(metavar="radius|overlap:PART")
    ] = "radius",
    overlaps: Annotated[Path | None, typer.Option(metavar="FILE.csv")] = None,
    exact_overlaps: Annotated[
        Path | None, typer.Option(metavar="FILE.csv")
    ] = None,
    turn_queries: Annotated[
        bool | None, typer.Option("--turn-queries/--no-turn-queries")
    ] = None,
    tilt_queries: Annotated[float | None, typer.Option(metavar="DEG")] = None,
    hide_sector: Annotated[float, typer.Option(metavar="DEG")] = 0.0,
    seed: int = 0,
    output: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    json: shared_options.Json = False,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """Measure place recognition between two drives.

    The command measures how well a method finds the place of each scan along
    QUERY among the places of DATABASE. QUERY and DATABASE are recorded drives
    (MCAP, or as a public data set has them). Drives in different world frames
    are aligned first.

    Args:
        database: Recorded drive that provides the known places.
        query: Recorded drive that provides the scans to recognise.
        mode: Which queries count: all queries (all), or only queries that have
            a match in the database (filtered).
        metric: Python file that registers metrics of your own, which are then
            measured, too. May be repeated.
        across_maps: Allow two drives through maps of different names, such as
            two cities generated along the same streets.
        truth: What makes a place a match. radius: it lies within --radius of
            the query. overlap:PART, such as overlap:0.5: at any distance, its
            scan shows at least PART of what the query's scan shows.
        overlaps: CSV file to write: the overlap of each query with each place.
            An existing file is replaced. Needs --truth overlap:PART.
        exact_overlaps: File with exact overlaps, from cns-drake truth --format
            overlaps. Without such a file, overlaps are estimated from the
            scans. Needs --truth overlap:PART.
        turn_queries: Whether to rotate each query by a random yaw, as if the
            car had another heading. By default as --protocol says.
        tilt_queries: Greatest angle of the random roll and pitch by which each
            query is tilted [deg]. By default as --protocol says.
        hide_sector: Angular width of a sector in a random direction [deg]. The
            points of each query in this sector are removed, as if a truck
            beside the car occluded them.
        seed: Seed of the random yaws, tilts and occluded sectors of the
            queries.
        output: Folder for the tables results.csv and queries.csv, which have
            the columns of a study's tables.

    Example:
        cns-eval pr drives/metropolis_01 drives/metropolis_04 \\
            --method scan-context++
    """
    from evaluation.recognition import choose_method, write_overlaps
    from evaluation.results import make_output
    from evaluation.verbs import recognise

    overlap = options.overlap_of(truth)
    if overlaps is not None:
        if overlap is None:
            raise InputError("--overlaps: add --truth overlap:PART")
        check_writable(overlaps)
    given: dict[str, Any] = {
        "turn_queries": turn_queries,
        "tilt_queries": tilt_queries,
        "overlap": overlap,
    }
    if output is not None:
        make_output(output)
    with errors_at_option("--method", "name"):
        found = recognise(
            database,
            query,
            choose_method(method, parameter or ()),
            protocol=protocol,
            mode=mode,
            sensor_height=sensor_height,
            metrics=metric or (),
            align=align,
            across_maps=across_maps,
            **shared_options.readings(
                lidar, odometry, poses, columns, pose_gap
            ),
            exact_overlaps=exact_overlaps,
            hide_sector=hide_sector,
            seed=seed,
            **{
                name: value
                for name, value in given.items()
                if value is not None
            },
        )
    if overlaps is not None and found.overlaps is not None:
        frames = found.outcome.outcomes.columns["query_frame"]
        places = found.outcome.place_frames
        write_overlaps(overlaps, frames, places, found.overlaps)
        terminal.note(f"wrote {overlaps}")
    if output is not None:
        options.write_tables(found, output)
    terminal.show(found.to_json(), _rows(found), json=json)


def _rows(found: Recognition) -> Iterator[tuple[str, str]]:
    """Yields names and values of the results of `pr`."""
    outcome, counts = found.outcome, found.metrics
    yield "method", outcome.method
    yield "database -> query", f"{outcome.database} -> {outcome.query}"
    yield "mode", found.mode
    yield from metric_rows(
        found,
        {
            "r1": f"TP {counts['true_positives']:.0f}"
            f" of N {counts['with_match']:.0f}",
            "auc_strict": "recall = TP / N",
            "f1_max": f"TP {counts['f1_max_true_positives']:.0f}"
            f" of TP + FP + FN {counts['f1_max_counted']:.0f}",
        },
    )
    yield "protocol", outcome.protocol.to_text()
