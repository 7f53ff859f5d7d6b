"""The command `export`: drives in the formats of other programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from pathlib import Path
import re
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cns_drake.base import (
    InputError,
    commands,
    did_you_mean,
    ended_by_interrupts,
    next_command,
    note,
    shared_options,
    show,
)
from cns_drake.command_line import options
from cns_drake.command_line.experiment_drives import varied_drives
from cns_drake.command_line.suggestions import (
    suggest_evaluation,
    suggest_page,
    suggest_recognition,
)
from cns_drake.export import export_formats
from evaluation.recognition import RetrievalProtocol

if TYPE_CHECKING:
    from cns_drake.base import Cluster
    from cns_drake.drives import Drive
    from cns_drake.scenarios import Scenario
    from cns_drake.studies import ExportOptions

GROUP = "Convert for other programs"


class Format(str, Enum):
    """Formats that the command writes, beside those of `export_formats`."""

    POINTNETVLAD = "pointnetvlad"
    OVERLAP = "overlap"
    OVERLAP_TABLE = "overlap-table"
    MAP_TRUTH = "map-truth"
    MAP_SESSIONS = "map-sessions"
    FILM = "film"


_CONVERTED = export_formats()
_PAIRS = (Format.POINTNETVLAD, Format.OVERLAP, Format.OVERLAP_TABLE)
_MAPS = (Format.MAP_TRUTH, Format.MAP_SESSIONS)
# Option -> the formats with which it has an effect.
_FORMATS: Mapping[str, tuple[str, ...]] = {
    "lidar": (*_CONVERTED, Format.MAP_SESSIONS),
    "columns": (Format.MAP_SESSIONS,),
    "absent_in": _CONVERTED,
    "sequence": _CONVERTED,
    "vary": _PAIRS,
    "held_out": (Format.POINTNETVLAD, Format.OVERLAP),
    "spacing": (*_PAIRS, *_MAPS),
    "scans": (Format.POINTNETVLAD,),
    "half_extent": _PAIRS,
    "jobs": _PAIRS,
    "scheduler": _PAIRS,
    "seconds": (Format.FILM,),
    "size": (Format.FILM,),
    "start_time": (Format.FILM,),
    "traffic": (Format.FILM,),
}
# Distance between two clouds of training data [m].
_PAIR_SPACING = 10.0
# Largest absolute coordinate of a point in clouds of training data [m].
_CLOUD_RANGE = 50.0
# Largest absolute coordinate of a point of which overlaps are computed [m].
_OVERLAP_RANGE = 100.0
# Distance between two scans of a map [m].
_MAP_SPACING = 1.0


def export(
    context: typer.Context,
    drives: Annotated[list[str] | None, typer.Argument(metavar="DRIVE")] = None,
    *,
    layout: Annotated[str, typer.Option("--format", metavar="FORMAT")],
    output: Annotated[Path, typer.Option()],
    lidar: shared_options.LidarName = None,
    columns: shared_options.Columns = None,
    absent_in: Annotated[str | None, typer.Option(metavar="STAGE")] = None,
    sequence: Annotated[
        int | None, typer.Option(metavar="NN", min=0, max=999)
    ] = None,
    spacing: Annotated[
        float | None, typer.Option(min=0.01, metavar="METRES")
    ] = None,
    vary: options.Vary = None,
    held_out: Annotated[list[str] | None, typer.Option(metavar="NAME")] = None,
    scans: Annotated[int, typer.Option(min=1, metavar="N")] = 1,
    half_extent: Annotated[
        float | None,
        typer.Option(min=1.0, max=10_000.0, metavar="METRES"),
    ] = None,
    seconds: Annotated[
        float, typer.Option(min=1.0, max=60.0, metavar="S")
    ] = 20.0,
    size: Annotated[str, typer.Option(metavar="WxH")] = "640x360",
    start_time: Annotated[
        float | None, typer.Option(min=0.0, metavar="S")
    ] = None,
    traffic: Annotated[int | None, typer.Option(min=0, metavar="N")] = None,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    json: shared_options.Json = False,
) -> None:
    """Export drives to the formats of other programs.

    The formats CONVERTED convert a recording.

    The formats pointnetvlad, overlap and overlap-table are data for training
    place recognition: point clouds with exact positives, negatives and
    overlaps. Each DRIVE is a shipped drive or a scenario file. The drives are
    simulated but not recorded. To resume after an interruption, run the same
    command again.

    The format map-truth is the ground truth for change detection: maps of two
    drives through the same place, with an exact label for each point. Name the
    older drive first. The labels of the older map are kept, gone, and
    unobserved by the newer drive; the labels of the newer map are kept, new,
    and newly seen. Each DRIVE is a recording of cns-drake, a shipped drive or a
    scenario file. cns-eval map-update compares the labels of your own change
    detector with this ground truth.

    The format map-sessions contains two maps without labels, from recordings
    whose world is unknown, such as real drives. Before cns-eval map-update can
    use these maps, add ground truth of your own: A/truth.npy and B/truth.npy.

    The format film shows one stretch of a shipped drive or of a scenario file
    in every stage of the city. The film begins with one shot per stage from
    behind the car, with the points that the LiDAR measures. Then follows one
    shot per stage from above.

    Args:
        drives: Drives to export. With --format pointnetvlad or overlap, you can
            leave them out: then the drives of the experiment that --vary names
            are exported, or all shipped drives if --vary is not given.
        layout: Format to write: one of CONVERTED (tum has only the
            trajectory), pointnetvlad (clouds and pickle files for
            PointNetVLAD), overlap (scans and the exact overlap of each pair),
            overlap-table (only the overlaps between a database and a query
            drive, for cns-eval pr --exact-overlaps), map-truth (two maps with
            labels of what changed), map-sessions (two maps without labels)
            or film.
        output: Folder to write; created if it does not exist. The folder must
            be new or empty, or contain earlier exports of the same format,
            except with map-truth and map-sessions, which need a new or empty
            folder. With film, the output is a file instead, and an existing
            file is replaced; its name ends in .webp, or in .mp4, which needs
            ffmpeg.
        absent_in: Another stage of the map, such as 01. Points on structures
            that do not exist in that stage get SemanticKITTI's labels of moving
            objects (252 to 259). Only with a format that has labels, such as
            kitti.
        sequence: Number NN of the exported drive, whose folder is called
            sequences/NN. By default the digits at the end of the drive's name.
            Only with a format that numbers drives, such as kitti.
        spacing: Distance that the car drives between two clouds of training
            data (by default 10) or between two scans of a map (by default 1)
            [m]. The smaller the distance, the denser the map.
        held_out: Drive that is used for evaluation only, and never for
            training, even if DRIVE or --vary names it. May be repeated. Only
            with --format pointnetvlad or overlap.
        scans: Number of consecutive scans that are merged into each cloud (a
            submap). Only with --format pointnetvlad.
        half_extent: Largest absolute x, y and z of a point of training data in
            the LiDAR's frame [m]. Points beyond this limit are left out. By
            default 50, or 100 for overlap-table.
        seconds: Length of the whole film, with all of its shots [s].
        size: Width and height of the film in pixels, each from 32 to 1920.
        start_time: Time in the drive at which the filmed stretch begins [s]. By
            default, the film shows the stretch of the drive whose two ends lie
            farthest apart.
        traffic: Number of vehicles of the map's recorded traffic in the film.
            The same number of pedestrians is added. By default the traffic of
            the scenario, or 60 if it has none.

    Example:
        cns-drake export drives/metropolis_01 \\
            --format kitti --output kitti
    """
    _check_format(layout)
    _check_options(commands.given_options(context), layout)
    words = drives or []
    if layout in _PAIRS:
        with ended_by_interrupts("cns-drake"):
            from cns_drake.base import choose_cluster
            from cns_drake.studies import ExportOptions, claim_pairs

        cluster = choose_cluster(jobs, scheduler)
        if vary is not None:  # Its scenarios are written to the same folder.
            claim_pairs(output, layout)
        learned = _learned_drives(words, vary, output, cluster)
        spacing = spacing or _PAIR_SPACING
        if layout == Format.OVERLAP_TABLE:
            named = [*words, *(["--vary", vary] if vary else [])]
            protocol = RetrievalProtocol(
                query_spacing=spacing, half_extent=half_extent or _OVERLAP_RANGE
            )
            _write_overlap_table(learned, named, output, protocol, json=json)
            return
        settings = ExportOptions(
            "overlap" if layout == Format.OVERLAP else "pointnetvlad",
            spacing,
            scans,
            half_extent or _CLOUD_RANGE,
        )
        _write_training_data(
            learned, held_out or (), output, settings, cluster, json=json
        )
        return
    number = 2 if layout in _MAPS else 1
    if len(words) != number:
        wanted = "one drive" if number == 1 else "two drives"
        raise InputError(f"--format {layout}: give {wanted}, not {len(words)}")
    first = words[0]
    if layout == Format.MAP_TRUTH:
        spacing = spacing or _MAP_SPACING
        _write_truth(first, words[1], output, spacing, json=json)
    elif layout == Format.MAP_SESSIONS:
        opened = _open_drives(words, lidar, columns)
        _write_sessions(opened, output, spacing or _MAP_SPACING, json=json)
    elif layout == Format.FILM:
        _export_film(
            first,
            output,
            seconds=seconds,
            size=size,
            start=start_time,
            traffic=traffic,
            json=json,
        )
    else:
        _export_recording(
            first,
            layout,
            output,
            lidar=lidar,
            absent_in=absent_in,
            sequence=sequence,
            json=json,
        )


# The help lists the formats.
export.__doc__ = (export.__doc__ or "").replace(
    "CONVERTED", f"{', '.join(_CONVERTED[:-1])} and {_CONVERTED[-1]}"
)


def _check_format(layout: str) -> None:
    known = (*_CONVERTED, *(one.value for one in Format))
    if layout not in known:
        raise InputError(
            f"--format: no format {layout!r} (known: {', '.join(known)})"
            f"{did_you_mean(layout, known)}"
        )


def _check_options(names: Iterable[str], layout: str) -> None:
    """Refuses options that have no effect with a format.

    Args:
        names: names of the parameters that the user gave.
        layout: the format.

    Raises:
        InputError: an option belongs to other formats.
    """
    for name in names:
        formats = _FORMATS.get(name, (layout,))
        if layout not in formats:
            raise InputError(
                f"--{name.replace('_', '-')}: not with --format {layout};"
                f" only with {', '.join(formats)}"
            )


def _export_recording(
    recording: str,
    layout: str,
    output: Path,
    *,
    lidar: str | None,
    absent_in: str | None,
    sequence: int | None,
    json: bool,
) -> None:
    """Converts a recording to the layout of a data set."""
    with ended_by_interrupts("cns-drake"):
        from cns_drake.export import export_drive
        from evaluation.drives import find_data_sets

    path = export_drive(
        Path(recording),
        layout,
        output,
        lidar=lidar,
        absent_in=absent_in,
        sequence=sequence,
        on_note=note,
    )
    show({"output": str(path)}, str(path), json=json)
    if find_data_sets(path):
        suggest_evaluation(Path(recording), lidar, path)


def _export_film(
    scenario: str,
    output: Path,
    *,
    seconds: float,
    size: str,
    start: float | None,
    traffic: int | None,
    json: bool,
) -> None:
    """Makes one film that shows a drive in every stage of its city."""
    with ended_by_interrupts("cns-drake"):
        from cns_drake.scenarios import load_scenario
        from cns_drake.simulation import make_film, with_some_traffic

    drive = load_scenario(scenario)
    match = re.fullmatch(r"(\d{1,4})x(\d{1,4})", size)
    width, height = map(int, match.groups()) if match else (0, 0)
    if not (32 <= width <= 1920 and 32 <= height <= 1920):
        raise InputError(
            f"--size: '{size}' is not of the form WxH with 32 to 1920 pixels, "
            "such as 640x360"
        )
    if traffic is None:
        drive = with_some_traffic(drive)
    else:
        drive = drive.with_traffic(traffic)
    number = make_film(
        drive,
        output,
        seconds=seconds,
        size=(width, height),
        start=start,
        on_note=note,
    )
    show(
        {"output": str(output), "images": number},
        f"{output}: {number} images",
        json=json,
    )
    suggest_page(drive, scenario)


def _learned_drives(
    names: list[str], vary: str | None, output: Path, cluster: Cluster
) -> list[Scenario]:
    """Returns the drives of training data, except the drives held out.

    These are the named drives and the drives of the experiment `vary`, or all
    shipped drives if neither is given.
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.scenarios import load_scenario, recordable_drives

    if not names and vary is None:
        names = list(recordable_drives())
    learned = [load_scenario(name) for name in names]
    if vary is not None:
        varied = varied_drives(vary, output, cluster)
        learned += [drive for drive in varied if drive not in learned]
    return learned


