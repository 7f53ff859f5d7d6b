"""The command line `cns-eval`.

What takes time to import is imported inside the commands, so that the help
comes at once.
"""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from evaluation import console

app = typer.Typer(
    help="Structural change and place recognition on LiDAR sequences.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


class ModeName(str, Enum):
    """Which queries a precision-recall curve counts."""

    ALL = "all"
    FILTERED = "filtered"


class AlignName(str, Enum):
    """When sequences are put into one world."""

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
_OwnMethods = Annotated[
    list[Path] | None,
    typer.Option(
        help="Python file that registers a method, to run besides the four;"
        " may be repeated."
    ),
]
_Jobs = Annotated[
    int | None,
    typer.Option(
        help="Processes that work at the same time; as many as there are"
        " cores if left out."
    ),
]
_Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Scheduler of a Dask cluster that shares the file system, such"
        " as tcp://10.0.0.1:8786. Also DASK_SCHEDULER_ADDRESS.",
    ),
]


@app.command()
def tcr(
    source: Annotated[Path, typer.Argument(metavar="A")],
    target: Annotated[Path, typer.Argument(metavar="B")],
    control: Annotated[
        Path | None,
        typer.Option(
            metavar="C",
            help="A recording of A's route in B's stage, or of B's route in"
            " A's stage: what TCR_sym the routes alone cause.",
        ),
    ] = None,
    align: _Align = AlignName.AUTO,
    json: _Json = False,
) -> None:
    """Temporal change ratio of two sequences or map files.

    A and B are recorded sequences (MCAP, MulRan, HeLiPR, KITTI odometry,
    CNS) or maps (.pcd .ply .npy .bin). A is the source and B the target of
    the directed ratios. Sequences of different world frames are aligned.
    """
    from evaluation import change

    paths = [path for path in (source, target, control) if path is not None]
    surveys, alignments = change.survey_in_one_world(
        paths, align.value, console.track
    )
    report = change.compare(
        *surveys[:2],
        control=None if control is None else surveys[2],
        alignment=alignments[0] if alignments else None,
    )
    for one in surveys:
        _tell_notes(one.sequence)
        ignored = one.voxels.num_ignored
        if ignored:
            console.note(f"{one.name}: {ignored} points not finite")
    for alignment in alignments:
        console.note(alignment.to_text())
    if json:
        console.print_json(report.to_json())
    else:
        console.print_rows(_change_rows(report))


@app.command()
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
    json: _Json = False,
) -> None:
    """Place recognition: how well queries find their place in a database.

    Both are recorded sequences (MCAP, MulRan, HeLiPR, KITTI odometry, CNS).
    Those of different world frames are aligned.
    """
    from evaluation import place_recognition
    from evaluation.alignment import in_one_world
    from evaluation.sequences import open_sequence

    chosen = _make_method(method, parameter, sensor_height)
    drives = [open_sequence(path) for path in (database, query)]
    for drive in drives:
        _tell_notes(drive)
    alignment = in_one_world(*drives, align.value, console.track)
    if alignment is not None:
        drives = [alignment.first, alignment.second]
        console.note(alignment.report.to_text())
    result = place_recognition.run(*drives, chosen, mode.value, console.track)
    if json:
        console.print_json(result.to_json())
    else:
        console.print_rows(_recognition_rows(result))


@app.command()
def scores(
    method: _MethodName,
    database: Annotated[Path, typer.Option(help="Folder of single scans.")],
    query: Annotated[Path, typer.Option(help="Folder of single scans.")],
    output: Annotated[Path, typer.Option(help="CSV file to write.")],
    parameter: _Parameters = None,
    sensor_height: _SensorHeight = 1.6,
) -> None:
    """Raw scores of all pairs of two folders of scans (.bin .pcd .npy .ply).

    Every query is compared with every place; a search that only saves time
    is left out. An empty score means that there is no candidate.
    """
    from evaluation import scan_folders

    chosen = _make_method(method, parameter, sensor_height)
    num_ignored = scan_folders.write_scores(
        chosen, database, query, output, console.track
    )
    if num_ignored:
        console.note(f"{num_ignored} points not finite")
    console.note(f"wrote {output}")


