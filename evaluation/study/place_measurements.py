"""Measures place recognition between two drives."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
import math
from typing import Protocol, TypeAlias

import numpy as np

from cns_drake.base.jobs.step import Reporter
from cns_drake.base.progress import track
from evaluation.drives import check_same_world
from evaluation.drives.scan_clouds import cloud_at
from evaluation.methods.method import Method
from evaluation.recognition.costs import query_ms
from evaluation.recognition.describing import Role
from evaluation.recognition.descriptors import DriveDescriptors
from evaluation.recognition.kept_places import KEEP_ALL
from evaluation.recognition.overlap_truth import overlaps_with_best_match
from evaluation.recognition.place_outcome import PlaceOutcome, QueryDrive
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import (
    compare_with_gates,
    matches_within_radius,
)
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.databases import Searched, searched_database
from evaluation.study.feature_extraction import describe_recording
from evaluation.study.sources import DriveSource
from evaluation.study.storage.parts import Part

# The source of a drive, or the parts of its scans and of its descriptors by
# each method.
DescribedSource: TypeAlias = "DriveSource | tuple[Part, ...]"

# A method that takes longer for all queries is left out [ms].
_LONGEST_MS = 3.6e6
# With at most this number of places, no method is expected to take so long.
_MANY = 5000


def shown_overlaps(
    reporter: Reporter,
    scans: tuple[Part, Part],
    described: tuple[Part, Part],
    choice: MethodChoice,
    protocol: RetrievalProtocol,
    radii: tuple[float, ...],
    beside: tuple[tuple[Part, Part], ...] = (),
    leaves_out_itself: bool = False,
    keep: str | int = KEEP_ALL,
) -> dict[float, np.ndarray]:
    """Returns the share of each query's scan that its best match shows.

    Args:
        reporter: unused.
        scans: files with the scans of database and query: a `KeptScans`, or a
            list of scans.
        described: files with a method's descriptors of database and query, from
            which the poses are read.
        choice: the method.
        protocol: protocol that says how the scans of queries are changed.
        radii: radii of a match [m].
        beside: files with the scans of further drives in the same world, and
            with a method's descriptors of their places.
        leaves_out_itself, keep: see `Pair`.

    Returns:
        Radius -> (Q,) overlaps; NaN without a match.
    """
    choice.make()  # It registers the type of its descriptors.
    _, query = described[1].read()
    asked = scans[1].read()
    if not isinstance(asked, list):
        asked = [
            protocol.query_scan(asked, frame).astype(np.float32)
            for frame in query.queries.frames.tolist()
        ]
    searched = searched_database(
        described[0],
        (),
        0,
        [places for _, places in beside],
        keep,
        protocol.place_spacing,
        divides=True,
    )
    database = searched.described
    names = searched.drives
    allowed = _other_places(query, names) if leaves_out_itself else True
    matches = {
        radius: matches_within_radius(
            database, query, replace(protocol, radius=radius)
        )
        & allowed
        for radius in radii
    }
    found = {radius: np.full(len(asked), math.nan) for radius in radii}
    drive_of = database.places.drive_of
    if drive_of is None:
        drive_of = np.zeros(len(searched.rows), np.int64)
    # The scans of one drive are in memory at a time.
    first = 0
    for number, (part, _) in enumerate([(scans[0], None), *beside]):
        of = drive_of == number
        kept = part.read()
        if isinstance(kept, list):
            chosen = [kept[row] for row in searched.rows[of] - first]
            first += len(kept)
        else:
            chosen = [
                cloud_at(kept, frame, 1, protocol.max_range).astype(np.float32)
                for frame in database.places.frames[of].tolist()
            ]
        for radius in radii:
            shown = overlaps_with_best_match(
                chosen,
                database.places.X_WS[of],
                asked,
                query.queries.X_WS,
                matches[radius][:, of],
            )
            found[radius] = np.fmax(found[radius], shown)
    return found


def measure_method(
    reporter: Reporter,
    database: Part,
    query: Part,
    distractors: tuple[Part, ...],
    num_distractors: int,
    choice: MethodChoice,
    overlaps: Part,
    protocol: RetrievalProtocol,
    radii: tuple[float, ...],
    beside: tuple[Part, ...] = (),
    leaves_out_itself: bool = False,
    keep: str | int = KEEP_ALL,
) -> list[PlaceOutcome]:
    """Returns the outcomes of one method, as `measure_places` does.

    Args:
        reporter: reports notes.
        database, query: files with the method's descriptors of the places and
            of the queries.
        distractors: for each drive through another city, the file with the
            method's descriptors of its places.
        num_distractors: see `measure_places`.
        choice: the method.
        overlaps: file with the result of `shown_overlaps`.
        protocol, radii: see `measure_places`.
        beside: files with the method's descriptors of the places of further
            drives in the same world.
        leaves_out_itself, keep: see `Pair`.
    """
    # The method comes first, because it registers the type of its
    # descriptors.
    method = choice.make()
    placed, (placed_query, asked) = database.read()[0], query.read()
    check_same_world(placed, placed_query, across_maps=True)
    shown = overlaps.read()
    return _method_outcomes(
        choice,
        method,
        searched_database(
            database,
            distractors,
            num_distractors,
            beside,
            keep,
            protocol.place_spacing,
            divides=method.divides,
        ),
        asked,
        protocol,
        radii,
        lambda radius, matches: shown.get(radius),
        reporter,
        leaves_out_itself=leaves_out_itself,
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
    truth: np.ndarray | None = None,
    leaves_out_slow: bool = True,
) -> list[PlaceOutcome]:
    """Returns the outcomes of methods, for several radii of a match.

    There are two outcomes for each method and radius. The first counts all
    candidates. The second is with geometric verification, which rejects
    candidates that lie beyond the radius according to the method's own pose
    estimate.

    Args:
        reporter: reports progress.
        database: the drive of the places: either the source from which its
            scans are read, or the files that already contain its scans and each
            method's descriptors of them.
        query: the drive of the queries, in the same world, like `database`.
        distractors: for each drive through another city, and for each method,
            the file with the method's descriptors of its places.
        num_distractors: number of places of the drives in `distractors` that
            are added to the database.
        methods: the methods.
        protocol: the protocol of the comparison; its field `radius` does not
            matter.
        radii: radii of a match [m].
        truth: (Q, D) overlap of each query with each place, if the protocol
            says that matches are by overlap.
        leaves_out_slow: whether to leave out a method that would take more than
            an hour for all queries.
    """
    places = _described_drive(database, "places", methods, protocol)
    queries = _described_drive(query, "queries", methods, protocol)
    overlaps: dict[float, np.ndarray] = {}
    outcomes = []
    for k, choice in enumerate(
        track(methods, "comparing", len(methods), "methods")
    ):
        method = choice.make()
        mapped, asked = places.take(k), queries.take(k)
        outcomes += _method_outcomes(
            choice,
            method,
            searched_database(
                mapped,
                [parts[k] for parts in distractors],
                num_distractors,
                divides=method.divides,
            ),
            asked,
            protocol,
            radii,
            partial(
                _overlaps_of_matches,
                overlaps,
                places.scans,
                queries.scans,
                mapped,
                asked,
            ),
            reporter,
            truth,
            leaves_out_slow=leaves_out_slow,
        )
    return outcomes


def _overlaps_of_matches(
    overlaps: dict[float, np.ndarray],
    place_scans: list[np.ndarray],
    query_scans: list[np.ndarray],
    database: DriveDescriptors,
    query: DriveDescriptors,
    radius: float,
    matches: np.ndarray,
) -> np.ndarray:
    """Returns the share of each query's scan that its best match shows, (Q,).

    Matches follow from the positions of the scans, and not from a method. The
    overlaps of a radius are therefore computed once for all methods.

    Args:
        overlaps: radius -> known overlaps; new overlaps are added here.
        place_scans: scans of the P places of the drive itself, which come first
            in the database.
        query_scans: scans of the Q queries.
        database: the described places.
        query: the described queries.
        radius: radius of a match [m].
        matches: (Q, D) which places match the queries within the radius.
    """
    if radius not in overlaps:
        overlaps[radius] = overlaps_with_best_match(
            place_scans,
            database.places.X_WS,
            query_scans,
            query.queries.X_WS,
            matches[:, : len(place_scans)],
        )
    return overlaps[radius]


def _method_outcomes(
    choice: MethodChoice,
    method: Method,
    database: Searched,
    query: DriveDescriptors,
    protocol: RetrievalProtocol,
    radii: tuple[float, ...],
    shown: Callable[[float, np.ndarray], np.ndarray | None],
    reporter: Reporter,
    truth: np.ndarray | None = None,
    *,
    leaves_out_itself: bool = False,
    leaves_out_slow: bool = True,
) -> list[PlaceOutcome]:
    """Returns a method's outcomes; none if the method would take too long.

    Args:
        choice: the method, as it was chosen.
        method: the method, as it was made.
        database: the places that are searched.
        query: the described queries.
        protocol, radii: see `measure_places`.
        shown: function that takes a radius, and the matches (Q, D) within this
            radius, and returns the overlaps (Q,) of the queries.
        reporter: reports notes.
        truth, leaves_out_slow: see `measure_places`.
        leaves_out_itself: see `Pair`.
    """
    searched, drives, num_here, _ = database
    if (
        leaves_out_slow
        and len(searched.places.frames) > _MANY
        and _takes_long(method, searched, query)
    ):
        reporter.note(
            f"{choice.name}: left out, because it would take over an hour"
        )
        return []
    plain, *by_gate = compare_with_gates(
        method,
        searched,
        query,
        protocol,
        [None, *radii],
        truth,
        _other_places(query, drives) if leaves_out_itself else None,
    )
    outcomes = []
    for radius, one in zip(radii, by_gate, strict=True):
        matches = plain.matches
        if truth is None:
            matches = (plain.distances <= radius) & plain.is_known
        overlaps = shown(radius, matches)
        outcomes += [
            PlaceOutcome.of(
                choice.key,
                method,
                replace(protocol, gate=is_gated, radius=radius),
                replace(found, matches=matches),
                QueryDrive(
                    query.name, query.queries.stamps_ns, query.queries.p_WSs
                ),
                drives,
                overlaps,
                num_here,
            )
            for is_gated, found in ((False, plain), (True, one))
        ]
    return outcomes


def _other_places(query: DriveDescriptors, drives: Sequence[str]) -> np.ndarray:
    """Returns (Q, D) bool, all places but the place of the query's scan."""
    return ~np.eye(len(query.queries.frames), len(drives), dtype=bool)