def _write_overlap_table(
    drives: Sequence[Scenario],
    words: Sequence[str],
    output: Path,
    protocol: RetrievalProtocol,
    *,
    json: bool,
) -> None:
    """Writes the overlaps between a database and a query drive.

    `words` are the words of the command line that name the drives.
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.studies import write_overlap_table

    if len(drives) != 2:
        raise InputError(
            "--format overlap-table: give two drives, database and query"
        )
    table = write_overlap_table(drives[0], drives[1], output, protocol)
    show({"output": [str(table)]}, str(table), json=json)
    suggest_recognition(drives, words, table, protocol)


def _write_training_data(
    learned: Sequence[Scenario],
    held_out: Sequence[str],
    output: Path,
    settings: ExportOptions,
    cluster: Cluster,
    *,
    json: bool,
) -> None:
    """Writes training data: clouds, and their positives or overlaps.

    The clouds come from the simulated drives `learned`. `held_out` names the
    drives for evaluation, which are not used for training.
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.scenarios import load_scenario
        from cns_drake.studies import export_pairs

    tested = [load_scenario(name) for name in held_out]
    taken = {drive.name for drive in tested}
    paths = export_pairs(
        [drive for drive in learned if drive.name not in taken],
        tested,
        output,
        settings,
        cluster,
        note,
    )
    texts = [str(path) for path in paths]
    show({"output": texts}, "\n".join(texts), json=json)


