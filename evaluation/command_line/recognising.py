"""The commands `cns-eval pr` and `cns-eval scores`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base import terminal
from evaluation.command_line.drive_notes import print_notes
from evaluation.command_line.options import (
    Align,
    AlignName,
    Json,
    LidarName,
    MethodName,
    ModeName,
    Parameters,
    SensorHeight,
)
from evaluation.command_line.protocol_options import (
    Gate,
    Radius,
    overlap_of,
    with_protocol,
)
from evaluation.command_line.result_rows import recognition_rows
from evaluation.recognition.protocol import (
    PAPER_PROTOCOL,
    RetrievalProtocol,
)

if TYPE_CHECKING:
    from evaluation.methods.method import Method


@with_protocol
def pr(
    database: Annotated[Path, typer.Argument(metavar="DATABASE")],
    query: Annotated[Path, typer.Argument(metavar="QUERY")],
    method: MethodName,
    mode: Annotated[
        ModeName,
        typer.Option(help="Count all queries, or those that have a match."),
    ] = ModeName.ALL,
    parameter: Parameters = None,
    sensor_height: SensorHeight = 1.6,
    align: Align = AlignName.AUTO,
    lidar: LidarName = None,
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
    json: Json = False,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """Place recognition of one drive in another.

    Measures how well the scans of QUERY find their place in DATABASE. Both are
    recorded drives (MCAP, MulRan, HeLiPR, KITTI odometry, CNS). Drives in
    different world frames are aligned.
    """
    from cns_drake.base.errors import InputError
    from evaluation.alignment import in_one_world
    from evaluation.drives import open_drive
    from evaluation.recognition import place_recognition
    from evaluation.recognition.overlap_truth import (
        compared_frames,
        read_overlaps,
        write_overlaps,
    )

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
    chosen = _chosen_method(method, parameter, sensor_height)
    places, query_drive = (
        open_drive(path, lidar) for path in (database, query)
    )
    for drive in (places, query_drive):
        print_notes(drive)
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


def scores(
    method: MethodName,
    database: Annotated[Path, typer.Option(help="Folder of single scans.")],
    query: Annotated[Path, typer.Option(help="Folder of single scans.")],
    output: Annotated[Path, typer.Option(help="CSV file to write.")],
    parameter: Parameters = None,
    sensor_height: SensorHeight = 1.6,
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
    chosen = _chosen_method(method, parameter, sensor_height)
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


def _chosen_method(
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
