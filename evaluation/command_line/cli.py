"""The command line `cns-eval`.

Slow modules are imported inside the commands, so that the help comes at once.
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base import terminal
from cns_drake.base.terminal import example
from evaluation.command_line.protocol_options import (
    Costs,
    Gate,
    Radius,
    Settings,
    overlap_of,
    with_protocol,
)
from evaluation.command_line.ranking_agreement import ranking
from evaluation.command_line.result_rows import change_rows, recognition_rows
from evaluation.recognition.protocol import (
    PAPER_PROTOCOL,
    RetrievalProtocol,
)

if TYPE_CHECKING:
    from cns_drake.base.recordings.sequence import Sequence
    from evaluation.methods.method import Method

app = terminal.make_program(
    "cns-eval",
    "Structural change and place recognition on LiDAR sequences.",
    example("cns-eval tcr before.pcd after.pcd"),
)


class ModeName(str, Enum):
    """The queries of a precision-recall curve."""

    ALL = "all"
    FILTERED = "filtered"


class AlignName(str, Enum):
    """When sequences are aligned to one world."""

    AUTO = "auto"
    ALWAYS = "always"
    NEVER = "never"


_Align = Annotated[
    AlignName,
    typer.Option(
        help="Align sequences: those whose world frames differ, all, or none."
    ),
]
_Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
_MethodName = Annotated[
    str,
    typer.Option(
        "--method",
        help="Place-recognition method, or a Python file that registers one.",
    ),
]
_Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="A parameter of the method; may be repeated. Several numbers"
        " are separated by commas.",
    ),
]
_SensorHeight = Annotated[
    float, typer.Option(help="Height of the LiDAR above the ground [m].")
]
_LidarName = Annotated[
    str | None,
    typer.Option(
        "--lidar",
        metavar="NAME",
        help="LiDAR to read, of recordings with several: its topic is "
        "/NAME/points.",
    ),
]
_OwnMethods = Annotated[
    list[Path] | None,
    typer.Option(
        help="Method to run besides the shipped ones: a Python file that "
        "registers it, or map-closures; may be repeated."
    ),
]
_Jobs = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="Number of processes that work side by side; by default one for "
        "each core.",
    ),
]
_Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Scheduler of a Dask cluster with a shared file system, such as "
        "tcp://10.0.0.1:8786; by default DASK_SCHEDULER_ADDRESS, if set.",
    ),
]


@app.command(
    epilog=example("cns-eval tcr drives/metropolis_01 drives/metropolis_04")
)
def tcr(
    source: Annotated[Path, typer.Argument(metavar="A")],
    target: Annotated[Path, typer.Argument(metavar="B")],
    control: Annotated[
        Path | None,
        typer.Option(
            metavar="C",
            help="A recording of A's route in B's stage, or of B's route in "
            "A's stage. It gives the TCR_sym that the routes alone cause.",
        ),
    ] = None,
    align: _Align = AlignName.AUTO,
    lidar: _LidarName = None,
    json: _Json = False,
) -> None:
    """Temporal change ratio of two drives or maps.

    A and B are recorded sequences (MCAP, MulRan, HeLiPR, KITTI odometry,
    CNS) or maps (.pcd .ply .npy .bin). A is the source and B the target of
    the directed ratios. Sequences in different world frames are aligned.
    """
    from evaluation.change import drive_change as change
    from evaluation.sequences import Sequence

    paths = [path for path in (source, target, control) if path is not None]
    surveys, alignments = change.survey_in_one_world(
        paths, align.value, terminal.track, lidar
    )
    report = change.compare(
        surveys[0],
        surveys[1],
        control=None if control is None else surveys[2],
        alignment=alignments[0] if alignments else None,
    )
    for one in surveys:
        if isinstance(one.sequence, Sequence):
            _print_notes(one.sequence)
        ignored = one.voxels.num_ignored
        if ignored:
            terminal.note(
                f"{one.name}: {ignored} points are not finite, and left out"
            )
    for alignment in alignments:
        terminal.note(alignment.to_text())
    if json:
        terminal.print_json(report.to_json())
    else:
        terminal.print_rows(change_rows(report))


@app.command(
    epilog=example(
        "cns-eval pr drives/metropolis_01 drives/metropolis_04 \\",
        "    --method scan-context++",
    )
)
@with_protocol
def pr(
    database: Annotated[Path, typer.Argument(metavar="DATABASE")],
    query: Annotated[Path, typer.Argument(metavar="QUERY")],
    method: _MethodName,
    mode: Annotated[
        ModeName,
        typer.Option(help="Count all queries, or those that have a match."),
    ] = ModeName.ALL,
    parameter: _Parameters = None,
    sensor_height: _SensorHeight = 1.6,
    align: _Align = AlignName.AUTO,
    lidar: _LidarName = None,
    across_maps: Annotated[
        bool,
        typer.Option(
            "--across-maps",
            help="Allow drives of maps with different names, such as another "
            "draw of a city along the same streets.",
        ),
    ] = False,
    truth: Annotated[
        str,
        typer.Option(
            metavar="radius|overlap:PART",
            help="Definition of a match: a place within the radius, or one "
            "whose scan shows at least this part of the query's scan.",
        ),
    ] = "radius",
    overlaps: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv",
            help="Write the overlap of each query with each place.",
        ),
    ] = None,
    exact_overlaps: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv",
            help="Read these overlaps from a table of cns-drake overlap; by "
            "default they are found from the scans.",
        ),
    ] = None,
    json: _Json = False,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """Place recognition of one drive in another.

    Measures how well the scans of QUERY find their place in DATABASE. Both are
    recorded sequences (MCAP, MulRan, HeLiPR, KITTI odometry, CNS). Sequences in
    different world frames are aligned.
    """
    from cns_drake.base.errors import InputError
    from evaluation.alignment import in_one_world
    from evaluation.recognition import place_recognition
    from evaluation.recognition.overlap_table import (
        read_overlaps,
        write_overlaps,
    )
    from evaluation.recognition.overlap_truth import compared_frames
    from evaluation.sequences import open_sequence

    protocol = replace(protocol, overlap=overlap_of(truth))
    for option, file in (
        ("--overlaps", overlaps),
        ("--exact-overlaps", exact_overlaps),
    ):
        if file is not None and protocol.overlap is None:
            raise InputError(f"{option}: add --truth overlap:PART")
    is_itself = database.resolve() == query.resolve()
    if protocol.exclude_recent is not None and not is_itself:
        raise InputError(
            f"--exclude-recent: it is for a drive against itself, but {query} "
            f"is not {database}"
        )
    chosen = _make_method(method, parameter, sensor_height)
    places, query_drive = (
        open_sequence(path, lidar) for path in (database, query)
    )
    for drive in (places, query_drive):
        _print_notes(drive)
    alignment = in_one_world(
        places,
        query_drive,
        align.value,
        terminal.track,
        across_maps=across_maps,
    )
    if alignment is not None:
        places, query_drive = alignment.first, alignment.second
        terminal.note(alignment.report.to_text())
    exact = None
    if exact_overlaps is not None:
        frames = compared_frames(places, query_drive, protocol)
        exact = read_overlaps(exact_overlaps, *frames)
    result = place_recognition.run(
        places,
        query_drive,
        chosen,
        mode.value,
        protocol,
        terminal.track,
        across_maps=across_maps,
        overlaps=exact,
    )
    if overlaps is not None:
        found = result.retrieval
        assert found.overlaps is not None
        write_overlaps(
            overlaps, found.query_frames, found.database_frames, found.overlaps
        )
        terminal.note(f"wrote {overlaps}")
    if protocol.exclude_recent is None and is_itself:
        terminal.note(
            f"{query}: every scan finds itself (--exclude-recent leaves out "
            "recent places)"
        )
    if json:
        terminal.print_json(result.to_json())
    else:
        terminal.print_rows(recognition_rows(result))


@app.command(
    epilog=example(
        "cns-eval scores --method solid --output scores.csv \\",
        "    --database kitti/sequences/01/velodyne \\",
        "    --query kitti/sequences/04/velodyne",
    )
)
def scores(
    method: _MethodName,
    database: Annotated[Path, typer.Option(help="Folder of single scans.")],
    query: Annotated[Path, typer.Option(help="Folder of single scans.")],
    output: Annotated[Path, typer.Option(help="CSV file to write.")],
    parameter: _Parameters = None,
    sensor_height: _SensorHeight = 1.6,
    gate: Gate = False,
    radius: Radius = PAPER_PROTOCOL.radius,
) -> None:
    """Scores of all pairs of scans of two folders.

    Scans are .bin, .pcd, .npy or .ply files. Every query is compared with every
    place; searches that only save time are left out. An empty score means that
    the place is no candidate.
    """
    from evaluation.recognition import scan_folders

    protocol = RetrievalProtocol(radius=radius, gate=gate)
    chosen = _make_method(method, parameter, sensor_height)
    num_ignored = scan_folders.write_scores(
        chosen,
        database,
        query,
        output,
        terminal.track,
        gate_radius=protocol.gate_radius,
    )
    if num_ignored:
        terminal.note(f"{num_ignored} points are not finite, and left out")
    terminal.note(f"wrote {output}")


@app.command(epilog=example("cns-eval report drives --output report"))
@with_protocol
def report(
    recordings: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option(help="Folder to write.")],
    method: _OwnMethods = None,
    parameter: Settings = None,
    lidar: _LidarName = None,
    jobs: _Jobs = None,
    scheduler: _Scheduler = None,
    costs: Costs = True,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """Report on all recordings in a folder.

    Writes tables, figures and report.html. After an interruption the same
    command goes on where it was.
    """
    from cns_drake.base.jobs.cluster import choose_cluster
    from evaluation.paper import reference_for
    from evaluation.study import benchmark as reporting

    cluster = choose_cluster(jobs, scheduler)
    path = reporting.write_report(
        recordings,
        output,
        cluster,
        method or (),
        protocol,
        on_note=terminal.note,
        settings=parameter or (),
        with_costs=costs,
        reference_for=reference_for,
        lidar=lidar,
    )
    print(path)


@app.command(
    epilog=example(
        "cns-eval trend family/riverside_01_m* \\",
        "    --query family/riverside_02 --output trend",
    )
)
@with_protocol
def trend(
    databases: Annotated[list[Path], typer.Argument(metavar="DATABASE")],
    query: Annotated[Path, typer.Option(help="The query drive.")],
    output: Annotated[Path, typer.Option(help="Folder to write.")],
    control: Annotated[
        list[Path] | None,
        typer.Option(
            help="A drive on the route of databases through the stage of the "
            "query, to plot the kept share of AUC as well; may be "
            "repeated."
        ),
    ] = None,
    method: _OwnMethods = None,
    lidar: _LidarName = None,
    jobs: _Jobs = None,
    scheduler: _Scheduler = None,
    parameter: Settings = None,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """AUC over TCR_sym, of many databases.

    One drive queries them all, by every method. Writes trend.csv and a figure
    with 95 % bands. After an interruption the same command goes on where it
    was.
    """
    from cns_drake.base.jobs.cluster import choose_cluster
    from evaluation.study.trend import write_trend
    from evaluation.study.trend_databases import measure_trend

    cluster = choose_cluster(jobs, scheduler)
    points = measure_trend(
        query,
        databases,
        output,
        cluster,
        method or (),
        protocol,
        control or (),
        lidar,
        parameter or (),
    )
    print(write_trend(points, output))


app.command(epilog=example("cns-eval ranking simulated/report real/report"))(
    ranking
)


def main() -> None:
    """Runs the command line and exits with its status."""
    terminal.run(app, "cns-eval")


def _print_notes(sequence: Sequence) -> None:
    for note in sequence.notes:
        terminal.note(note)


def _make_method(
    name: str, assignments: list[str] | None, height: float
) -> Method:
    from evaluation.methods import make_method
    from evaluation.methods.own_file import load_method
    from evaluation.study.chosen_methods import parse_setting

    parameters: dict[str, object] = {"sensor_height": height}
    parameters.update(map(parse_setting, assignments or []))
    if name.endswith(".py"):
        name = load_method(Path(name)).name
    return make_method(name, parameters)