def _write_truth(
    a: str, b: str, output: Path, spacing: float, *, json: bool
) -> None:
    """Writes maps of two drives with exact labels of what changed.

    Args:
        a: older drive.
        b: newer drive.
        output: folder to write.
        spacing: distance between two scans of a map [m].
        json: whether to print the counts of labels as JSON.
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.base import check_new_folder
        from cns_drake.studies import open_labelled, write_truth
        from evaluation.map_update import Label

    check_new_folder(output)
    first, second = open_labelled(a), open_labelled(b)
    counts, table = write_truth(first, second, output, spacing)
    result: dict[str, Any] = {"output": str(output)}
    for side, numbers in counts.items():
        named = {
            Label(label).name.lower(): number
            for label, number in sorted(numbers.items())
        }
        result[side] = named
        text = ", ".join(
            f"{number} {name.replace('_', ' ')}"
            for name, number in named.items()
        )
        note(f"{side}: {text}")
        alone = [
            row
            for row in table
            if row.side == side and row.alone and not row.moves
        ]
        mapped = sum(row.points > 0 for row in alone)
        right = sum(row.verdict in ("gone", "new") for row in alone)
        note(
            f"{side}: {len(alone)} structures are in this drive's world alone;"
            f" {mapped} are in its map, {right} of them gone or new"
        )
    show(result, str(output), json=json)
    next_command("cns-eval", "map-update", output)


def _open_drives(
    paths: Sequence[str], lidar: str | None, columns: int | None
) -> list[Drive]:
    with ended_by_interrupts("cns-drake"):
        from evaluation.drives import open_drive

    return [open_drive(Path(path), lidar, columns) for path in paths]


def _write_sessions(
    drives: Sequence[Drive], output: Path, spacing: float, *, json: bool
) -> None:
    """Writes maps of two drives without labels."""
    with ended_by_interrupts("cns-drake"):
        from cns_drake.base import draft_folder
        from cns_drake.drives import check_same_world
        from evaluation.map_update import SIDES, write_session

    for drive in drives:
        for text in drive.notes:
            note(text)
    check_same_world(*drives)
    with draft_folder(output) as draft:
        for side, drive in zip(SIDES, drives, strict=True):
            write_session(drive, draft / side, spacing)
    show({"output": str(output)}, str(output), json=json)