def _takes_long(
    method: Method,
    database: DriveDescriptors,
    query: DriveDescriptors,
) -> bool:
    one_ms = query_ms(method, database.places, query)
    return one_ms * len(query.queries.frames) > _LONGEST_MS


class _DescribedDrive(Protocol):
    """The scans of a drive's places or queries, and their descriptors.

    Attributes:
        scans: the scans, in the order of the places or queries.
    """

    scans: list[np.ndarray]

    def take(self, number: int) -> DriveDescriptors:
        """Returns the descriptors by one method, and keeps no copy of them.

        Only the descriptors of a method that is compared should be in memory.
        Call this function only once for each method.

        Args:
            number: number of the method.
        """


class _StoredDrive:
    """A drive whose scans and descriptors are in files."""

    def __init__(self, scans: Part, *described: Part):
        """Reads the scans.

        Args:
            scans: file with the scans.
            described: for each method, the file with its descriptors.
        """
        self.scans: list[np.ndarray] = scans.read()
        self._described = described

    def take(self, number: int) -> DriveDescriptors:
        return self._described[number].read()[1]


class _ReadDrive:
    """A drive whose scans are read and described at once."""

    def __init__(
        self,
        source: DriveSource,
        role: Role,
        methods: tuple[MethodChoice, ...],
        protocol: RetrievalProtocol,
    ):
        """Reads and describes the scans.

        Args:
            source: opens the drive.
            role: role of the scans.
            methods: the methods that describe the scans.
            protocol: the protocol of the comparison.
        """
        asked = {one.key: (one.make(), {role}, protocol) for one in methods}
        found = describe_recording(source(), {role}, asked, protocol)
        self.scans = found.shown_scans
        self._described = found.described
        self._methods = methods

    def take(self, number: int) -> DriveDescriptors:
        return self._described.pop(self._methods[number].key)


def _described_drive(
    drive: DescribedSource,
    role: Role,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
) -> _DescribedDrive:
    """Returns a drive's scans and descriptors, from files if there are any."""
    if isinstance(drive, tuple):
        return _StoredDrive(*drive)
    return _ReadDrive(drive, role, methods, protocol)
