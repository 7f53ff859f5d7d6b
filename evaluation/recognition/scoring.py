"""Checks scores, verifies candidates geometrically, and ranks the places."""

from collections.abc import Mapping, Sequence
import contextlib
from typing import Any

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.points import read_only
from evaluation.methods.method import Method, check_number
from evaluation.recognition.pose_errors import checked_pose

# These values were chosen on development worlds, see docs/notes/fitting.md.
NUM_GATED = 30
SOFTNESS = 0.05


def ranked_places(scores: np.ndarray) -> np.ndarray:
    """Returns places from the best to the worst.

    Of places with equal scores, the first in the database is ranked higher.
    Places that are no candidates (NaN) come last, even after a score of minus
    infinity.

    Args:
        scores: (..., D), higher is more similar; NaN is no candidate.

    Returns:
        (..., D) indices of places.
    """
    # NumPy sorts NaN last.
    return np.argsort(-scores, axis=-1, kind="stable")


def gate_weight(
    distance: np.ndarray | float, radius: float, softness: float = SOFTNESS
) -> np.ndarray:
    """Returns the factor by which geometric verification scales a score.

    The factor is 1 for near places, 0 for far places, and 1/2 at the radius.

    Args:
        distance: distances from query to place according to the method's own
            pose [m], an array of any shape.
        radius: radius of a match [m].
        softness: half the width of the transition, as a fraction of the radius.
    """
    far = np.asarray(distance, dtype=np.float64) / radius
    return np.clip((1.0 + softness - far) / (2.0 * softness), 0.0, 1.0)


def gated(
    method: Method,
    query: Any,
    database: Any,
    scores: np.ndarray,
    radii: Sequence[float],
) -> list[np.ndarray]:
    """Returns scores after geometric verification: (D,) for each radius.

    Geometric verification tests the `NUM_GATED` places with the best scores.
    The method estimates the distance of each of these places from the query,
    and `gate_weight` returns a weight w from 1 (near) to 0 (far). If w is 0,
    the place is rejected: its score becomes NaN. Otherwise the score s becomes
    s - (1 - w) |s|; a positive score is thus multiplied by w. A place for which
    the method estimates no pose keeps its score. Scores of places that are not
    tested become NaN.

    If the method estimates no pose at all, all scores stay the same.

    Args:
        method: method that made the scores.
        query: descriptor of the query by the method.
        database: database of the D places, made by the method.
        scores: (D,) scores by the method; NaN for a place that is no candidate.
        radii: radii of a match [m].

    Raises:
        InputError: if the method returns something other than poses.
    """
    best = tested_places(scores)
    if len(best) == 0 or not radii:
        return [scores for _ in radii]
    poses = estimated_poses(method, query, database, best.tolist())
    return gated_at(scores, dict(zip(best.tolist(), poses, strict=True)), radii)


def estimated_poses(
    method: Method, query: Any, database: Any, places: Sequence[int]
) -> list[np.ndarray | None]:
    """Returns the pose X_PQ (4, 4) of a query at each place, or None.

    Args:
        method: method that estimates the poses.
        query: descriptor of the query by the method.
        database: database of places, made by the method.
        places: places in the database.

    Raises:
        InputError: if the method returns something other than poses.
    """
    found = method.relative_poses(query, database, places)
    check_number(method, "relative_poses", found, len(places))
    return [checked_pose(method, X_PQ) for X_PQ in found]


def tested_places(scores: np.ndarray) -> np.ndarray:
    """Returns the places that geometric verification tests, best first.

    Args:
        scores: (D,) scores; NaN for a place that is no candidate.
    """
    num_candidates = int((~np.isnan(scores)).sum())
    return ranked_places(scores)[: min(NUM_GATED, num_candidates)]


