"""Measures place recognition between two drives."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
import math
from typing import Any, NamedTuple

import numpy as np

from evaluation.base import Reporter, track
from evaluation.drives import cloud_at
from evaluation.methods import Method
from evaluation.recognition.chosen_methods import MethodChoice
from evaluation.recognition.describing import Role
from evaluation.recognition.descriptors import DriveDescriptors, joined_scans
from evaluation.recognition.drive_data import (
    Asked,
    Descriptors,
    DriveData,
    KeptScans,
    Scans,
)
from evaluation.recognition.overlap_truth import overlaps_with_best_match
from evaluation.recognition.place_outcome import PlaceOutcome, QueryDrive
from evaluation.recognition.place_selection import KEEP_ALL, kept_places
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import compare_at_radii
from evaluation.recognition.search import Search, SearchCost
from evaluation.recognition.stored_places import MOST_BYTES, StoredDrives

# A method that takes longer for all queries is left out [s].
_LONGEST = 3600.0
# Number of queries from which this time is estimated.
_NUM_TRIALS = 12
# With at most this number of places, no method is expected to take so long.
_MANY = 5000


class _Searched(NamedTuple):
    """A database that is searched: places of one drive or of several.

    Attributes:
        drives: name of each place's drive.
        drive_of: (D,) number of each place's drive.
        num_here: number of places in the query's own world; they come first.
    """

    described: DriveDescriptors
    drives: list[str]
    drive_of: np.ndarray
    num_here: int


@dataclass(frozen=True, eq=False)
class PlaceComparison:
    """What is compared with what, and how.

    Attributes:
        database: the drives of the places, from older to newer, of which
            `asked_of_places` has been asked.
        query: the drive of the queries, in the same world, of which
            `asked_of_queries` has been asked.
        methods: the methods.
        protocol: the protocol of the comparison; its field `radius` does not
            matter.
        radii: radii of a match [m].
        keep: which places of the database are kept, see
            `evaluation.recognition.place_selection.kept_places`.
        distractors: drives through other cities, of which descriptors of places
            have been asked.
        num_distractors: number of places of these drives that are added to the
            database.
        truth: (Q, D) overlap of each query with each place, if the protocol
            says that matches are by overlap.
        in_study: whether to leave out a method that would take more than an
            hour for all queries, and to find the costs of searches.
    """

    database: tuple[DriveData, ...]
    query: DriveData
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    radii: tuple[float, ...]
    keep: str | int = KEEP_ALL
    distractors: tuple[DriveData, ...] = ()
    num_distractors: int = 0
    truth: np.ndarray | None = None
    in_study: bool = True

    def searched(self, choice: MethodChoice, method: Method) -> _Searched:
        """Returns the database that a method searches.

        The drives through other cities come last. They are moved so far away
        that none of their places is a match; the first `num_distractors` of
        their places are added, or all if there are fewer.

        Args:
            choice: the method.
            method: the method. If it `divides`, descriptors that are too large
                for the memory are read while they are searched.
        """
        asked = Descriptors(choice, "places", self.protocol)
        num_near = len(self.database)
        readers, sizes = zip(
            *(one.reader(asked) for one in (*self.database, *self.distractors)),
            strict=True,
        )
        store = StoredDrives(
            readers, sizes, MOST_BYTES if method.divides else math.inf
        )
        near = [store.undescribed(k) for k in range(num_near)]
        here = joined_scans(near, [0] * num_near)
        lengths = [len(one.frames) for one in near]
        drive_of = np.repeat(np.arange(num_near), lengths)
        own_row = np.concatenate([np.arange(length) for length in lengths])
        cell = self.protocol.place_spacing
        rows = np.flatnonzero(
            kept_places(here.p_WSs, drive_of, self.keep, cell)
        )
        every = [here if len(rows) == len(drive_of) else here.chosen(rows)]
        stored = [drive_of[rows]]
        stored_rows = [own_row[rows]]
        most = len(rows) + self.num_distractors
        for k in range(num_near, len(readers)):
            if sum(map(len, stored)) >= most:
                break
            every.append(store.undescribed(k))
            stored_rows.append(np.arange(len(every[-1].frames)))
            stored.append(np.full(len(stored_rows[-1]), k))
        places = joined_scans(every, range(len(every)), most)
        of = np.concatenate(stored)[:most]
        return _Searched(
            DriveDescriptors(
                store.name(0),
                store.described(places, of, np.concatenate(stored_rows)[:most]),
                here.chosen(np.arange(0)),
            ),
            [store.name(k) for k in of.tolist()],
            of,
            len(rows),
        )


def asked_of_places(
    methods: Sequence[MethodChoice], protocol: RetrievalProtocol
) -> tuple[Asked, ...]:
    """Returns what is asked of a drive whose places are compared."""
    scans = Scans(protocol.place_spacing, protocol.half_extent)
    return (*_descriptors(methods, "places", protocol), scans)


def asked_of_queries(
    methods: Sequence[MethodChoice], protocol: RetrievalProtocol
) -> tuple[Asked, ...]:
    """Returns what is asked of a drive whose queries are compared."""
    scans = Scans(protocol.query_spacing, protocol.half_extent)
    return (*_descriptors(methods, "queries", protocol), scans)


def _descriptors(
    methods: Sequence[MethodChoice], role: Role, protocol: RetrievalProtocol
) -> list[Descriptors]:
    return [Descriptors(one, role, protocol) for one in methods]


@dataclass
class _ShownOverlaps:
    """How much of each query's scan its best match shows, for all methods.

    Matches follow from the positions of the scans and not from a method, so
    that overlaps are computed once.
    """

    compared: PlaceComparison
    _known: dict[tuple[float, range], np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        compared = self.compared
        protocol = compared.protocol
        places = Scans(protocol.place_spacing, protocol.half_extent)
        queries = Scans(protocol.query_spacing, protocol.half_extent)
        # Read when the first overlap is computed.
        self._places = cache(
            lambda: [one.take(places) for one in compared.database]
        )
        self._queries = cache(lambda: compared.query.take(queries))

    def of(
        self,
        radius: float,
        rows: range,
        matches: np.ndarray,
        database: _Searched,
        query: DriveDescriptors,
    ) -> np.ndarray:
        """Returns the overlaps (R,) of some queries; NaN without a match.

        Args:
            radius: radius of a match [m].
            rows: numbers of the R queries.
            matches: (R, D) whether a place is a true match.
            database, query: places and queries, described by any method.
        """
        if (radius, rows) in self._known:
            return self._known[radius, rows]
        protocol, queries = self.compared.protocol, query.queries
        batch = slice(rows.start, rows.stop)
        asked = [
            protocol.query_scan(self._queries(), frame).astype(np.float32)
            for frame in queries.frames[batch].tolist()
        ]
        places, here = database.described.places, database.num_here
        shown = np.full(len(asked), math.nan)
        for number, kept in enumerate(self._places()):
            of = np.flatnonzero(database.drive_of[:here] == number)
            scans = _CroppedScans(kept, places.frames[of], protocol.half_extent)
            (found,) = overlaps_with_best_match(
                scans,
                places.X_WS[of],
                asked,
                queries.X_WS[batch],
                matches[None, :, of],
            )
            shown = np.fmax(shown, found)
        self._known[radius, rows] = shown
        return shown


class _CroppedScans(Sequence[np.ndarray]):
    """Scans (N, 3) float32 of some frames, cropped when they are used."""

    def __init__(self, kept: KeptScans, frames: np.ndarray, half_extent: float):
        # A drive as far as its scans are concerned.
        self._kept: Any = kept
        self._frames = frames
        self._half_extent = half_extent

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, index: Any) -> Any:
        frame = int(self._frames[index])
        cloud = cloud_at(self._kept, frame, 1, self._half_extent)
        return cloud.astype(np.float32)


def measure_places(
    reporter: Reporter, compared: PlaceComparison
) -> Iterator[tuple[list[PlaceOutcome], SearchCost | None]]:
    """Yields the outcomes of each method, and in a study what its search costs.

    There are two outcomes for each radius of a match. The first counts all
    candidates. The second is with geometric verification, which rejects
    candidates that lie beyond the radius according to the method's own pose
    estimate.

    Args:
        reporter: reports progress and notes.
        compared: the drives, the methods and the protocol.

    Raises:
        InputError: a drive cannot be read, the drives are not in one world, or
            a method returns an invalid result.
    """
    methods, protocol = compared.methods, compared.protocol
    shown = _ShownOverlaps(compared)
    for choice in track(methods, "comparing", len(methods), "methods"):
        # The method comes first, because it registers the type of its
        # descriptors.
        method = choice.make()
        asked = compared.query.take(Descriptors(choice, "queries", protocol))
        searched = compared.searched(choice, method)
        search = Search(method, searched.described.places)
        outcomes = _method_outcomes(
            choice, search, searched, asked, compared, shown, reporter
        )
        yield outcomes, search.cost(choice.key) if compared.in_study else None


def _method_outcomes(
    choice: MethodChoice,
    search: Search,
    database: _Searched,
    query: DriveDescriptors,
    compared: PlaceComparison,
    shown: _ShownOverlaps,
    reporter: Reporter,
) -> list[PlaceOutcome]:
    """Returns a method's outcomes; none if the method would take too long.

    Args:
        search: the method's search in the database.
        database: the places that are searched.
        shown: how much of each query its best match shows.
    """
    searched, drives, _, num_here = database
    protocol, radii = compared.protocol, compared.radii
    truth = compared.truth
    if (
        compared.in_study
        and len(searched.places.frames) > _MANY
        and _takes_long(search, query, len(searched.places.frames))
    ):
        reporter.note(
            f"{choice.name}: left out, because it would take over an hour"
        )
        return []
    # For each radius, without and with geometric verification: the outcomes of
    # each batch of queries.
    outcomes: list[list[PlaceOutcome]] = [[] for _ in range(2 * len(radii))]
    for rows, (plain, *by_radius) in compare_at_radii(
        search,
        searched,
        query,
        protocol,
        [None, *radii],
        truth,
    ):
        batch = slice(rows.start, rows.stop)
        asked = QueryDrive(
            query.name,
            query.queries.stamps_ns[batch],
            query.queries.p_WSs[batch],
        )
        for k, (radius, verified) in enumerate(
            zip(radii, by_radius, strict=True)
        ):
            matches = plain.matches
            if truth is None:
                matches = (plain.distances <= radius) & plain.is_known
            overlaps = shown.of(radius, rows, matches, database, query)
            for is_verified, found in enumerate((plain, verified)):
                outcomes[2 * k + is_verified].append(
                    PlaceOutcome.of(
                        choice.key,
                        search.method,
                        replace(
                            protocol, verified=bool(is_verified), radius=radius
                        ),
                        replace(found, matches=matches),
                        asked,
                        drives,
                        overlaps,
                        num_here,
                    )
                )
    return [PlaceOutcome.joined(batches) for batches in outcomes]


def _takes_long(
    search: Search, query: DriveDescriptors, num_places: int
) -> bool:
    number = len(query.queries.frames)
    rows = np.linspace(0, number - 1, min(number, _NUM_TRIALS)).astype(int)
    is_known = np.ones((len(rows), num_places), bool)
    search.scores(query, rows.tolist(), is_known)
    return number * search.query_time > _LONGEST
