"""Measures methods on one recording or on two."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from cns_drake.base.jobs.step import Reporter
from cns_drake.base.progress import track
from evaluation.drives import check_same_world
from evaluation.drives.sampling import gather
from evaluation.methods.method import Method
from evaluation.recognition.costs import query_ms
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

# Longest time for all queries at a size.
_LONGEST_MS = 3.6e6
# Places that no method is known to take so long for.
_MANY = 5000


def shown_overlaps(
    reporter: Reporter,
    scans: tuple[Part, Part],
    described: tuple[Part, Part],
    choice: MethodChoice,
    protocol: RetrievalProtocol,
    radii: tuple[float, ...],
) -> dict[float, np.ndarray]:
    """Returns how much of each query's scan its best match shows.

    Args:
        reporter: unused.
        scans: files with the scans of database and query: a `KeptScans`, or a
            list of them.
        described: files with a method's descriptions of both, for the poses.
        choice: the method.
        protocol: protocol by which the queries are shown.
        radii: radii of a match [m].

    Returns:
        Radius -> (Q,) overlaps; NaN without a match.
    """
    choice.make()  # It registers the type of its descriptions.
    (_, database), (_, query) = (part.read() for part in described)
    kept, asked = (part.read() for part in scans)
    if not isinstance(kept, list):
        kept = [
            gather(kept, frame, 1, protocol.max_range).astype(np.float32)
            for frame in database.places.frames.tolist()
        ]
    if not isinstance(asked, list):
        asked = [
            protocol.query_scan(asked, frame).astype(np.float32)
            for frame in query.queries.frames.tolist()
        ]
    return {
        radius: best_overlaps(
            kept,
            database.places.X_WS,
            asked,
            query.queries.X_WS,
            matches_within_radius(
                database, query, replace(protocol, radius=radius)
            ),
        )
        for radius in radii
    }


def measure_method(
    reporter: Reporter,
    database: Part,
    query: Part,
    distractors: tuple[Part, ...],
    num_distractors: int,
    choice: MethodChoice,
    overlaps: Part | None,
    protocol: RetrievalProtocol,
    radii: tuple[float, ...],
) -> list[PlaceOutcome]:
    """Returns the outcomes of one method, as `measure_places` does.

    Args:
        reporter: reports notes.
        database, query: files with the method's descriptions of the places and
            of the queries.
        distractors: for each drive through another city, the file with the
            method's descriptions of its places.
        num_distractors: see `measure_places`.
        choice: the method.
        overlaps: file with the result of `shown_overlaps`; None to leave
            overlaps unknown.
        protocol, radii: see `measure_places`.
    """
    # The method comes first, because it registers the type of its
    # descriptions.
    method = choice.make()
    (placed, mapped), (placed_query, asked) = database.read(), query.read()
    check_same_world(placed, placed_query, across_maps=True)
    shown = {} if overlaps is None else overlaps.read()
    searched, drives = crowded(mapped, distractors, num_distractors)
    return _compare(
        (choice, method),
        (searched, drives),
        asked,
        (protocol, radii),
        lambda radius, matches: shown.get(radius),
        reporter,
    )


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
    candidates. The second is with geometric verification, which rejects
    candidates that lie beyond the radius according to the method's own pose
    estimate.

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

        def shown(
            radius: float,
            matches: np.ndarray,
            mapped: DescribedDrive = mapped,
            asked: DescribedDrive = asked,
        ) -> np.ndarray:
            if radius not in overlaps:
                overlaps[radius] = best_overlaps(
                    place_scans,
                    mapped.places.X_WS,
                    query_scans,
                    asked.queries.X_WS,
                    matches[:, : len(place_scans)],
                )
            return overlaps[radius]

        outcomes += _compare(
            (choice, method),
            crowded(
                mapped, [parts[k] for parts in distractors], num_distractors
            ),
            asked,
            (protocol, radii),
            shown,
            reporter,
        )
    return outcomes


def _compare(
    chosen: tuple[MethodChoice, Method],
    database: tuple[DescribedDrive, list[str]],
    query: DescribedDrive,
    asked: tuple[RetrievalProtocol, tuple[float, ...]],
    shown: Callable[[float, np.ndarray], np.ndarray | None],
    reporter: Reporter,
) -> list[PlaceOutcome]:
    """Returns the outcomes of a method; none if it would take too long.

    Args:
        chosen: the method, as it was chosen and as it was made.
        database: the described places, and the name of each one's drive.
        query: the described queries.
        asked: the protocol, and radii of a match [m].
        shown: function that returns overlaps (Q,) of the queries for a radius
            and the matches (Q, D) within it.
        reporter: reports notes.
    """
    choice, method = chosen
    searched, drives = database
    protocol, radii = asked
    if len(searched.places.frames) > _MANY and _takes_long(
        method, searched, query
    ):
        reporter.note(f"{choice.name}: it would take over an hour")
        return []
    plain, *by_gate = compare_with_gates(
        method, searched, query, protocol, [None, *radii]
    )
    outcomes = []
    for radius, one in zip(radii, by_gate, strict=True):
        matches = (plain.distances <= radius) & plain.is_known
        overlaps = shown(radius, matches)
        outcomes += [
            PlaceOutcome.of(
                choice.key,
                method,
                replace(protocol, gate=is_gated, radius=radius),
                replace(found, matches=matches),
                (query.name, query.queries.stamps_ns, query.queries.p_WSs),
                drives,
                overlaps,
            )
            for is_gated, found in ((False, plain), (True, one))
        ]
    return outcomes


def _takes_long(
    method: Method,
    database: DescribedDrive,
    query: DescribedDrive,
) -> bool:
    one_ms = query_ms(method, database.places, query.queries)
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
    distractors: Sequence[Part],
    num_others: int,
) -> tuple[DescribedDrive, list[str]]:
    """Returns a database to which places of other cities are added.

    The drives through other cities are moved so far away that none of their
    places is a match. Their first `num_others` places are appended, or all if
    there are fewer.

    Args:
        database: a drive, with a method's descriptions of its places.
        distractors: for each drive through another city, the file with the
            same method's descriptions of its places.
        num_others: number of places to append.

    Returns:
        The database with all places; and for each place, the name of the drive
        from which it comes.
    """
    known = [database]
    for part in distractors:
        if sum(len(d.places.frames) for d in known[1:]) >= num_others:
            break
        known.append(part.read()[1])
    places = joined_scans(
        [one.places for one in known],
        range(len(known)),
        len(database.places.frames) + num_others,
    )
    drives = [one.name for one in known for _ in one.places.frames]
    return replace(database, places=places), drives
