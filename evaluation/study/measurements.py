"""Measures methods on one recording or on two."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from threadpoolctl import threadpool_limits

from cns_drake.base.jobs.step import Reporter
from cns_drake.base.progress import track
from evaluation.drives import check_same_world
from evaluation.drives.drive_views import MovedDrive
from evaluation.drives.sampling import gather
from evaluation.methods.method import Method
from evaluation.recognition.costs import Cost, measure_cost, query_ms
from evaluation.recognition.description import (
    DescribedDrive,
    Role,
    joined_scans,
)
from evaluation.recognition.overlap_truth import best_overlaps
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import (
    compare_with_gates,
    matches_within_radius,
)
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.parts import Part
from evaluation.study.surveys import (
    DriveSource,
    describe_recording,
)

# The source of a drive, or the parts of its scans and of its descriptions by
# each method.
DescribedSource: TypeAlias = "DriveSource | tuple[Part, ...]"

# Queries whose time is measured, and the longest time for all queries at a size
# [ms].
TIMED = 9
_LONGEST_MS = 3.6e6
# Places that no method is known to take so long for.
_MANY = 5000
# Number of clouds and of queries whose costs are measured; the time of the
# first does not count.
_NUM_TRIALS = 12


def recognise_places(
    reporter: Reporter,
    described: tuple[Part, Part],
    overlaps: Part | None,
    choice: MethodChoice,
    protocol: RetrievalProtocol,
) -> list[PlaceOutcome]:
    """Returns a method's outcomes on two drives, without and with the gate.

    Args:
        reporter: reports notes.
        described: files with the descriptions of the database and of the query.
        overlaps: file with the result of `shown_overlaps`; None if overlaps
            are not asked for.
        choice: the method.
        protocol: protocol of the comparison.
    """
    # The method comes first, because it registers the type of its
    # descriptions.
    method = choice.make()
    (placed, database), (placed_query, query) = (p.read() for p in described)
    check_same_world(placed, placed_query)
    both = compare_with_gates(
        method, database, query, protocol, [None, protocol.radius]
    )
    if not both[0].matches.any():
        # Routes need not meet, nor close a loop.
        reporter.note(
            f"{query.name}: no query lies within {protocol.radius:g} m of a"
            f" place of {database.name}"
        )
    shown = None if overlaps is None else overlaps.read()
    return [
        PlaceOutcome.of(
            choice.key,
            method,
            replace(protocol, gate=is_gated),
            one,
            (query.name, query.queries.stamps_ns, query.queries.p_WSs),
            [database.name] * len(one.database_frames),
            shown,
        )
        for is_gated, one in zip((False, True), both, strict=True)
    ]


def outcomes_of(
    reporter: Reporter, results: tuple[Part, ...]
) -> list[PlaceOutcome]:
    """Returns the outcomes in several files."""
    return [one for part in results for one in part.read()]


def shown_overlaps(
    reporter: Reporter,
    scans: tuple[Part, Part],
    described: tuple[Part, Part],
    choice: MethodChoice,
    protocol: RetrievalProtocol,
) -> np.ndarray:
    """Returns how much of each query's scan its best match shows, (Q,).

    Args:
        reporter: unused.
        scans: files with the scans (`KeptDrive`) of database and query.
        described: files with a method's descriptions of both, for the poses.
        choice: the method.
        protocol: protocol by which the queries are shown.
    """
    choice.make()  # It registers the type of its descriptions.
    kept, asked = (part.read() for part in scans)
    (_, database), (_, query) = (part.read() for part in described)
    return best_overlaps(
        [
            gather(kept, frame, 1, protocol.max_range).astype(np.float32)
            for frame in database.places.frames.tolist()
        ],
        database.places.X_WS,
        [
            protocol.query_scan(asked, frame).astype(np.float32)
            for frame in query.queries.frames.tolist()
        ],
        query.queries.X_WS,
        matches_within_radius(database, query, protocol),
    )


def measure_costs(
    reporter: Reporter,
    source: DriveSource,
    surveyed: Part,
    methods: tuple[MethodChoice, ...],
    described: tuple[tuple[Part, Part], ...],
    protocol: RetrievalProtocol,
) -> list[Cost]:
    """Returns the time and memory that each method needs on one core.

    Args:
        reporter: reports progress.
        source: opens the query drive.
        surveyed: file with the `SurveyedDrive` of the query drive, from which
            the drive's poses are read.
        methods: the methods.
        described: files with each method's descriptions of a database and of
            the query.
        protocol: protocol of the comparison.
    """
    drive, known = source(), surveyed.read()
    # A recording would be unpacked as a whole for its poses.
    drive = MovedDrive(drive, known.X_WS, drive.world_frame, drive.datum)
    costs = []
    with threadpool_limits(limits=1):
        for choice, parts in track(
            zip(methods, described, strict=True),
            "measuring costs",
            len(methods),
            "methods",
        ):
            method = choice.make()
            number = protocol.scans(method)
            last = max(len(drive) - number, 0)
            frames = np.linspace(0, last, _NUM_TRIALS).astype(int).tolist()
            clouds = [
                gather(
                    drive,
                    frame,
                    number,
                    protocol.max_range,
                    method.point_fields,
                    protocol.scans_before(method),
                )
                for frame in frames
            ]
            (_, database), (_, query) = (part.read() for part in parts)
            costs.append(
                measure_cost(
                    method,
                    clouds,
                    number,
                    database,
                    query,
                    protocol.gate_radius,
                )
            )
    return costs


def measure_places(
    reporter: Reporter,
    database: DescribedSource,
    query: DescribedSource,
    distractors: tuple[tuple[Part, ...], ...],
    num_distractors: int,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    radii: tuple[float, ...],
) -> list[PlaceOutcome]:
    """Returns the outcomes of methods, for several radii of a match.

    There are two outcomes for each method and radius. The first counts all
    candidates. For the second (with the gate), candidates are rejected that lie
    beyond the radius according to the method's own pose estimate.

    A method that would take more than an hour for all queries is left out.

    Args:
        reporter: reports progress.
        database: the drive of the places: either the source from which its
            scans are read, or the files that already contain its scans and each
            method's descriptions of them.
        query: the drive of the queries, in the same world, like `database`.
        distractors: for each drive through another city, and for each method,
            the file with the method's descriptions of its places.
        num_distractors: number of places of these drives that are added to the
            database.
        methods: the methods.
        protocol: the protocol of the comparison; its own radius does not
            matter.
        radii: radii of a match [m].
    """
    place_scans, places = _describe(
        database, "places", methods, protocol, reporter
    )
    query_scans, queries = _describe(
        query, "queries", methods, protocol, reporter
    )
    overlaps: dict[float, np.ndarray] = {}
    outcomes = []
    for k, choice in enumerate(
        track(methods, "comparing", len(methods), "methods")
    ):
        method = choice.make()
        mapped, asked = places(k), queries(k)
        searched, drives = crowded(mapped, distractors, k, num_distractors)
        if len(searched.places.frames) > _MANY and _takes_long(
            method, searched, asked
        ):
            reporter.note(f"{choice.name}: it would take over an hour")
            continue
        plain, *by_gate = compare_with_gates(
            method, searched, asked, protocol, [None, *radii]
        )
        for radius, one in zip(radii, by_gate, strict=True):
            matches = (plain.distances <= radius) & plain.is_known
            if radius not in overlaps:
                overlaps[radius] = best_overlaps(
                    place_scans,
                    mapped.places.X_WS,
                    query_scans,
                    asked.queries.X_WS,
                    matches[:, : len(place_scans)],
                )
            outcomes += [
                PlaceOutcome.of(
                    choice.key,
                    method,
                    replace(protocol, gate=is_gated, radius=radius),
                    replace(found, matches=matches),
                    (
                        asked.name,
                        asked.queries.stamps_ns,
                        asked.queries.p_WSs,
                    ),
                    drives,
                    overlaps[radius],
                )
                for is_gated, found in ((False, plain), (True, one))
            ]
    return outcomes


def _takes_long(
    method: Method,
    database: DescribedDrive,
    query: DescribedDrive,
) -> bool:
    one_ms = query_ms(
        method, database.places, query.queries, TIMED + 1, with_pose=False
    )
    return one_ms * len(query.queries.frames) > _LONGEST_MS


def _describe(
    drive: DescribedSource,
    role: Role,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    reporter: Reporter,
) -> tuple[list[np.ndarray], Callable[[int], DescribedDrive]]:
    """Returns a drive's scans, and a function that returns its descriptions.

    The function takes the number of a method. Call it only once for each
    method, because it frees the description.
    """
    if isinstance(drive, tuple):
        scans, *parts = drive
        return scans.read(), lambda k: parts[k].read()[1]
    asked = {one.key: (one.make(), {role}, protocol) for one in methods}
    found = describe_recording(drive(), {role}, asked, protocol)
    assert isinstance(found.scans, list)
    return found.scans, lambda k: found.described.pop(methods[k].key)


def crowded(
    database: DescribedDrive,
    distractors: tuple[tuple[Part, ...], ...],
    method: int,
    num_others: int,
) -> tuple[DescribedDrive, list[str]]:
    """Returns a database to which places of other cities are added.

    The drives through other cities are moved so far away that none of their
    places is a match. Their first `num_others` places are appended, or all if
    there are fewer.

    Args:
        database: a drive, with a method's descriptions of its places.
        distractors: for each drive through another city, one file per method
            with the descriptions of its places.
        method: index of the method in these files.
        num_others: number of places to append.

    Returns:
        The database with all places; and for each place, the name of the drive
        from which it comes.
    """
    known = [database]
    for parts in distractors:
        if sum(len(d.places.frames) for d in known[1:]) >= num_others:
            break
        known.append(parts[method].read()[1])
    places = joined_scans(
        [one.places for one in known],
        range(len(known)),
        len(database.places.frames) + num_others,
    )
    drives = [one.name for one in known for _ in one.places.frames]
    return replace(database, places=places), drives
