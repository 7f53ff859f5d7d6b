"""The command `pr`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cns_drake.base import (
    InputError,
    check_regular,
    check_writable,
    commands,
    errors_at_option,
    number_text,
    shared_options,
    terminal,
)
from evaluation.command_line import options
from evaluation.command_line.printed_text import interval_text
from evaluation.recognition import RetrievalProtocol, with_protocol

if TYPE_CHECKING:
    import numpy as np

    from cns_drake.drives import Drive
    from evaluation.drives import CountedDrive
    from evaluation.methods import Method
    from evaluation.recognition import Mode, PlaceOutcome, PoseMetrics
    from evaluation.study import Engine, MethodChoice

GROUP = "Recognise places"


# Parameters that have an effect together with `--scores`.
_WITH_SCORES = (
    "database",
    "query",
    "method",
    "parameter",
    "sensor_height",
    "verified",
    "radius",
    "columns",
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
    (MCAP, or as a public data set has them). Drives in different world frames
    are aligned first.

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
            An existing file is replaced. Needs --truth overlap:PART.
        exact_overlaps: File with exact overlaps, from cns-drake export --format
            overlap-table. Without such a file, overlaps are estimated from the
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
            the columns of a study's tables; created if it does not exist.
        scores: CSV file for the score of each pair of a query and a place. An
            existing file is replaced. With this option, the scans need no
            poses: DATABASE and QUERY are folders with .bin, .pcd, .npy or .ply
            files, and the command computes only scores, no AUC and no other
            metric. Every query is compared with every place, even if the method
            usually skips some places to save time. The score of a place that
            the method rejects is empty.

    Example:
        cns-eval pr drives/metropolis_01 drives/metropolis_04 \\
            --method scan-context++
    """
    if scores is not None:
        commands.check_only_with(context, "scores", _WITH_SCORES)
        choice = _choice_of(method, parameter).at_height(sensor_height)
        chosen = _made(choice)
        _write_scores(chosen, database, query, scores, protocol, columns)
        return
    from evaluation.results import make_output

    protocol = replace(
        _rotated(protocol, turn_queries, tilt_queries),
        overlap=options.overlap_of(truth),
        hide_sector=hide_sector,
        seed=seed,
    )
    _check_together(protocol, database, query, overlaps, exact_overlaps)
    if output is not None:
        make_output(output)
    given = _choice_of(method, parameter)
    choice = given.at_height(sensor_height)
    chosen = _made(choice)
    drives = _drives(database, query, lidar, columns, align, across_maps)
    shares = _overlaps(*drives, protocol, exact_overlaps)
    # The height is in the protocol's digest.
    engine, outcome = _measured(
        *drives, protocol, shares, (choice, given.columns), output
    )
    _show_notes(chosen, drives)
    if overlaps is not None:
        assert shares is not None
        _write_overlaps(overlaps, outcome, shares)
    if protocol.exclude_recent is None and _is_itself(database, query):
        terminal.note(
            f"{query}: every scan finds itself (--exclude-recent leaves out "
            "recent places)"
        )
    if output is not None:
        options.write_tables(engine)
    values = outcome.to_json(mode)
    values["parameters"] = chosen.config.model_dump(mode="json")
    terminal.show(values, _recognition_rows(outcome, mode), json=json)


def _rotated(
    protocol: RetrievalProtocol,
    turn_queries: bool | None,
    tilt_queries: float | None,
) -> RetrievalProtocol:
    """Returns a protocol with what the command line says of its rotations."""
    if turn_queries is not None:
        protocol = replace(protocol, turn_queries=turn_queries)
    if tilt_queries is not None:
        protocol = replace(protocol, tilt_queries=tilt_queries)
    return protocol


def _is_itself(database: Path, query: Path) -> bool:
    return database.resolve() == query.resolve()


def _drives(
    database: Path,
    query: Path,
    lidar: str | None,
    columns: int | None,
    align: options.When,
    across_maps: bool,
) -> tuple[CountedDrive, CountedDrive]:
    """Returns both drives in one world, and counts what is ignored of them.

    Raises:
        InputError: a drive cannot be read, or both are not of one map.
    """
    from cns_drake.drives import check_same_map, check_same_world
    from evaluation.drives import CountedDrive

    opened = options.open_noted(database, query, lidar=lidar, columns=columns)
    if not across_maps:
        try:
            check_same_map(*opened)
        except InputError as error:
            raise InputError(
                f"{error} (--across-maps allows this, for cities along the same"
                " streets)"
            ) from None
    places, queries = options.aligned(opened, align, across_maps=across_maps)
    check_same_world(places, queries, across_maps=across_maps)
    return CountedDrive(places), CountedDrive(queries)