@app.command()
def report(
    recordings: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option(help="Folder to write.")],
    method: _OwnMethods = None,
    jobs: _Jobs = None,
    scheduler: _Scheduler = None,
) -> None:
    """Tables, figures and report.html from all recordings in a folder.

    Interrupted, the same command goes on where it was.
    """
    from evaluation import report as reporting
    from evaluation.cluster import choose_cluster

    cluster = choose_cluster(jobs, scheduler)
    path = reporting.write_report(
        recordings, output, cluster, method or (), on_note=console.note
    )
    print(path)


@app.command()
def trend(
    databases: Annotated[list[Path], typer.Argument(metavar="DATABASE...")],
    query: Annotated[Path, typer.Option(help="The drive that asks.")],
    output: Annotated[Path, typer.Option(help="Folder to write.")],
    method: _OwnMethods = None,
    jobs: _Jobs = None,
    scheduler: _Scheduler = None,
) -> None:
    """AUC of every method over TCR_sym, one query drive and many databases.

    Writes trend.csv and a figure with 95 % bands. Interrupted, the same
    command goes on where it was.
    """
    from evaluation.cluster import choose_cluster
    from evaluation.study.trend_points import measure_trend
    from evaluation.trend import write_trend

    cluster = choose_cluster(jobs, scheduler)
    points = measure_trend(query, databases, output, cluster, method or ())
    print(write_trend(points, output))


def main() -> None:
    """Runs the command line and exits with its status."""
    raise SystemExit(console.run(app, "cns-eval"))


def _tell_notes(sequence) -> None:
    for note in () if sequence is None else sequence.notes:
        console.note(note)


def _make_method(name: str, assignments: list[str] | None, height: float):
    from evaluation.errors import InputError
    from evaluation.methods import make_method
    from evaluation.methods.own_file import load_method

    parameters: dict[str, object] = {"sensor_height": height}
    for assignment in assignments or []:
        key, equals, value = assignment.partition("=")
        if not (key and equals):
            raise InputError(f"--set: {assignment!r} is not NAME=VALUE")
        parameters[key] = value.split(",") if "," in value else value
    if name.endswith(".py"):
        name = load_method(Path(name)).name
    return make_method(name, parameters)


def _change_rows(report):
    change = report.change
    pair = f"{report.source} <-> {report.target}"
    yield "pair", pair
    yield "TCR_sym", console.number(change.symmetric)
    if change.undefined_because:
        yield "  because", change.undefined_because
    for label, names, side in (
        ("TCR", (report.source, report.target), change.source_to_target),
        ("TCR", (report.target, report.source), change.target_to_source),
    ):
        counts = f"({side.num_unchanged} of {side.num_in_hull} unchanged)"
        yield (
            f"{label} {names[0]} -> {names[1]}",
            f"{console.number(side.ratio)}  {counts}",
        )
    if report.masked is not None:
        yield (
            "TCR_sym where both drove",
            console.number(report.masked.symmetric),
        )
    if report.control is not None:
        names = " <-> ".join(report.control_names)
        yield (
            "TCR_sym of the routes alone",
            f"{console.number(report.control.symmetric)}  ({names})",
        )


def _recognition_rows(result):
    metrics = result.metrics
    yield "method", result.method
    yield "database -> query", f"{result.database} -> {result.query}"
    yield "mode", metrics.mode
    yield (
        "queries, with a match (N)",
        f"{metrics.num_queries}, {metrics.num_with_match}",
    )
    yield (
        "R@1",
        f"{console.number(metrics.recall_at_1)}"
        f"  {_interval_text(metrics.recall_at_1_interval)}"
        f"  (TP {metrics.num_right} of N {metrics.num_with_match})",
    )
    for rank in (5, 10, 25):
        yield f"R@{rank}", console.number(metrics.recall_at_n[rank - 1])
    yield "R@1%", console.number(metrics.recall_at_1_percent)
    yield (
        "AUC",
        f"{console.number(metrics.auc)}"
        f"  {_interval_text(metrics.auc_interval)}",
    )
    f1 = console.number(metrics.f1_max)
    if metrics.f1_max_index is not None:
        index = metrics.f1_max_index
        f1 += (
            f"  (TP {metrics.curve.true_positives[index]},"
            f" T {metrics.curve.counted[index]})"
        )
    yield "F1max", f1


def _interval_text(interval) -> str:
    low, high = console.number(interval.low), console.number(interval.high)
    return f"[{low}, {high}]"
