"""The verb `pr`: how well a method recognises the places of a drive."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path
from typing import Any, get_args

import numpy as np
from scipy.spatial.distance import cdist

from evaluation.alignment import When, open_pair
from evaluation.base import (
    NS_PER_S,
    InputError,
    check_regular,
    json_values,
    no_such,
    note,
)
from evaluation.drives import NOT_FINITE, CountedDrive, Drive, Reading
from evaluation.methods import Method
from evaluation.recognition import (
    PROTOCOLS,
    DriveData,
    MethodChoice,
    Mode,
    PlaceComparison,
    PlaceOutcome,
    RetrievalProtocol,
    asked_of_places,
    asked_of_queries,
    check_has_match,
    choose_method,
    compared_frames,
    load_metrics,
    measure_places,
    never_returns,
    overlap_matrix,
    read_overlaps,
)
from evaluation.results import (
    Answers,
    QueryRows,
    Results,
    as_factor,
    check_metric_names,
)
from evaluation.verbs.measured import (
    Measured,
    map_of,
    noting,
    pair_key,
    rows_of,
)


@dataclass(frozen=True, eq=False)
class Recognition(Measured):
    """How well a method recognises the places of a drive.

    Attributes:
        method: the method.
        outcome: its answers to the queries.
        mode: which queries the precision-recall curve counts.
        overlaps: (Q, D) overlap of each query with each place, if matches are
            by overlap; otherwise None.
    """

    method: Method
    outcome: PlaceOutcome
    mode: Mode
    overlaps: np.ndarray | None

    def to_json(self) -> dict[str, Any]:
        """Returns what `cns-eval pr --json` prints."""
        outcome, metrics = self.outcome, self.metrics
        return json_values(
            {
                "method": outcome.method,
                "mode": self.mode,
                "database": outcome.database,
                "query": outcome.query,
                "world": self.world.to_json(),
                **metrics,
                "intervals_95": {
                    name: one.to_json()
                    for name, one in self.intervals.items()
                    if not math.isnan(one.low)
                },
                "recall_at_1": metrics["r1"],
                "recall_at_n": [
                    outcome.outcomes.recall_at(rank) for rank in range(1, 26)
                ],
                "queries_with_match": metrics["with_match"],
                "protocol": outcome.protocol.to_json(),
                "parameters": self.method.config.model_dump(mode="json"),
            }
        )


@dataclass(frozen=True, eq=False)
class _MadeChoice(MethodChoice):
    """A method that is made already."""

    made: Method | None = None

    def make(self) -> Method:
        assert self.made is not None
        return self.made


def recognise(
    database: Drive | Path | str,
    query: Drive | Path | str,
    method: Method | MethodChoice | Path | str,
    *,
    protocol: RetrievalProtocol | str = "random-yaw",
    mode: Mode = "all",
    settings: Mapping[str, Any] | None = None,
    sensor_height: float = 1.6,
    metrics: Iterable[Path | str] = (),
    align: When = "auto",
    across_maps: bool = False,
    lidar: str | Sequence[str] | None = None,
    odometry: str | Sequence[str] | None = None,
    poses: Path | Sequence[Path] | None = None,
    columns: int | Sequence[int] | None = None,
    pose_gap: float | None = None,
    exact_overlaps: Path | None = None,
    on_note: Callable[[str], None] = note,
    **fields: Any,
) -> Recognition:
    """Measures place recognition between two drives, as `cns-eval pr` does.

    Drives in different world frames are aligned first.

    Args:
        database: drive that provides the known places, open or as a path.
        query: drive that provides the scans to recognise.
        method: the method: its name, a Python file with a method of your own,
            an object, or a choice of a study.
        protocol: the protocol, or its name.
        mode: which queries the precision-recall curve counts: `all`, or only
            queries with a match (`filtered`). The tables count all.
        settings: name -> value of each parameter of a named method that differs
            from its default.
        sensor_height: height of the LiDAR above the ground for a named method
            [m].
        metrics: Python files that register metrics of your own.
        align: whether to align the drives: `auto` (unless something says
            that they share a world), `always` or `never`.
        across_maps: whether the drives may be through maps of different names.
        lidar: name of the LiDAR, for recordings with several LiDARs; like the
            next three, one value for all drives, or a list with one for each.
        odometry: topic of the poses, for recordings with several.
        poses: file with the poses of the LiDAR, see `open_drive`.
        columns: number of columns of `.bin` files.
        pose_gap: see `open_drive`.
        exact_overlaps: file with exact overlaps; by default overlaps are
            estimated from the scans. It needs the field `overlap`.
        on_note: is called with notes for the user.
        fields: fields of the protocol that differ, such as `radius=5.0` or
            `verified=True`; see `RetrievalProtocol`.

    Raises:
        InputError: something cannot be read or used, the drives are not of one
            map, or no query has a match.

    Example:
        from evaluation import open_drive, recognise

        database, query = map(open_drive, ("cns/01", "cns/02"))
        found = recognise(database, query, "solid", verified=True)
        print(found.metrics["auc"], found.intervals["auc"])
    """
    protocol = replace(_protocol(protocol), **fields)
    if mode not in get_args(Mode):
        raise InputError(f"mode: {no_such('mode', mode, get_args(Mode))}")

    if exact_overlaps is not None:
        if protocol.overlap is None:
            raise InputError("--exact-overlaps: add --truth overlap:PART")
        check_regular(exact_overlaps)
    own = [one for path in metrics for one in load_metrics(Path(path))]
    choice, factors = _choice(method, settings or {}, sensor_height)
    check_metric_names(own, factors)
    made = choice.make()
    if protocol.exclude_recent is not None and not _is_itself(database, query):
        raise InputError(
            f"--exclude-recent: it is for a drive against itself, but"
            f" {_named(query)} is not {_named(database)}"
        )
    readings = Reading.each(
        2,
        lidar=lidar,
        odometry=odometry,
        poses=poses,
        columns=columns,
        pose_gap=pose_gap,
    )
    opened = open_pair(
        (database, query), readings, align, on_note, across_maps=across_maps
    )
    places, queries = drives = [_scans_of(one) for one in opened.drives]
    _check_returns(places, queries, protocol)
    overlaps = _overlaps(places, queries, protocol, exact_overlaps)
    chosen = (choice,)
    ((outcomes, _),) = measure_places(
        noting(on_note),
        PlaceComparison(
            (DriveData(lambda: places, asked_of_places(chosen, protocol)),),
            DriveData(lambda: queries, asked_of_queries(chosen, protocol)),
            chosen,
            protocol,
            (protocol.radius,),
            truth=overlaps,
            in_study=False,
        ),
    )
    outcomes = [replace(one, method=choice.name) for one in outcomes]
    (outcome,) = (
        one for one in outcomes if one.protocol.verified == protocol.verified
    )
    check_has_match(outcome)
    for text in (*_notes(made, drives), *_easy(outcome, drives, protocol)):
        on_note(text)
    if not outcome.outcomes.is_right.any() and (doubt := opened.world.doubt):
        on_note(f"{outcome.query}: no answer is right{doubt}")
    if protocol.exclude_recent is None and _is_itself(database, query):
        on_note(
            f"{_named(query)}: every scan finds itself (--exclude-recent leaves"
            " out recent places)"
        )
    height = dict(choice.settings).get("sensor_height")
    key = {
        task: pair_key(
            "pr",
            map_of(queries),
            (places.name, queries.name),
            task,
            protocol,
            # A text on the command line and a number are the same.
            {} if height is None else {"sensor_height": float(str(height))},
            factors,
        )
        for task in ("place", "pose")
    }
    return Recognition(
        {
            one.metric: one
            for task in key
            for one in outcome.numbers(task, mode=mode)
        },
        Results.of(
            row
            for task in key
            for one in outcomes
            for row in rows_of(one.numbers(task), key[task], opened.world)
        ),
        QueryRows.of(
            Answers(
                **key["place"],
                method=one.method,
                verified=one.protocol.verified,
                columns=one.outcomes.columns,
            )
            for one in outcomes
        ),
        opened.world,
        made,
        outcome,
        mode,
        overlaps,
    )


def _protocol(protocol: RetrievalProtocol | str) -> RetrievalProtocol:
    if isinstance(protocol, RetrievalProtocol):
        return protocol
    if protocol not in PROTOCOLS:
        fault = no_such("protocol", protocol, PROTOCOLS)
        raise InputError(f"protocol: {fault}")
    return PROTOCOLS[protocol]


def _choice(
    method: Method | MethodChoice | Path | str,
    settings: Mapping[str, Any],
    sensor_height: float,
) -> tuple[MethodChoice, dict[str, Any]]:
    """Returns the method with its settings, and the columns of these.

    The height of the sensor is in the digest of the protocol, and no column.
    """
    if isinstance(method, Method):
        if settings:
            raise InputError(
                "settings: this method was made with settings; make it with"
                f" {', '.join(settings)}, too"
            )
        changed = method.config.model_dump(exclude_defaults=True)
        given: MethodChoice = _MadeChoice(
            method.name, settings=tuple(changed.items()), made=method
        )
        choice = given
    else:
        if isinstance(method, MethodChoice):
            given = method
        else:
            given = choose_method(method)
        given = replace(given, settings=(*given.settings, *settings.items()))
        choice = given.at_height(sensor_height)
    columns = {name: as_factor(value) for name, value in given.columns.items()}
    return choice, columns


def _scans_of(opened: Drive | Path) -> CountedDrive:
    """Returns a drive that counts what is ignored of it."""
    if isinstance(opened, Path):
        raise InputError(f"{opened}: a point cloud, not a recorded drive")
    return CountedDrive(opened)


def _is_itself(database: Drive | Path | str, query: Drive | Path | str) -> bool:
    if isinstance(database, Drive) or isinstance(query, Drive):
        return database is query
    return Path(database).resolve() == Path(query).resolve()


def _named(given: Drive | Path | str) -> str:
    return given.name if isinstance(given, Drive) else str(given)


def _check_returns(
    places: Drive, queries: Drive, protocol: RetrievalProtocol
) -> None:
    """Refuses a drive that never returns, before its scans are described."""
    recent_s = protocol.exclude_recent
    if recent_s is None or protocol.overlap is not None:
        return
    rows, columns = compared_frames(places, queries, protocol)
    away = cdist(queries.X_WS[rows, :3, 3], places.X_WS[columns, :3, 3])
    age_ns = queries.stamps_ns[rows, None] - places.stamps_ns[columns]
    is_old = age_ns >= recent_s * NS_PER_S
    if not (is_old & (away.round(9) <= protocol.radius)).any():
        raise InputError(never_returns(queries.name, protocol))


def _overlaps(
    places: Drive,
    queries: Drive,
    protocol: RetrievalProtocol,
    exact_overlaps: Path | None,
) -> np.ndarray | None:
    """Returns the overlaps (Q, D) if matches are by overlap, otherwise None."""
    if exact_overlaps is not None:
        frames = compared_frames(places, queries, protocol)
        return read_overlaps(exact_overlaps, *frames)
    if protocol.overlap is not None:
        return overlap_matrix(places, queries, protocol)
    return None


def _easy(
    outcome: PlaceOutcome,
    drives: Sequence[Drive],
    protocol: RetrievalProtocol,
) -> list[str]:
    """Returns a note if every answer is right."""
    frames = outcome.place_frames, outcome.outcomes.columns["query_frame"]
    p, q = (one.X_WS[of, :3, 3] for one, of in zip(drives, frames, strict=True))
    if protocol.overlap is not None or cdist(p, q).max() > protocol.radius:
        return []
    return [
        f"{outcome.database}: every place lies within {protocol.radius:g} m of"
        " every query, so every answer is right (are the poses in metres?)"
    ]


def _notes(method: Method, drives: Iterable[CountedDrive]) -> list[str]:
    """Returns what the method assumes, and what was ignored of the scans."""
    assumptions = {method.assumption(one.lidar_field): None for one in drives}
    return [text for text in assumptions if text is not None] + [
        f"{drive.name}: {drive.num_ignored} {NOT_FINITE}"
        for drive in drives
        if drive.num_ignored
    ]