def _measured(
    places: Drive,
    queries: Drive,
    protocol: RetrievalProtocol,
    overlaps: np.ndarray | None,
    method: tuple[MethodChoice, Mapping[str, Any]],
    output: Path | None,
) -> tuple[Engine, PlaceOutcome]:
    """Returns the engine that measured two drives, and the outcome.

    Args:
        places: drive that provides the places.
        queries: drive that provides the queries.
        protocol: the protocol.
        overlaps: (Q, D) overlaps of queries and places; None if matches are not
            by overlap.
        method: the method, and its columns in the tables.
        output: folder for the tables; None if there is none.

    Raises:
        InputError: no query has a match.
    """
    from evaluation.recognition import check_has_match
    from evaluation.study import (
        OpenSource,
        PlaceTask,
        PoseTask,
        measure_pairs,
        pair_of,
    )

    pair = pair_of(
        OpenSource(places),
        OpenSource(queries),
        (places.name, queries.name),
        protocol,
        overlaps=overlaps,
    )
    engine = measure_pairs(
        "pr",
        [pair],
        [PlaceTask({}, "pr"), PoseTask({}, "pr")],
        output,
        [method],
        terminal.note,
    )
    (outcome,) = (
        replace(outcome, method=method[0].name)
        for outcome in engine.found(pair, PlaceTask.name)
        if outcome.is_verified == protocol.verified
    )
    check_has_match(outcome)
    return engine, outcome


def _write_overlaps(
    file: Path, outcome: PlaceOutcome, overlaps: np.ndarray
) -> None:
    """Writes the overlaps (Q, D) of the queries and places of an outcome."""
    from evaluation.recognition import write_overlaps

    frames = outcome.columns["query_frame"], outcome.place_frames
    write_overlaps(file, *frames, overlaps)
    terminal.note(f"wrote {file}")


def _show_notes(method: Method, drives: Sequence[CountedDrive]) -> None:
    """Shows what the method assumes, and what was ignored of the scans."""
    from evaluation.drives import NOT_FINITE

    assumptions = (method.assumption(drive.lidar_field) for drive in drives)
    for note in dict.fromkeys(assumptions):
        if note is not None:
            terminal.note(note)
    for drive in drives:
        if drive.num_ignored:
            terminal.note(f"{drive.name}: {drive.num_ignored} {NOT_FINITE}")


def _check_together(
    protocol: RetrievalProtocol,
    database: Path,
    query: Path,
    overlaps: Path | None,
    exact_overlaps: Path | None,
) -> None:
    """Checks files, and options that need other options, before the long work.

    Raises:
        InputError: an option needs another one, or a file cannot be used.
    """
    for option, file in (
        ("--overlaps", overlaps),
        ("--exact-overlaps", exact_overlaps),
    ):
        if file is not None and protocol.overlap is None:
            raise InputError(f"{option}: add --truth overlap:PART")
    if protocol.exclude_recent is not None and not _is_itself(database, query):
        raise InputError(
            f"--exclude-recent: it is for a drive against itself, but {query} "
            f"is not {database}"
        )
    if overlaps is not None:
        check_writable(overlaps)
    if exact_overlaps is not None:
        check_regular(exact_overlaps)


def _overlaps(
    places: Drive,
    queries: Drive,
    protocol: RetrievalProtocol,
    exact_overlaps: Path | None,
) -> np.ndarray | None:
    """Returns the overlaps (Q, D) if matches are by overlap, otherwise None."""
    from evaluation.recognition import (
        compared_frames,
        overlap_matrix,
        read_overlaps,
    )

    if exact_overlaps is not None:
        frames = compared_frames(places, queries, protocol)
        return read_overlaps(exact_overlaps, *frames)
    if protocol.overlap is not None:
        return overlap_matrix(places, queries, protocol)
    return None


