"""Place recognition between two drives: scores and ground truth.

The distance of a query from a place is the distance between the positions of
the sensor in three dimensions.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from evaluation.drives import Drive, check_same_world
from evaluation.methods import Method
from evaluation.recognition.describing import describe_drive
from evaluation.recognition.descriptors import DescribedScans, DriveDescriptors
from evaluation.recognition.geometric_verification import (
    tested_places,
    verified_by_poses,
)
from evaluation.recognition.overlap_truth import overlap_matrix
from evaluation.recognition.protocol import RECORDED_PROTOCOL, RetrievalProtocol
from evaluation.recognition.query_outcomes import (
    PoseErrors,
    pose_error,
    ranked_places,
)
from evaluation.recognition.search import Search

# Greatest number of pairs of a query and a place in one batch. An array of
# numbers of a batch has 128 MB, and there are about five.
_MOST_PAIRS = 16_000_000


@dataclass(frozen=True)
class Retrieval:
    """The scores of all queries against all places, and the ground truth.

    Attributes:
        query_frames: (Q,) frame of each query in its drive.
        database_frames: (D,) frame of each place.
        scores: (Q, D) float64, higher is more similar; NaN for places that are
            no candidates.
        distances: (Q, D) float64 distances between query and place [m].
        matches: (Q, D) bool, whether a place is a true match of a query.
        pose_errors: errors of the estimated pose at each query's top-ranked
            place.
        is_known: (Q, D) bool, whether a place is allowed as an answer to a
            query; with `exclude_recent`, places that the drive has passed just
            before the query are not allowed.
        overlaps: (Q, D) float64 share of a query's scan that a place's scan
            shows (see `evaluation.recognition.overlap_truth`); None if matches
            are by the radius.
        query_blocks: (Q,) block of the route in which each query lies.

    Example:
        from evaluation import retrieve

        found = retrieve(database, query, method)
        print(found.scores.shape, found.matches.sum())
    """

    query_frames: np.ndarray
    database_frames: np.ndarray
    scores: np.ndarray
    distances: np.ndarray
    matches: np.ndarray
    pose_errors: PoseErrors
    is_known: np.ndarray
    overlaps: np.ndarray | None = None
    query_blocks: np.ndarray | None = None

    @property
    def best_places(self) -> np.ndarray:
        """(Q,) top-ranked place of each query; -1 if it has no candidate.

        Of several places with the best score, the first one counts.
        """
        candidate = ~np.isnan(self.scores)
        best = ranked_places(self.scores, 1)[:, 0] if self.scores.size else -1
        return np.where(candidate.any(axis=1), best, -1)

    @property
    def best_frames(self) -> np.ndarray:
        """(Q,) frame of each top-ranked place; -1 without a candidate."""
        best = self.best_places
        return np.where(best < 0, -1, self.database_frames[best])

    @property
    def best_distances(self) -> np.ndarray:
        """(Q,) distance of each query to its top-ranked place [m].

        It is NaN for a query without a candidate.
        """
        best = self.best_places
        distances = self.distances[np.arange(len(best)), best]
        return np.where(best < 0, np.nan, distances)


def retrieve(
    database: Drive,
    query: Drive,
    method: Method,
    protocol: RetrievalProtocol = RECORDED_PROTOCOL,
    *,
    across_maps: bool = False,
    overlaps: np.ndarray | None = None,
) -> Retrieval:
    """Returns the scores of all queries against all places of a database.

    Args:
        database: the drive of the places.
        query: the drive of the queries, in the same world frame.
        method: method that describes and compares the scans.
        protocol: protocol of the comparison.
        across_maps: whether the drives may be from maps with different names.
        overlaps: (Q, D) share of each query's scan that each place's scan
            shows; by default computed from the scans. Used only for matches by
            overlap.

    Raises:
        InputError: if a drive cannot be read, the drives are not in the same
            world, or the method returns an invalid result.

    Example:
        from evaluation import make_method, open_drive, retrieve

        database, query = map(open_drive, ("cns/01", "cns/02"))
        found = retrieve(database, query, make_method("solid", {}))
    """
    check_same_world(database, query, across_maps=across_maps)
    if protocol.overlap is not None and overlaps is None:
        overlaps = overlap_matrix(database, query, protocol)
    (places,) = describe_drive(database, [method], {"places"}, protocol)
    (queries,) = describe_drive(query, [method], {"queries"}, protocol)
    batches = compare_at_radii(
        Search(method, places.places),
        places,
        queries,
        protocol,
        [protocol.verification_radius],
        overlaps,
    )
    return _joined([found for _, (found,) in batches])


def _joined(batches: Sequence[Retrieval]) -> Retrieval:
    """Returns successive batches of queries as one retrieval."""
    if len(batches) == 1:
        return batches[0]
    joined = {
        field.name: np.concatenate(
            [getattr(one, field.name) for one in batches]
        )
        for field in fields(Retrieval)
        if isinstance(getattr(batches[0], field.name), np.ndarray)
        and field.name != "database_frames"
    }
    errors = [one.pose_errors for one in batches]
    return replace(
        batches[0],
        **joined,
        pose_errors=PoseErrors(
            np.concatenate([one.translation for one in errors]),
            np.concatenate([one.rotation_deg for one in errors]),
        ),
    )


def query_batches(num_queries: int, num_places: int) -> Iterator[range]:
    """Yields successive batches of queries that fit into memory, at least one.

    Args:
        num_queries: number of queries.
        num_places: number of places with which each query is compared.
    """
    most = max(1, _MOST_PAIRS // max(num_places, 1))
    for start in range(0, max(num_queries, 1), most):
        yield range(start, min(start + most, num_queries))


def compare_at_radii(
    search: Search,
    database: DriveDescriptors,
    query: DriveDescriptors,
    protocol: RetrievalProtocol,
    verification_radii: Collection[float | None],
    overlaps: np.ndarray | None = None,
) -> Iterator[tuple[range, list[Retrieval]]]:
    """Yields the scores after geometric verification with several radii.

    Geometric verification rejects places that lie beyond a radius according to
    the method's own pose estimate. Queries are described and scored only once.
    They are compared in batches, because the scores of many queries for many
    places do not fit into memory. A method that averages the scores of earlier
    queries has one batch.

    Args:
        search: search in the database by the method that described both drives.
        database: drive with described places.
        query: drive with described queries, in the same world frame.
        protocol: protocol by which both drives were described; its field
            `verified` does not matter.
        verification_radii: radii of geometric verification [m]; None in place
            of a radius stands for scores without geometric verification.
        overlaps: (Q, D) share of each query's scan that each place's scan
            shows; needed for matches by overlap.

    Yields:
        The numbers of the queries of a batch, and their retrieval for each of
        `verification_radii`.

    Raises:
        InputError: if the method returns an invalid result.
    """
    places = database.places
    queries = query.queries
    batches = query_batches(len(queries.frames), len(places.frames))
    if search.method.config.center_scores:
        batches = iter([range(len(queries.frames))])
    for rows in batches:
        yield (
            rows,
            _compare_batch(
                search,
                database,
                query,
                protocol,
                verification_radii,
                overlaps,
                rows,
            ),
        )


def _compare_batch(
    search: Search,
    database: DriveDescriptors,
    query: DriveDescriptors,
    protocol: RetrievalProtocol,
    verification_radii: Collection[float | None],
    overlaps: np.ndarray | None,
    rows: range,
) -> list[Retrieval]:
    """Returns the retrievals of one batch, see `compare_at_radii`."""
    is_known = _known_places(database, query, protocol, rows)
    places = database.places
    queries = query.queries.positions_only.chosen(np.array(rows, np.int64))
    alone = search.scores(query, rows, is_known)
    if search.method.config.center_scores:
        alone = alone - _mean_of_known(alone)
    # Without geometric verification, only the pose at the top-ranked place is
    # needed, for its error.
    is_verified = any(radius is not None for radius in verification_radii)
    tested = [
        tested_places(scores_of_query)[: None if is_verified else 1]
        for scores_of_query in alone
    ]
    poses = search.poses(query, rows, tested)
    distances = _distances(database, query, rows)
    shown = None if overlaps is None else overlaps[rows.start : rows.stop]
    if protocol.overlap is None:
        matches = (distances.round(9) <= protocol.radius) & is_known
    else:
        assert shown is not None
        matches = (shown >= protocol.overlap) & is_known
    return [
        Retrieval(
            query_frames=queries.frames,
            database_frames=places.frames,
            scores=kept,
            distances=distances,
            matches=matches,
            pose_errors=_errors_at_best(kept, poses, places, queries),
            is_known=is_known,
            overlaps=shown,
            query_blocks=queries.blocks,
        )
        for kept in _verified_scores(alone, poses, verification_radii)
    ]


def _verified_scores(
    scores: np.ndarray,
    poses: Sequence[Mapping[int, np.ndarray | None]],
    verification_radii: Collection[float | None],
) -> list[np.ndarray]:
    """Returns the scores (Q, D) after geometric verification by each radius.

    Args:
        scores: (Q, D) scores; NaN for a place that is no candidate.
        poses: for each query, place -> estimated pose X_PQ (4, 4), or None.
        verification_radii: radii of geometric verification [m]; None in place
            of a radius stands for scores without geometric verification.
    """
    radii = [radius for radius in verification_radii if radius is not None]
    found = [np.empty(scores.shape) for _ in verification_radii]
    for row, unverified in enumerate(scores):
        by_radius = iter(verified_by_poses(unverified, poses[row], radii))
        for radius, kept in zip(verification_radii, found, strict=True):
            kept[row] = unverified if radius is None else next(by_radius)
    return found


def _errors_at_best(
    scores: np.ndarray,
    poses: Sequence[Mapping[int, np.ndarray | None]],
    places: DescribedScans,
    queries: DescribedScans,
) -> PoseErrors:
    """Returns the errors of the poses at each query's top-ranked place.

    Args:
        scores: (Q, D) scores; NaN for a place that is no candidate.
        poses: for each query, place -> estimated pose X_PQ (4, 4), or None.
    """
    errors = PoseErrors.unknown(len(scores))
    for row, found in enumerate(scores):
        if np.isnan(found).all():
            continue
        best = int(ranked_places(found, 1)[0])
        if (X_PQ := poses[row][best]) is not None:
            errors.translation[row], errors.rotation_deg[row] = pose_error(
                X_PQ, places.X_WS[best], queries.X_WS[row]
            )
    return errors


def matches_within_radius(
    database: DriveDescriptors,
    query: DriveDescriptors,
    protocol: RetrievalProtocol,
    rows: range,
) -> np.ndarray:
    """Returns which places are true matches of some queries, (R, D) bool.

    These are the places within the protocol's radius that the protocol allows.

    Args:
        database: drive of the D places.
        query: drive of the queries.
        protocol: protocol of the comparison.
        rows: numbers of R queries.
    """
    distances = _distances(database, query, rows)
    # No last bit decides at the radius.
    is_near = distances.round(9) <= protocol.radius
    return is_near & _known_places(database, query, protocol, rows)


def _distances(
    database: DriveDescriptors, query: DriveDescriptors, rows: range
) -> np.ndarray:
    """Returns the distance of queries from each place, (R, D) [m]."""
    p_WQs, p_WPs = query.queries.p_WSs, database.places.p_WSs
    distances = np.empty((len(rows), len(p_WPs)))
    # One query at a time: all differences at once take three times the memory.
    for k, row in enumerate(rows):
        distances[k] = np.linalg.norm(p_WQs[row] - p_WPs, axis=1)
    return distances


def _known_places(
    database: DriveDescriptors,
    query: DriveDescriptors,
    protocol: RetrievalProtocol,
    rows: range,
) -> np.ndarray:
    """Returns which places are allowed for some queries, (R, D) bool."""
    place_ns = database.places.stamps_ns
    if protocol.exclude_recent is None or database.name != query.name:
        return np.ones((len(rows), len(place_ns)), dtype=bool)
    query_ns = query.queries.stamps_ns[rows.start : rows.stop]
    age_ns = query_ns[:, None] - place_ns[None, :]
    return age_ns >= protocol.exclude_recent * 1e9


def _mean_of_known(scores: np.ndarray) -> np.ndarray:
    """Returns the mean score (D,) of each place over the queries (Q, D).

    Scores that are NaN do not count; a place without a score has the mean 0.
    """
    counts = np.count_nonzero(~np.isnan(scores), axis=0)
    return np.nansum(scores, axis=0) / np.maximum(counts, 1)
