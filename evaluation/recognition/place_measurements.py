"""Measures place recognition between two drives."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
import math
from typing import NamedTuple, TypeAlias

import numpy as np

from evaluation.base import LongList, Part, Reporter, track
from evaluation.drives import Drive, cloud_at
from evaluation.methods import Method
from evaluation.recognition.chosen_methods import MethodChoice
from evaluation.recognition.describing import Role
from evaluation.recognition.descriptors import DriveDescriptors, joined_scans
from evaluation.recognition.features import KeptScans, describe_recording
from evaluation.recognition.overlap_truth import overlaps_with_best_match
from evaluation.recognition.place_outcome import PlaceOutcome, QueryDrive
from evaluation.recognition.place_selection import KEEP_ALL, kept_places
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import (
    compare_at_radii,
    matches_within_radius,
    query_batches,
)
from evaluation.recognition.search import Search, SearchCost
from evaluation.recognition.stored_places import MOST_BYTES, StoredDrives

# A function that opens a drive, such as a `DriveSource`; or the parts of its
# scans and of its descriptors by each method.
DescribedSource: TypeAlias = "Callable[[], Drive] | tuple[Part, ...]"

# A method that takes longer for all queries is left out [s].
_LONGEST = 3600.0
# Number of queries from which this time is estimated.
_NUM_TRIALS = 12
# With at most this number of places, no method is expected to take so long.
_MANY = 5000


class _Searched(NamedTuple):
    """A database that is searched: places of one drive or of several.

    Attributes:
        described: the described places.
        drives: name of each place's drive.
        num_here: number of places in the query's own world; they come first.
        rows: (num_here,) for each of the first `num_here` places, its index
            among all places of the drives through the query's world. (The
            database may contain only some of these places.)
    """

    described: DriveDescriptors
    drives: list[str]
    num_here: int
    rows: np.ndarray


class PlaceComparison(NamedTuple):
    """What is compared with what, and how.

    Attributes:
        database: the drive of the places: either the source from which its
            scans are read, or the files that already contain its scans and each
            method's descriptors of them.
        query: the drive of the queries, in the same world, like `database`.
        methods: the methods.
        protocol: the protocol of the comparison; its field `radius` does not
            matter.
        radii: radii of a match [m].
        distractors: for each drive through another city, and for each method,
            the file with the method's descriptors of its places.
        num_distractors: number of places of the drives in `distractors` that
            are added to the database.
        beside: the files of further drives in the same world, like the files of
            `database`.
        keep: see `Pair`.
        truth: (Q, D) overlap of each query with each place, if the protocol
            says that matches are by overlap.
        overlaps: file with the share of each query's scan that its best match
            shows, the result of `shown_overlaps`; None to compute it from the
            scans.
        in_study: whether to leave out a method that would take more than an
            hour for all queries, and to find the costs of searches.
    """

    database: DescribedSource
    query: DescribedSource
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    radii: tuple[float, ...]
    distractors: tuple[tuple[Part, ...], ...] = ()
    num_distractors: int = 0
    beside: tuple[tuple[Part, ...], ...] = ()
    keep: str | int = KEEP_ALL
    truth: np.ndarray | None = None
    overlaps: Part | None = None
    in_study: bool = True

    def by_methods(self, numbers: Collection[int]) -> "PlaceComparison":
        """Returns the comparison by some methods, given their numbers."""

        def of(drive: tuple[Part, ...]) -> tuple[Part, ...]:
            scans, *described = drive
            return scans, *(described[k] for k in numbers)

        database, query = (
            of(one) if isinstance(one, tuple) else one
            for one in (self.database, self.query)
        )
        return self._replace(
            database=database,
            query=query,
            methods=tuple(self.methods[k] for k in numbers),
            distractors=tuple(
                tuple(parts[k] for k in numbers) for parts in self.distractors
            ),
            beside=tuple(map(of, self.beside)),
        )

    @property
    def stored(self) -> tuple[tuple[Part, ...], tuple[Part, ...]]:
        """The files of both drives, which must be in files."""
        assert isinstance(self.database, tuple)
        assert isinstance(self.query, tuple)
        return self.database, self.query

    def searched(
        self, number: int, database: DriveDescriptors | Part, method: Method
    ) -> _Searched:
        """Returns the database that a method searches.

        The places of further drives in the same world follow those of
        `database`. The drives through other cities come last. They are moved so
        far away that none of their places is a match; the first
        `num_distractors` of their places are added, or all if there are fewer.

        Args:
            number: number of the method.
            database: the method's descriptors of the drive of the places.
            method: the method. If it `divides`, descriptors that are too large
                for the memory are read while they are searched.
        """
        further = [parts[1 + number] for parts in self.beside]
        num_near = 1 + len(further)
        further += [parts[number] for parts in self.distractors]
        if isinstance(database, Part):
            reader, size = database.read, database.size()
        else:
            reader = partial(replace, database)
            size = getattr(database.places.descriptors, "num_bytes", 0)
        store = StoredDrives(
            [reader, *(one.read for one in further)],
            [size, *(one.size() for one in further)],
            MOST_BYTES if method.divides else math.inf,
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
        for k in range(num_near, 1 + len(further)):
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
            len(rows),
            rows,
        )


@dataclass(frozen=True)
class ScansOf:
    """The scans of a comparison by any method, for `shown_overlaps`.

    Attributes:
        compared: the comparison; the poses of the scans are read from the
            descriptors of its first method.
    """

    compared: PlaceComparison

    def identity(self) -> list[object]:
        """Returns what determines scans and poses; other methods share them."""
        compared = self.compared
        (scans, *_), (asked, *_) = compared.stored
        files = scans, asked, *(parts[0] for parts in compared.beside)
        protocol = compared.protocol.of(compared.methods[0].make())
        return [
            [one.identity() for one in files],
            protocol.to_json(),
            list(compared.radii),
            compared.keep,
        ]


def shown_overlaps(
    reporter: Reporter, scans_of: ScansOf
) -> dict[float, np.ndarray]:
    """Returns the share of each query's scan that its best match shows.

    Args:
        reporter: unused.
        scans_of: the scans. Their files contain a `KeptScans`, or a list of
            scans.

    Returns:
        Radius -> (Q,) overlaps; NaN without a match.
    """
    compared = scans_of.compared.by_methods([0])
    # The method registers the type of its descriptors.
    method = compared.methods[0].make()
    (scans, described), (asked_scans, described_query) = compared.stored
    protocol, radii = compared.protocol, compared.radii
    query = described_query.read()
    queries = query.queries
    asked = asked_scans.read()
    are_recorded = isinstance(asked, KeptScans)
    if are_recorded:
        asked = LongList.of(
            protocol.query_scan(asked, frame).astype(np.float32)
            for frame in queries.frames.tolist()
        )
    here = compared._replace(distractors=(), num_distractors=0)
    searched = here.searched(0, described, method)
    database = searched.described
    found = {radius: np.full(len(queries.frames), math.nan) for radius in radii}
    drive_of = database.places.drive_of
    if drive_of is None:
        drive_of = np.zeros(len(searched.rows), np.int64)
    first = 0
    for number, part in enumerate(
        [scans, *(parts[0] for parts in compared.beside)]
    ):
        of = drive_of == number
        kept = part.read()
        are_recorded = isinstance(kept, KeptScans)
        if are_recorded:
            chosen = LongList.of(
                cloud_at(kept, frame, 1, protocol.half_extent).astype(
                    np.float32
                )
                for frame in database.places.frames[of].tolist()
            )
        else:
            rows_here = searched.rows[of] - first
            first += len(kept)
            chosen = kept
            if len(rows_here) < len(kept):
                chosen = LongList.of(kept[row] for row in rows_here)
        for rows in query_batches(len(asked), len(of)):
            batch = slice(rows.start, rows.stop)
            matches = [
                matches_within_radius(
                    database, query, replace(protocol, radius=radius), rows
                )[:, of]
                for radius in radii
            ]
            shown = overlaps_with_best_match(
                chosen,
                database.places.X_WS[of],
                asked[batch],
                queries.X_WS[batch],
                np.array(matches),
            )
            for radius, by_radius in zip(radii, shown, strict=True):
                found[radius][batch] = np.fmax(found[radius][batch], by_radius)
    return found


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
    scans, places = _described_drive(
        compared.database, "places", methods, protocol
    )
    asked_scans, queries = _described_drive(
        compared.query, "queries", methods, protocol
    )
    known: Mapping[float, np.ndarray] = {}
    if compared.overlaps is not None:
        known = compared.overlaps.read()
    # Matches follow from the positions of the scans, and not from a method, so
    # that overlaps are computed once for all methods.
    overlaps: dict[tuple[float, range], np.ndarray] = {}

    def shown(
        radius: float,
        rows: range,
        matches: np.ndarray,
        X_WP: np.ndarray,
        X_WQ: np.ndarray,
    ) -> np.ndarray:
        batch = slice(rows.start, rows.stop)
        if radius in known:
            return known[radius][batch]
        if (radius, rows) not in overlaps:
            number = len(scans())
            (overlaps[radius, rows],) = overlaps_with_best_match(
                scans(),
                X_WP[:number],
                asked_scans()[batch],
                X_WQ[batch],
                matches[None, :, :number],
            )
        return overlaps[radius, rows]

    for k, choice in enumerate(
        track(methods, "comparing", len(methods), "methods")
    ):
        # The method comes first, because it registers the type of its
        # descriptors.
        method = choice.make()
        mapped, asked = places.pop(0), queries.pop(0)
        if isinstance(asked, Part):
            asked = asked.read()
        searched = compared.searched(k, mapped, method)
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
    shown: Callable[..., np.ndarray],
    reporter: Reporter,
) -> list[PlaceOutcome]:
    """Returns a method's outcomes; none if the method would take too long.

    Args:
        choice: the method.
        search: the method's search in the database.
        database: the places that are searched.
        query: the described queries.
        compared: the comparison.
        shown: function that takes a radius, the numbers of R queries, their
            matches (R, D) within this radius, and the poses of all places and
            queries, and returns how much of each query's scan its best match
            shows (R,).
        reporter: reports notes.
    """
    searched, drives, num_here, _ = database
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
            overlaps = shown(
                radius,
                rows,
                matches,
                searched.places.X_WS,
                query.queries.X_WS,
            )
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


def _described_drive(
    drive: DescribedSource,
    role: Role,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
) -> tuple[Callable[[], Sequence[np.ndarray]], list[DriveDescriptors | Part]]:
    """Returns a drive's scans, and each method's descriptors or their file.

    Scans in a file are read when they are asked for. Only the descriptors of a
    method that is compared should be in memory: take them out of the list.
    """
    if isinstance(drive, tuple):
        scans, *files = drive
        return cache(scans.read), [*files]
    asked = {one.key: (one.make(), {role}, protocol) for one in methods}
    found = describe_recording(drive(), {role}, asked, protocol)
    shown = found.shown_scans
    return lambda: shown, [*found.described.values()]