def _write_scores(
    method: Method,
    database: Path,
    query: Path,
    output: Path,
    protocol: RetrievalProtocol,
    columns: int | None,
) -> None:
    """Writes the scores of `pr --scores`, and shows the notes on them."""
    from evaluation.drives import NOT_FINITE
    from evaluation.recognition import write_scores

    num_ignored = write_scores(
        method,
        database,
        query,
        output,
        verification_radius=protocol.verification_radius,
        columns=columns,
        on_note=terminal.note,
    )
    if num_ignored:
        terminal.note(f"{num_ignored} {NOT_FINITE}")
    terminal.note(f"wrote {output}")
    if (note := method.assumption(None)) is not None:
        terminal.note(note)


def _choice_of(name: str, assignments: list[str] | None) -> MethodChoice:
    """Returns a method with its settings."""
    from evaluation.methods import load_method
    from evaluation.study import MethodChoice, method_settings

    file = Path(name) if name.endswith(".py") else None
    if file is not None:
        # Errors name the file as the user does.
        name, file = load_method(file).name, file.absolute()
    settings = method_settings(assignments or [], [name])[name]
    return MethodChoice(name, file, tuple(settings.items()))


def _made(choice: MethodChoice) -> Method:
    """Returns a chosen method.

    Raises:
        InputError: the method or a setting is unknown, or a value does not fit.
    """
    with errors_at_option("--method", "name"):
        return choice.make()


def _recognition_rows(
    outcome: PlaceOutcome, mode: Mode
) -> Iterator[tuple[str, str]]:
    """Yields names and values of the results of `pr`."""
    metrics = outcome.by_mode[mode]
    with_match = metrics.num_with_match
    yield "method", outcome.method
    yield "database -> query", f"{outcome.database} -> {outcome.query}"
    yield "mode", metrics.mode
    yield "queries, with a match (N)", f"{metrics.num_queries}, {with_match}"
    yield (
        "R@1",
        f"{number_text(metrics.recall_at_1)}"
        f"  {interval_text(metrics.recall_at_1_interval)}"
        f"  (TP {metrics.num_right} of N {with_match})",
    )
    for rank in (5, 10, 25):
        yield f"R@{rank}", number_text(metrics.recall_at_n[rank - 1])
    yield "R@1%", number_text(metrics.recall_at_1_percent)
    yield (
        "AUC",
        f"{number_text(metrics.auc)}  {interval_text(metrics.auc_interval)}",
    )
    yield "AUC strict", f"{number_text(metrics.auc_strict)}  (recall = TP / N)"
    f1 = number_text(metrics.f1_max)
    curve = metrics.curve
    if metrics.f1_max_index is not None:
        index = metrics.f1_max_index
        right = curve.true_positives[index]
        f1 += f"  (TP {right}, FP + FN {curve.counted[index] - right})"
    yield "F1max", f1
    yield (
        "recall at full precision",
        number_text(curve.recall_at_full_precision),
    )
    outcomes = outcome.outcomes
    yield "mean reciprocal rank", number_text(outcomes.mean_reciprocal_rank)
    if not isnan(outcomes.match_auroc):
        yield "match AUROC", number_text(outcomes.match_auroc)
    yield (
        "AUC by radius",
        ", ".join(
            f"{radius:g} m {number_text(auc)}"
            for radius, auc in outcome.auc_over_radius().items()
        ),
    )
    if not isnan(outcome.pose.success):
        yield from _pose_rows(outcome.pose)
    yield "protocol", outcome.protocol.to_text()


def _pose_rows(pose: PoseMetrics) -> Iterator[tuple[str, str]]:
    """Yields names and values of the errors of poses."""
    from evaluation.recognition import SUCCESS_ROTATION_DEG, SUCCESS_TRANSLATION

    yield (
        "translation error, median, 90 %",
        f"{number_text(pose.translation_median)} m,"
        f" {number_text(pose.translation_90)} m"
        f"  ({pose.num_accepted} accepted matches)",
    )
    yield (
        "rotation error, median, 90 %",
        f"{number_text(pose.rotation_median_deg)} deg,"
        f" {number_text(pose.rotation_90_deg)} deg",
    )
    limits = f"{SUCCESS_TRANSLATION:g} m and {SUCCESS_ROTATION_DEG:g} deg"
    yield f"within {limits}", f"{number_text(pose.success)}  (of N)"
