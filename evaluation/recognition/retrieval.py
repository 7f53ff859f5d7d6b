"""Place recognition between two drives: what is asked, and what is right.

The protocol of the paper: queries every 10 m, database every 5 m, a match
lies within 7.5 m, points limited to [-100, 100] m. What it leaves open is
fixed as follows.

- "Every d metres" and "limited" are as in `evaluation.sequences.sampling`.
- Distances between query and database are between the positions of the
  sensor, in three dimensions, limit included.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Set
from dataclasses import dataclass
from typing import Literal

import numpy as np

from evaluation.methods.method import Method
from evaluation.sequences.sampling import CROP, gather, sample_frames
from evaluation.sequences.sequence import Sequence, check_same_world
from evaluation.support.errors import InputError
from evaluation.support.progress import Track, silent

QUERY_SPACING = 10.0
DATABASE_SPACING = 5.0
MATCH_RADIUS = 7.5

# What a drive is described for.
Role = Literal["places", "queries"]


@dataclass(frozen=True)
class Retrieval:
    """Scores of all queries against all places, with the truth.

    Attributes:
        query_frames: (Q,) frame of each query in its sequence.
        database_frames: (D,) frame of each place.
        scores: (Q, D) float64, higher is more similar, NaN for a place that
            the method does not consider.
        distances: (Q, D) float64 between the sensor positions [m].

    Example:
        from evaluation import retrieve

        found = retrieve(database, query, method)
        print(found.scores.shape, found.matches.sum())
    """

    query_frames: np.ndarray
    database_frames: np.ndarray
    scores: np.ndarray
    distances: np.ndarray

    @property
    def matches(self) -> np.ndarray:
        """(Q, D) bool, which place is a true match of which query."""
        return self.distances <= MATCH_RADIUS


@dataclass(frozen=True)
class DescribedDrive:
    """What a method keeps of a drive.

    Attributes:
        name: of the drive.
        place_frames: (D,) frames at which it has places.
        p_WPs: (D, 3) the positions of the sensor there [m].
        places: D descriptors; empty if it is no database.
        query_frames: (Q,) frames at which it asks.
        p_WQs: (Q, 3) likewise [m].
        queries: Q descriptors; empty if it does not ask.
    """

    name: str
    place_frames: np.ndarray
    p_WPs: np.ndarray
    places: list
    query_frames: np.ndarray
    p_WQs: np.ndarray
    queries: list


def retrieve(
    database: Sequence,
    query: Sequence,
    method: Method,
    track: Track = silent,
) -> Retrieval:
    """Asks for every query which places of the database look like it.

    Args:
        database: the drive whose places are known.
        query: the drive that asks; in the same world frame.
        method: describes and compares.
        track: reports progress.

    Raises:
        InputError: if a sequence cannot be read, or the two are not of the
            same world.

    Example:
        from evaluation import make_method, open_sequence, retrieve

        database, query = map(open_sequence, ("cns/01", "cns/02"))
        found = retrieve(database, query, make_method("solid", {}))
    """
    check_same_world(database, query)
    (places,) = describe_drive(database, [method], {"places"}, track)
    (queries,) = describe_drive(query, [method], {"queries"}, track)
    return compare(method, places, queries, track)


def describe_drive(
    sequence: Sequence,
    methods: Iterable[Method],
    roles: Set[Role],
    track: Track = silent,
    visit: Callable[[int, np.ndarray], None] | None = None,
) -> list[DescribedDrive]:
    """Describes the places and queries of a drive, each cloud once.

    Queries are taken at every other place, so that a method which describes
    both alike does so once. Clouds are shared between methods.

    Args:
        sequence: the drive.
        methods: that describe it.
        roles: what it serves as.
        track: reports progress.
        visit: is also shown each described frame and its single scan (N, 3),
            cropped, in the frame of the sensor.

    Returns:
        What each method made of it.

    Raises:
        InputError: if the sequence cannot be read, or no described cloud has
            a point within the limits of the protocol.
    """
    methods = list(methods)
    positions = sequence.X_WS[:, :3, 3]
    frames = {
        "places": sample_frames(positions, DATABASE_SPACING),
        "queries": sample_frames(positions, QUERY_SPACING),
    }
    members = {role: set(frames[role].tolist()) for role in roles}
    described = [
        DescribedDrive(
            sequence.name,
            frames["places"],
            positions[frames["places"]],
            [],
            frames["queries"],
            positions[frames["queries"]],
            [],
        )
        for _ in methods
    ]
    sizes = {method.scans_per_place for method in methods}
    if visit is not None:
        sizes.add(1)
    wanted = sorted(set().union(*members.values()))
    num_points = 0
    for frame in track(wanted, f"describing {sequence.name}", len(wanted)):
        clouds = {size: gather(sequence, frame, size) for size in sizes}
        num_points += max(map(len, clouds.values()))
        if visit is not None:
            visit(frame, clouds[1])
        for method, result in zip(methods, described, strict=True):
            cloud = clouds[method.scans_per_place]
            place = None
            if frame in members.get("places", ()):
                place = method.describe_place(cloud)
                result.places.append(place)
            if frame in members.get("queries", ()):
                if place is None or not method.describes_alike:
                    place = method.describe(cloud)
                result.queries.append(place)
    if num_points == 0:
        raise InputError(
            f"{sequence.name}: no finite point within {CROP:g} m of the LiDAR"
            f" in any of {len(wanted)} scans"
        )
    return described


def compare(
    method: Method,
    database: DescribedDrive,
    query: DescribedDrive,
    track: Track = silent,
) -> Retrieval:
    """Scores the queries of one drive against the places of another.

    Args:
        method: that described both.
        database: with its places described.
        query: with its queries described; in the same world frame.
        track: reports progress.
    """
    places = method.build_database(database.places)
    scores = np.empty((len(query.queries), len(database.places)))
    numbered = track(
        list(enumerate(query.queries)),
        f"querying {query.name}",
        len(query.queries),
    )
    for row, descriptor in numbered:
        scores[row] = method.score(descriptor, places)
    offsets = query.p_WQs[:, None, :] - database.p_WPs[None, :, :]
    return Retrieval(
        query_frames=query.query_frames,
        database_frames=database.place_frames,
        scores=scores,
        distances=np.linalg.norm(offsets, axis=2),
    )
