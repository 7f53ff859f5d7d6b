"""The command line `cns-eval`: its commands, each with an example.

Each command imports its slow modules itself, so that the help comes at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cns_drake.base import commands, program, shared_options, terminal
from cns_drake.base.commands import Command
from cns_drake.base.program import example
from cns_drake.base.progress_display import show_progress
from cns_drake.base.terminal import number
from evaluation.command_line import options
from evaluation.command_line.localising import localise
from evaluation.command_line.map_updating import map_update
from evaluation.command_line.real import real
from evaluation.command_line.trajectories import compare_paths
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.protocol_options import with_protocol

if TYPE_CHECKING:
    from evaluation.change.drive_change import ChangeReport
    from evaluation.methods.method import Method
    from evaluation.recognition.bootstrap import Interval
    from evaluation.recognition.metrics import Mode
    from evaluation.recognition.place_outcome import PlaceOutcome
    from evaluation.study.chosen_methods import MethodChoice

# Command of an earlier version -> the command that replaces it.
RENAMED = {
    "ranking": "compare --rankings",
    "scores": "pr DATABASE QUERY --method METHOD --scores FILE.csv",
    "drives": "tcr A B --paths",
    "trajectory": "localise DRIVE --estimate FILE.tum",
    "map-sessions": "cns-drake export A B --format map-sessions",
    "trend": "cns-drake study FILE.yaml FOLDER",
}

# Parameters that have an effect together with an option that changes what a
# command does.
_WITH_PATHS = ("source", "target", "align", "lidar", "columns", "json")
_WITH_SCORES = (
    "database",
    "query",
    "method",
    "parameter",
    "sensor_height",
    "gate",
    "radius",
    "columns",
)
_NOT_FINITE = "points are not finite, and left out"

app = program.make_program(
    "cns-eval",
    "Structural change and place recognition on LiDAR drives.",
    example("cns-eval tcr before.pcd after.pcd"),
    groups={
        "Measure change": ("tcr",),
        "Recognise places": ("pr", "report", "compare", "real"),
        "Localise, and keep maps": ("localise", "map-update"),
    },
    renamed=RENAMED,
)


@app.command(
    cls=Command,
    epilog=example("cns-eval tcr drives/metropolis_01 drives/metropolis_04"),
)
def tcr(
    context: typer.Context,
    source: Annotated[Path, typer.Argument(metavar="A")],
    target: Annotated[Path, typer.Argument(metavar="B")],
    control: Annotated[Path | None, typer.Option(metavar="C")] = None,
    align: options.Align = "auto",
    lidar: shared_options.LidarName = None,
    columns: shared_options.Columns = None,
    paths: Annotated[bool, typer.Option("--paths")] = False,
    output: options.Tables = None,
    json: shared_options.Json = False,
) -> None:
    """Measure how much changed between two drives or maps.

    A and B are recorded drives (MCAP, MulRan, HeLiPR, NCLT, Boreas, KITTI
    odometry, CNS) or maps (.pcd .ply .npy .bin). The main result, TCR_sym, is 0
    if nothing changed and 1 if everything changed. The command also prints two
    directed ratios: the share of A that is missing in B, and the share of B
    that is missing in A. Drives in different world frames are aligned first.

    Args:
        source: Drive or map before the change.
        target: Drive or map after the change.
        control: Third drive, on A's route in B's stage or on B's route in A's
            stage. With the control, the command also prints TCR_sym of two
            drives in the same stage, which differ only in their routes.
        paths: Compare the paths and speeds of the two drives, instead of
            measuring change. Every 5 m along A, the command measures how B
            differs from A in lateral offset, lane, heading and height. The
            command also prints the speeds of each car, and the share of the
            time during which the car stands. For comparison, it prints the same
            numbers of two pairs of real drives: two drives of Boreas, 28 days
            apart, and KAIST 01 and 02 of MulRan.
    """
    if paths:
        commands.check_only_with(context, "paths", _WITH_PATHS)
        first, second = options.open_noted(
            source, target, lidar=lidar, columns=columns
        )
        compare_paths(first, second, align, json=json)
        return
    from cns_drake.base.files import make_folder
    from evaluation.change import drive_change as change
    from evaluation.change.drive_maps import maps_in_one_world
    from evaluation.results.table import LAST, OWN, STAGE
    from evaluation.study import one_pair
    from evaluation.study.tasks.change import ChangeTask

    named = [path for path in (source, target, control) if path is not None]
    maps, alignments = maps_in_one_world(named, align, lidar, columns)
    before, after, *controls = maps
    compared = [(before, after)] + [
        (one, change.same_stage_partner(before, after, one)) for one in controls
    ]
    pairs = [
        one_pair.pair_of_drive_maps(
            both,
            (before.name, after.name),
            factors={STAGE: stage} if controls else {},
            is_baseline=stage == LAST,
            key=stage,
        )
        for both, stage in zip(compared, (OWN, LAST), strict=False)
    ]
    if output is not None:
        make_folder(output)
    engine = one_pair.measure_pairs(
        "tcr", pairs, [ChangeTask({}, "tcr")], output
    )
    report, *beside = (engine.found(one, ChangeTask.name) for one in pairs)
    for one in beside:
        report = report.beside(one)
    report = replace(
        report,
        spread=change.spread_over_grids(before, after, report.change),
        alignment=alignments[0] if alignments else None,
    )
    for one in maps:
        for note in one.notes:
            terminal.note(note)
        ignored = one.voxels.num_ignored
        if ignored:
            terminal.note(f"{one.name}: {ignored} {_NOT_FINITE}")
    for alignment in alignments:
        terminal.note(alignment.to_text())
    if output is not None:
        options.write_tables(engine)
    terminal.show(report.to_json(), _change_rows(report), json=json)


@app.command(
    cls=Command,
    epilog=example(
        "cns-eval pr drives/metropolis_01 drives/metropolis_04 \\",
        "    --method scan-context++",
    ),
)
@with_protocol
def pr(
    context: typer.Context,
    database: Annotated[Path, typer.Argument(metavar="DATABASE")],
    query: Annotated[Path, typer.Argument(metavar="QUERY")],
    method: options.MethodName,
    mode: Literal["all", "filtered"] = "all",
    parameter: shared_options.MethodSettings = None,
    sensor_height: options.SensorHeight = 1.6,
    align: options.Align = "auto",
    lidar: shared_options.LidarName = None,
    columns: shared_options.Columns = None,
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
    scores: Annotated[Path | None, typer.Option(metavar="FILE.csv")] = None,
    json: shared_options.Json = False,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """Measure place recognition between two drives.

    The command measures how well a method finds the place of each scan along
    QUERY among the places of DATABASE. QUERY and DATABASE are recorded drives
    (MCAP, MulRan, HeLiPR, NCLT, Boreas, KITTI odometry, CNS). Drives in
    different world frames are aligned first.

    Args:
        database: Recorded drive that provides the known places.
        query: Recorded drive that provides the scans to recognise.
        mode: Which queries count: all queries (all), or only queries that have
            a match in the database (filtered).
        across_maps: Allow two drives through maps of different names, such as
            two cities generated along the same streets.
        truth: What makes a place a match of a query. With radius, a match lies
            within --radius of the query. With overlap:PART, such as
            overlap:0.5, a match can lie at any distance, and the scan of the
            match shows at least PART of what the query's scan shows.
        overlaps: CSV file to write: the overlap of each query with each place.
            Needs --truth overlap:PART.
        exact_overlaps: File with exact overlaps, from cns-drake export --format
            overlap-table. Without such a file, overlaps are estimated from the
            scans. Needs --truth overlap:PART.
        turn_queries: Whether to rotate each query by a random yaw, as if the
            car had another heading. By default as --protocol says.
        tilt_queries: Greatest angle of the random roll and pitch by which each
            query is tilted [deg]. By default as --protocol says.
        hide_sector: Angular width of the sector, in a random direction, in
            which the points of each query are removed [deg], as if a truck
            beside the car occluded them.
        seed: Seed of the random yaws, tilts and occluded sectors of the
            queries.
        output: Folder for the tables results.csv and queries.csv, which have
            the columns of a study's tables; created if it does not exist.
        scores: CSV file for the score of each pair of a query and a place. Use
            this option for scans without poses: DATABASE and QUERY are then
            folders with .bin, .pcd, .npy or .ply files, and no results are
            computed. Every query is compared with every place, even if the
            method usually skips some places to save time. The score of a place
            that the method rejects is empty.
    """
    if scores is not None:
        commands.check_only_with(context, "scores", _WITH_SCORES)
        choice = _choice_of(method, parameter).at_height(sensor_height)
        chosen = choice.make()
        _write_scores(chosen, database, query, scores, protocol, columns)
        return
    from cns_drake.base import complete_files, files
    from cns_drake.base.errors import InputError
    from evaluation.drives import check_same_world
    from evaluation.drives.drive_views import CountedDrive
    from evaluation.recognition import overlap_truth
    from evaluation.recognition.place_outcome import check_has_match
    from evaluation.study import one_pair
    from evaluation.study.one_pair import OpenSource
    from evaluation.study.tasks.place import PlaceTask, PoseTask

    if turn_queries is not None:
        protocol = replace(protocol, turn_queries=turn_queries)
    if tilt_queries is not None:
        protocol = replace(protocol, tilt_queries=tilt_queries)
    protocol = replace(
        protocol,
        overlap=options.overlap_of(truth),
        hide_sector=hide_sector,
        seed=seed,
    )
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
    # Checked before the long work.
    if overlaps is not None:
        complete_files.check_writable(overlaps)
    if exact_overlaps is not None:
        files.check_regular(exact_overlaps)
    if output is not None:
        files.make_folder(output)
    given = _choice_of(method, parameter)
    choice = given.at_height(sensor_height)
    chosen = choice.make()
    places, query_drive = options.aligned(
        options.open_noted(database, query, lidar=lidar, columns=columns),
        align,
        across_maps=across_maps,
    )
    check_same_world(places, query_drive, across_maps=across_maps)
    counted = [CountedDrive(one) for one in (places, query_drive)]
    places, query_drive = counted
    shares = None
    if exact_overlaps is not None:
        frames = overlap_truth.compared_frames(places, query_drive, protocol)
        shares = overlap_truth.read_overlaps(exact_overlaps, *frames)
    elif protocol.overlap is not None:
        shares = overlap_truth.overlap_matrix(places, query_drive, protocol)
    pair = one_pair.pair_of(
        OpenSource(places),
        OpenSource(query_drive),
        (places.name, query_drive.name),
        protocol,
        overlaps=shares,
    )
    engine = one_pair.measure_pairs(
        "pr",
        [pair],
        [PlaceTask({}, "pr"), PoseTask({}, "pr")],
        output,
        # The height is in the protocol's digest.
        [(choice, given.columns)],
        terminal.note,
    )
    (outcome,) = (
        replace(one, method=choice.name)
        for one in engine.found(pair, PlaceTask.name)
        if one.is_gated == protocol.gate
    )
    check_has_match(outcome)
    for note in dict.fromkeys(
        chosen.assumption(one.lidar_field) for one in (places, query_drive)
    ):
        if note is not None:
            terminal.note(note)
    for one in counted:
        if one.num_ignored:
            terminal.note(f"{one.name}: {one.num_ignored} {_NOT_FINITE}")
    if overlaps is not None:
        assert shares is not None
        overlap_truth.write_overlaps(
            overlaps,
            outcome.columns["query_frame"],
            outcome.place_frames,
            shares,
        )
        terminal.note(f"wrote {overlaps}")
    if protocol.exclude_recent is None and is_itself:
        terminal.note(
            f"{query}: every scan finds itself (--exclude-recent leaves out "
            "recent places)"
        )
    if output is not None:
        options.write_tables(engine)
    values = outcome.to_json(mode)
    values["parameters"] = chosen.config.model_dump(mode="json")
    terminal.show(values, _recognition_rows(outcome, mode), json=json)


app.command(
    cls=Command,
    epilog=example(
        "cns-eval localise drives/metropolis_01 \\",
        "    drives/metropolis_04 --method gicp --start 1",
    ),
)(localise)


@app.command(
    cls=Command, epilog=example("cns-eval report drives --output report")
)
@with_protocol
def report(
    recordings: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option()],
    method: shared_options.Methods = None,
    parameter: shared_options.MethodSettings = None,
    lidar: shared_options.LidarName = None,
    columns: shared_options.Columns = None,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    costs: shared_options.Costs = True,
    tables: shared_options.Tables = False,
    *,
    protocol: RetrievalProtocol,
) -> None:
    """Evaluate all recordings in a folder and write a report.

    The command measures place recognition and structural change between the
    drives of each map. It writes report.html, figures, and the tables
    results.csv and queries.csv, which have the same columns as the tables of
    cns-drake study. To resume after an interruption, run the same command
    again.

    Args:
        recordings: Folder that contains the recordings.
        output: Folder for the report; created if it does not exist.
    """
    from cns_drake.base.jobs.cluster import choose_cluster
    from evaluation.command_line.suggestions import suggest_comparison
    from evaluation.paper import reference_for
    from evaluation.study import stages_report

    cluster = choose_cluster(jobs, scheduler)
    path = stages_report.write_report(
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
        columns=columns,
        with_tables=tables,
    )
    print(path)
    suggest_comparison(path.parent)


@app.command(cls=Command, epilog=example("cns-eval compare mine/results.csv"))
@commands.former_options({"--gate": "--verified"})
def compare(
    tables: Annotated[list[Path], typer.Argument(metavar="RESULTS")],
    metric: str = "auc",
    protocol: Annotated[
        str | None, typer.Option(metavar="fair|paper|recorded|own")
    ] = None,
    verified: Annotated[bool, typer.Option("--verified")] = False,
    rankings: Annotated[bool, typer.Option("--rankings")] = False,
    json: shared_options.Json = False,
) -> None:
    """Rank the methods in tables of results.

    RESULTS are files like results.csv, or folders that contain such a file. The
    command ranks the methods in these tables and in the shipped tables by their
    means over the conditions that all tables share.

    From four maps on, each mean has a 95 % t interval over maps. With one map,
    the interval is over conditions, if there are at least four conditions. If
    each table has a queries.csv next to it, the command also prints the
    difference in AUC between any two methods, with a p-value that is corrected
    for the number of differences by Holm's method. With --rankings, the command
    prints Kendall's tau between the rankings of any two tables.

    Args:
        tables: Tables of results to compare, or folders with a results.csv.
        metric: Metric by which the methods are ranked: auc, r1 or another
            metric in the tables. An unknown name makes the command list all
            metrics.
        protocol: Protocol of the results to compare; own stands for results
            that were measured with changed options. By default results of all
            protocols are used, each compared only with results of the same
            protocol.
        verified: Rank the results that were measured with geometric
            verification. By default, the results without geometric verification
            are ranked.
        rankings: Compare only how the tables rank the methods. Each table is
            ranked over its own conditions, so that tables with different
            conditions can be compared, such as simulated and real drives.
    """
    from evaluation.results import comparing

    found = comparing.compare(
        tables, metric, protocol, gate=verified, rankings=rankings
    )
    for note in found.notes:
        terminal.note(note)
    rows = [
        (one.method, f"{number(one.value)}{_known_interval(one.interval)}")
        for one in found.ranked
    ]
    if rows:
        where = f"mean of {found.conditions or 'its own'} conditions"
        known = any(_known_interval(one.interval) for one in found.ranked)
        level = "  [95 %]" if known else ""
        rows.insert(0, ("method", f"{metric}, {where}{level}"))
    for one in found.differences:
        interval = _interval_text(one.difference.interval)
        rows.append(
            (
                f"{one.first} - {one.second}",
                f"{number(one.difference.value)}  {interval}"
                f"  p {number(one.p_value)}",
            )
        )
    for alike in found.agreements:
        rows.append(
            (
                f"Kendall's tau, {alike.first} and {alike.second}",
                f"{number(alike.tau)}  {_interval_text(alike.interval)}",
            )
        )
    terminal.show(found.to_json(), rows, json=json)


app.command(
    cls=Command, epilog=example("cns-eval real real_scans --output real")
)(real)
app.command(
    cls=Command, epilog=example("cns-eval map-update maps --baseline distance")
)(map_update)


def main() -> None:
    """Runs the command line and exits with its status."""
    program.run(app, "cns-eval", show_progress())


def _write_scores(
    method: Method,
    database: Path,
    query: Path,
    output: Path,
    protocol: RetrievalProtocol,
    columns: int | None,
) -> None:
    """Writes the scores of `pr --scores`, and shows the notes on them."""
    from evaluation.recognition import scan_folders

    num_ignored = scan_folders.write_scores(
        method,
        database,
        query,
        output,
        gate_radius=protocol.gate_radius,
        columns=columns,
        on_note=terminal.note,
    )
    if num_ignored:
        terminal.note(f"{num_ignored} {_NOT_FINITE}")
    terminal.note(f"wrote {output}")
    if (note := method.assumption(None)) is not None:
        terminal.note(note)


def _choice_of(name: str, assignments: list[str] | None) -> MethodChoice:
    """Returns a method with its settings."""
    from evaluation.methods.own_files import load_method
    from evaluation.study.chosen_methods import MethodChoice, method_settings

    file = Path(name) if name.endswith(".py") else None
    if file is not None:
        # Errors name the file as the user does.
        name, file = load_method(file).name, file.absolute()
    settings = method_settings(assignments or [], [name])[name]
    return MethodChoice(name, file, tuple(settings.items()))


def _change_rows(report: ChangeReport) -> Iterator[tuple[str, str]]:
    """Yields names and values of the results of `tcr`."""
    change = report.change
    source, target = report.source, report.target
    yield "pair", f"{source} <-> {target}"
    yield "TCR_sym", number(change.symmetric)
    yield "  on shifted grids", " to ".join(map(number, report.spread))
    if change.undefined_because:
        yield "  because", change.undefined_because
    for names, side in (
        (f"{source} -> {target}", change.source_to_target),
        (f"{target} -> {source}", change.target_to_source),
    ):
        counts = f"({side.num_unchanged} of {side.num_in_hull} unchanged)"
        yield f"TCR {names}", f"{number(side.ratio)}  {counts}"
    if report.masked is not None:
        yield "TCR_sym where both drove", number(report.masked.symmetric)
    if report.control is not None and report.control_names is not None:
        names = " <-> ".join(report.control_names)
        value = number(report.control.symmetric)
        yield "TCR_sym of only the routes", f"{value}  ({names})"


def _recognition_rows(
    outcome: PlaceOutcome, mode: Mode
) -> Iterator[tuple[str, str]]:
    """Yields names and values of the results of `pr`."""
    from evaluation.recognition.pose_errors import (
        SUCCESS_ROTATION_DEG,
        SUCCESS_TRANSLATION,
    )

    metrics, pose = outcome.by_mode[mode], outcome.pose
    outcomes = outcome.outcomes
    with_match = metrics.num_with_match
    yield "method", outcome.method
    yield "database -> query", f"{outcome.database} -> {outcome.query}"
    yield "mode", metrics.mode
    yield "queries, with a match (N)", f"{metrics.num_queries}, {with_match}"
    yield (
        "R@1",
        f"{number(metrics.recall_at_1)}"
        f"  {_interval_text(metrics.recall_at_1_interval)}"
        f"  (TP {metrics.num_right} of N {with_match})",
    )
    for rank in (5, 10, 25):
        yield f"R@{rank}", number(metrics.recall_at_n[rank - 1])
    yield "R@1%", number(metrics.recall_at_1_percent)
    yield (
        "AUC",
        f"{number(metrics.auc)}  {_interval_text(metrics.auc_interval)}",
    )
    yield "AUC strict", f"{number(metrics.auc_strict)}  (recall = TP / N)"
    f1 = number(metrics.f1_max)
    curve = metrics.curve
    if metrics.f1_max_index is not None:
        index = metrics.f1_max_index
        f1 += f"  (TP {curve.true_positives[index]}, T {curve.counted[index]})"
    yield "F1max", f1
    yield "recall at full precision", number(curve.recall_at_full_precision)
    yield "mean reciprocal rank", number(outcomes.mean_reciprocal_rank)
    if not isnan(outcomes.match_auroc):
        yield "match AUROC", number(outcomes.match_auroc)
    yield (
        "AUC by radius",
        ", ".join(
            f"{radius:g} m {number(auc)}"
            for radius, auc in outcome.auc_over_radius().items()
        ),
    )
    if not isnan(pose.success):
        yield (
            "translation error, median, 90 %",
            f"{number(pose.translation_median)} m,"
            f" {number(pose.translation_90)} m"
            f"  ({pose.num_accepted} accepted matches)",
        )
        yield (
            "rotation error, median, 90 %",
            f"{number(pose.rotation_median_deg)} deg,"
            f" {number(pose.rotation_90_deg)} deg",
        )
        limits = f"{SUCCESS_TRANSLATION:g} m and {SUCCESS_ROTATION_DEG:g} deg"
        yield f"within {limits}", f"{number(pose.success)}  (of N)"
    yield "protocol", outcome.protocol.to_text()


def _known_interval(interval: Interval) -> str:
    """Returns an interval after two spaces; nothing if it is unknown."""
    if isnan(interval.low):
        return ""
    return f"  {_interval_text(interval)}"


def _interval_text(interval: Interval) -> str:
    low, high = number(interval.low), number(interval.high)
    return f"[{low}, {high}]"
