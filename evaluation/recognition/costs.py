"""Measures a method's cost: time per descriptor and query, memory per place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import pickle
from time import process_time_ns
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from evaluation.methods import Method
from evaluation.recognition.descriptors import DescribedScans, DriveDescriptors
from evaluation.recognition.search import Search

# Number of clouds, or of queries, whose time is measured; the time of the first
# does not count, because it includes loading and compiling.
NUM_TRIALS = 12


@dataclass(frozen=True)
class QueryCost:
    """The cost of searching a database by one method, on one core.

    Attributes:
        places: number of places.
        place_bytes: mean size of a place's pickled descriptor [bytes].
        memory: size of the pickled descriptors of all places [bytes].
        build_ms: CPU time to build the database from descriptors [ms].
        query_ms: median CPU time to compare a query with all places [ms], see
            `query_ms`.
    """

    places: int
    place_bytes: float
    memory: int
    build_ms: float
    query_ms: float

    @property
    def build_time(self) -> float:
        """CPU time to build the database from descriptors [s]."""
        return 1e-3 * self.build_ms

    @property
    def query_time(self) -> float:
        """Median CPU time to compare a query with all places [s]."""
        return 1e-3 * self.query_ms


@dataclass(frozen=True)
class Cost:
    """The cost of one method, on one core.

    Times are CPU times, medians over some scans.

    Attributes:
        method: name of the method.
        scans_per_place: number of scans that are merged into a cloud.
        points: mean number of points in a cloud.
        describe_ms: time to describe a query's cloud [ms].
        query_ms: time to compare a query with all places [ms], see `query_ms`.
        places: number of places.
        place_bytes: mean size of a place's pickled descriptor [bytes].
    """

    method: str
    scans_per_place: int
    points: float
    describe_ms: float
    query_ms: float
    places: int
    place_bytes: float


def measure_search(
    method: Method, places: DescribedScans, queries: DriveDescriptors
) -> QueryCost:
    """Returns the time and memory that a search in a database needs.

    Args:
        method: method to measure.
        places: described places.
        queries: drive with described queries.
    """
    sizes = [
        len(pickle.dumps(descriptor, protocol=5))
        for descriptor in places.descriptors
    ]
    search = _timed_search(method, places, queries)
    return QueryCost(
        places=len(places.frames),
        place_bytes=float(np.mean(sizes)),
        memory=sum(sizes),
        build_ms=search.build_ms,
        query_ms=_median_ms(search),
    )


def measure_cost(
    method: Method,
    clouds: Sequence[np.ndarray],
    scans_per_place: int,
    search: QueryCost,
) -> Cost:
    """Returns the time and memory that a method needs.

    Args:
        method: method to measure.
        clouds: two or more clouds to describe; the time for the first cloud
            does not count.
        scans_per_place: number of scans that are merged into each cloud.
        search: cost of searching a database.
    """
    with threadpool_limits(limits=1):
        describing = [cpu_ms(method.describe, cloud) for cloud in clouds]
    return Cost(
        method=method.name,
        scans_per_place=scans_per_place,
        points=float(np.mean([len(cloud) for cloud in clouds])),
        describe_ms=float(np.median(describing[1:])),
        query_ms=search.query_ms,
        places=search.places,
        place_bytes=search.place_bytes,
    )


def query_ms(
    method: Method, places: DescribedScans, queries: DriveDescriptors
) -> float:
    """Returns the median CPU time of several queries, on one core [ms].

    A query is compared with all places. The time includes the second stage, if
    the method has one. The time includes neither geometric verification nor the
    pose of the top-ranked place, because not every method estimates poses, and
    the time to estimate a pose does not depend on the number of places. The
    first query does not count.

    Args:
        method: method to measure.
        places: described places, all of them candidates.
        queries: drive with described queries.
    """
    return _median_ms(_timed_search(method, places, queries))


def _timed_search(
    method: Method, places: DescribedScans, queries: DriveDescriptors
) -> Search:
    """Returns a search after some queries."""
    search = Search(method, places)
    last = len(queries.queries.frames) - 1
    rows = np.linspace(0, last, NUM_TRIALS).astype(int).tolist()
    is_known = np.ones((len(rows), len(places.frames)), dtype=bool)
    with threadpool_limits(limits=1):
        search.scores(queries, rows, is_known)
    return search


def _median_ms(search: Search) -> float:
    """Returns the median CPU time of all queries but the first [ms]."""
    return float(np.median(search.query_ms[1:]))


def cpu_ms(function: Callable[[Any], object], argument: object) -> float:
    """Returns the CPU time of a call [ms]."""
    start = process_time_ns()
    function(argument)
    return (process_time_ns() - start) * 1e-6