def gated_at(
    scores: np.ndarray,
    poses: Mapping[int, np.ndarray | None],
    radii: Sequence[float],
) -> list[np.ndarray]:
    """Returns scores after geometric verification, see `gated`.

    Args:
        scores: (D,) scores; NaN for a place that is no candidate.
        poses: place -> the query's pose X_PQ (4, 4) there, or None, for each of
            `tested_places`.
        radii: radii of a match [m].
    """
    if all(X_PQ is None for X_PQ in poses.values()):
        return [scores for _ in radii]
    best = np.array(list(poses))
    distance = np.array(
        [0.0 if X is None else np.linalg.norm(X[:3, 3]) for X in poses.values()]
    )
    results = []
    for radius in radii:
        weight = gate_weight(distance, radius)
        values = scores[best] - (1.0 - weight) * np.abs(scores[best])
        result = np.full(len(scores), np.nan)
        result[best] = np.where(weight > 0.0, values, np.nan)
        results.append(result)
    return results


def score_places(
    method: Method,
    queries: Sequence[Any],
    query_cloud: np.ndarray | None,
    database: Any,
    place_clouds: Sequence[np.ndarray],
    is_known: np.ndarray,
    *,
    gate_radius: float | None = None,
    exhaustive: bool = False,
    where: str = "",
) -> np.ndarray:
    """Returns a method's scores for the last of several queries, (D,).

    The scores are float64, and include geometric verification and the method's
    second stage, if there is one.

    Args:
        method: method that described queries and places.
        queries: descriptors, from the first of the drive to the current one.
        query_cloud: cloud of the current query, for a second stage.
        database: the result of `build_database` for the places.
        place_clouds: clouds of the D places, for a second stage.
        is_known: (D,) bool, which places may be candidates. If a place is
            excluded, the query is compared with every place, because a search
            for a few top-ranked places might return only excluded places.
        gate_radius: radius of geometric verification [m] (see `gated`); None
            for none.
        exhaustive: whether to also compare places that a search would skip only
            to save time.
        where: the name of the current query, for errors.

    Raises:
        InputError: the method returns something other than scores.
    """

    def ask(exhaustive: bool) -> np.ndarray:
        found = method.score_in_drive(queries, database, exhaustive=exhaustive)
        return checked_scores(method, "score", found, len(is_known))

    scores = ask(exhaustive or not is_known.all())
    if np.isnan(scores).any() and not method.skips_places:
        missing = int(np.isnan(ask(True)).sum())
        if missing:
            raise InputError(
                f"{method.name}: {where or f'query {len(queries)}'}: {missing}"
                f" of {len(scores)} scores are NaN (skips_places = True, in the"
                " class, allows it for places that are no candidates)"
            )
    scores = np.where(is_known, scores, np.nan)
    if method.rerank_best:
        assert query_cloud is not None
        scores = _reranked(method, scores, query_cloud, place_clouds)
    if gate_radius is None:
        return scores
    return gated(method, queries[-1], database, scores, [gate_radius])[0]


def _reranked(
    method: Method,
    scores: np.ndarray,
    query: np.ndarray,
    places: Sequence[np.ndarray],
) -> np.ndarray:
    """Returns the scores (D,) after the second stage of a method."""
    order = ranked_places(scores)
    num_candidates = int((~np.isnan(scores)).sum())
    best = order[: min(method.rerank_best, num_candidates)]
    result = np.full(len(scores), np.nan)
    if len(best):
        # Later queries are compared with the same clouds.
        clouds = [read_only(places[place]) for place in best]
        found = method.rerank(read_only(query), clouds, scores[best])
        result[best] = checked_scores(method, "rerank", found, len(best))
    return result


def checked_scores(
    method: Method, function: str, scores: object, number: int
) -> np.ndarray:
    """Returns the scores of a method as a float64 array of shape (number,).

    Raises:
        InputError: the scores have another shape or are no numbers, or they are
            complex or masked: a conversion would drop the imaginary part or the
            mask.
    """
    fault = ""
    try:
        values = np.asarray(scores)
    except ValueError:  # Rows of different lengths.
        values = np.empty(0)
    if isinstance(scores, np.ma.MaskedArray):
        fault = " with a mask (NaN says that a place is no candidate)"
    elif values.dtype.kind in "cSU":
        fault = f" and type {values.dtype}"
    elif values.shape == (number,):
        with contextlib.suppress(TypeError, ValueError):
            return values.astype(np.float64)
    raise InputError(
        f"{method.name}: {function} returned {type(scores).__name__} of shape"
        f" {values.shape}{fault} instead of {number} numbers"
    )
