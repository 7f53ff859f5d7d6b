"""Measures a method's cost: time to describe and query, memory per place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import pickle
from time import process_time_ns
from typing import Any

import numpy as np

from evaluation.methods.method import Method
from evaluation.recognition.description import DescribedDrive, DescribedScans
from evaluation.recognition.scoring import ranked_places, score_places


@dataclass(frozen=True)
class Cost:
    """The cost of one method, on one core.

    Times are CPU times, medians over some scans.

    Attributes:
        method: name of the method.
        scans_per_place: number of scans that are merged into a cloud.
        points: mean number of points in a cloud.
        describe_ms: time to describe a query's cloud [ms].
        query_ms: time to compare a query with all places [ms]. It includes the
            method's second stage, the rejection of far places (the gate, see
            `evaluation.recognition.scoring.gated`), if used, and the pose of
            the best place.
        places: number of places.
        place_bytes: mean size of a place's pickled description.
    """

    method: str
    scans_per_place: int
    points: float
    describe_ms: float
    query_ms: float
    places: int
    place_bytes: float


def measure_cost(
    method: Method,
    clouds: Sequence[np.ndarray],
    scans_per_place: int,
    database: DescribedDrive,
    query: DescribedDrive,
    gate_radius: float | None = None,
) -> Cost:
    """Returns the time and memory that a method needs.

    Args:
        method: method to measure.
        clouds: C clouds to describe, C >= 2; the time of the first is not
            counted, since it includes loading and compiling.
        scans_per_place: number of scans that are merged into each cloud.
        database: described drive with places.
        query: described drive with queries; C of them are measured.
        gate_radius: radius of a match [m], with which far places are rejected
            (see `evaluation.recognition.scoring.gated`); None to reject none.
    """
    describing = [cpu_ms(method.describe, cloud) for cloud in clouds]
    places = database.places
    sizes = [len(pickle.dumps(one, protocol=5)) for one in places.descriptors]
    return Cost(
        method=method.name,
        scans_per_place=scans_per_place,
        points=float(np.mean([len(cloud) for cloud in clouds])),
        describe_ms=float(np.median(describing[1:])),
        query_ms=query_ms(
            method, places, query.queries, len(clouds), gate_radius
        ),
        places=len(places.frames),
        place_bytes=float(np.mean(sizes)),
    )


def query_ms(
    method: Method,
    places: DescribedScans,
    queries: DescribedScans,
    number: int,
    gate_radius: float | None = None,
    *,
    with_pose: bool = True,
) -> float:
    """Returns the median time of several queries [ms].

    The first query does not count.

    Args:
        method: method to measure.
        places: described places, all of them candidates.
        queries: described queries.
        number: number of queries to measure, two or more.
        gate_radius: radius of a match [m], with which far places are rejected
            (see `evaluation.recognition.scoring.gated`); None to reject none.
        with_pose: whether the pose of the best place is estimated, too.
    """
    indexed = method.build_database(places.descriptors)
    is_known = np.ones(len(places.frames), dtype=bool)
    rows = np.linspace(0, len(queries.frames) - 1, number).astype(int)

    def ask(row: int) -> None:
        found = score_places(
            method,
            queries.descriptors[: row + 1],
            queries.clouds[row] if queries.clouds else None,
            indexed,
            places.clouds,
            is_known,
            gate_radius=gate_radius,
        )
        if with_pose and not np.isnan(found).all():
            best = int(ranked_places(found)[0])
            method.relative_pose(queries.descriptors[row], indexed, best)

    return float(np.median([cpu_ms(ask, row) for row in rows.tolist()][1:]))


def cpu_ms(function: Callable[[Any], object], argument: object) -> float:
    """Returns the CPU time of a call [ms]."""
    start = process_time_ns()
    function(argument)
    return (process_time_ns() - start) * 1e-6
