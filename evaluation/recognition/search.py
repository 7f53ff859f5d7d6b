"""Searches a database, which can be larger than the memory."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import pickle
import time
from typing import Any

import numpy as np

from evaluation.base import track
from evaluation.methods import Method, checked_scores
from evaluation.recognition.descriptors import DescribedScans, DriveDescriptors
from evaluation.recognition.geometric_verification import estimated_poses
from evaluation.recognition.scoring import score_places
from evaluation.recognition.stored_places import StoredDescriptors


@dataclass(frozen=True)
class SearchCost:
    """What a search takes, in CPU time and memory.

    Times differ from run to run, so no outcome contains them.

    Attributes:
        method: name of the method, with its settings.
        places: number of places.
        memory: size of the pickled descriptors of all places [bytes].
        build_time: time to build the database from descriptors [s].
        query_time: median time to compare a query with all places [s], see
            `Search.query_time`.
    """

    method: str
    places: int
    memory: int
    build_time: float
    query_time: float


class Search:
    """A method's search in a database, one group of places after another.

    If the descriptors are a list, or the method does not divide databases,
    there is one group. Results equal the results of one search in the whole
    database, bit for bit, if the method compares each place by itself (see
    `Method.divides`).

    Attributes:
        method: the method.
    """

    def __init__(self, method: Method, places: DescribedScans):
        """Divides the database into groups; none is built yet.

        Args:
            method: method that described the places.
            places: D described places.
        """
        self.method = method
        self._places = places
        descriptors = places.descriptors
        self._groups = [slice(0, len(places.frames))]
        if method.divides and isinstance(descriptors, StoredDescriptors):
            self._groups = descriptors.groups
        # Number of the group in memory, and its database.
        self._built: tuple[int, Any] | None = None
        # Group -> CPU time to build its database [ns].
        self._build_ns: dict[int, int] = {}
        # Number of a query -> CPU time of its scores [ns].
        self._query_ns: dict[int, int] = {}

    @property
    def query_time(self) -> float:
        """Median CPU time of the scores of the queries so far [s].

        A query is compared with all places. The time includes the second stage,
        if the method has one. It includes neither geometric verification nor
        poses, because not every method estimates poses, and their time does not
        depend on the number of places. The first query does not count, because
        it includes loading and compiling.
        """
        first, *others = self._query_ns.values()
        return 1e-9 * float(np.median(others or [first]))

    def cost(self, name: str) -> SearchCost:
        """Returns what the search takes, after its queries.

        Args:
            name: name of the method, with its settings.
        """
        return SearchCost(
            method=name,
            places=len(self._places.frames),
            memory=sum(
                len(pickle.dumps(one, protocol=5))
                for one in self._places.descriptors
            ),
            build_time=1e-9 * sum(self._build_ns.values()),
            query_time=self.query_time,
        )

    def scores(
        self,
        query: DriveDescriptors,
        rows: Sequence[int],
        is_known: np.ndarray,
    ) -> np.ndarray:
        """Returns the scores of some queries, (R, D) float64.

        The scores do not include geometric verification; NaN for a place that
        is no candidate.

        Args:
            query: drive with described queries.
            rows: R queries.
            is_known: (R, D) bool, which places may be candidates.

        Raises:
            InputError: the method returns something other than scores.
        """
        self._query_ns |= dict.fromkeys(rows, 0)
        entries = self._entries_by_group(query, rows, is_known)
        scores = np.empty(is_known.shape)
        for number, group in self._groups_in_memory():
            for k in self._tracked(query, rows):
                # Reading a descriptor from a file is not the method's time.
                _ = query.queries.descriptors[rows[k]]
                start = time.process_time_ns()
                scores[k, group] = self._scores_in_group(
                    query,
                    rows[k],
                    is_known[k],
                    group,
                    None if entries is None else int(entries[k, number]),
                )
                self._query_ns[rows[k]] += time.process_time_ns() - start
        return scores

    def poses(
        self,
        query: DriveDescriptors,
        rows: Sequence[int],
        wanted: Sequence[np.ndarray],
    ) -> list[dict[int, np.ndarray | None]]:
        """Returns the poses of some queries at places.

        Args:
            query: drive with described queries.
            rows: R queries.
            wanted: R arrays with the places at which to estimate the pose of
                each query.

        Returns:
            For each query, place -> X_PQ (4, 4), or None if the method
            estimates no pose.

        Raises:
            InputError: the method returns something other than poses.
        """
        found: list[dict[int, np.ndarray | None]] = [{} for _ in wanted]
        for _, group in self._groups_in_memory():
            for k, places in enumerate(wanted):
                here = places[(group.start <= places) & (places < group.stop)]
                if len(here) == 0:
                    continue
                poses = estimated_poses(
                    self.method,
                    query.queries.descriptors[rows[k]],
                    self._database,
                    (here - group.start).tolist(),
                )
                found[k].update(zip(here.tolist(), poses, strict=True))
        return found

    def _entries_by_group(
        self,
        query: DriveDescriptors,
        rows: Sequence[int],
        is_known: np.ndarray,
    ) -> np.ndarray | None:
        """Returns how many entries of each group a search chooses, (R, G).

        The result is None if there is one group, or the method compares each
        place.

        Args:
            query, rows, is_known: see `scores`.
        """
        method = self.method
        most = method.num_shortlisted
        if len(self._groups) == 1 or most is None:
            return None
        shortlists: list[list[np.ndarray]] = [
            [np.empty(0)] * len(self._groups) for _ in rows
        ]
        for number, _ in self._groups_in_memory():
            for k in self._tracked(query, rows):
                if not is_known[k].all():
                    continue
                start = time.process_time_ns()
                shortlists[k][number] = method.shortlist(
                    query.queries.descriptors[rows[k]], self._database
                )
                self._query_ns[rows[k]] += time.process_time_ns() - start
        entries = np.zeros((len(rows), len(self._groups)), np.int64)
        for k, of_groups in enumerate(shortlists):
            of = np.repeat(
                np.arange(len(of_groups)),
                [len(of_group) for of_group in of_groups],
            )
            # Of equal entries, the entry of the first group comes first.
            best = np.argsort(-np.concatenate(of_groups), kind="stable")[:most]
            entries[k] = np.bincount(of[best], minlength=len(of_groups))
        return entries

    def _scores_in_group(
        self,
        query: DriveDescriptors,
        row: int,
        is_known: np.ndarray,
        group: slice,
        num_entries: int | None,
    ) -> np.ndarray:
        """Returns the scores of a query in a group; see `_entries_by_group`.

        Args:
            query: drive with described queries.
            is_known: (D,) bool, which places may be candidates.
            group: the places of the group, which is in memory.
            num_entries: number of entries of the group that the search
                chooses; None to let the method choose.
        """
        queries = query.queries
        method = self.method
        is_whole = bool(is_known.all())
        if num_entries is not None and is_whole:
            found = method.score_best(
                queries.descriptors[row], self._database, num_entries
            )
            number = group.stop - group.start
            return checked_scores(method, "score_best", found, number)
        return score_places(
            method,
            queries.descriptors[: row + 1],
            queries.clouds[row] if queries.clouds else None,
            self._database,
            self._places.clouds,
            is_known[group],
            exhaustive=not is_whole,
            where=f"{query.name}: query at frame {queries.frames[row]}",
        )

    def _groups_in_memory(self) -> Iterator[tuple[int, slice]]:
        """Yields each group's number and places, after building its database.

        The group that is in memory comes first. No other object may hold a
        database, so that only one database is in memory.
        """
        numbers = range(len(self._groups))
        if self._built is not None and self._built[0] == numbers[-1]:
            numbers = numbers[::-1]
        for number in numbers:
            if self._built is None or self._built[0] != number:
                self._built = None
                self._build(number)
            yield number, self._groups[number]

    def _build(self, number: int) -> None:
        """Builds the database of a group."""
        descriptors = self._places.descriptors[self._groups[number]]
        start = time.process_time_ns()
        database = self.method.build_database(descriptors)
        self._build_ns[number] = time.process_time_ns() - start
        self._built = number, database

    @property
    def _database(self) -> Any:
        """The database of the present group."""
        assert self._built is not None
        return self._built[1]

    def _tracked(
        self, query: DriveDescriptors, rows: Sequence[int]
    ) -> Iterator[int]:
        activity = f"querying {query.name}"
        return track(range(len(rows)), activity, len(rows), "queries")
