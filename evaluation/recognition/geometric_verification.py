"""Geometric verification: rejects places that a method's own pose refutes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evaluation.methods import Method, check_number, checked_pose
from evaluation.recognition.query_outcomes import ranked_places

# Number of places with the best scores that are tested. This value and the next
# were chosen on development worlds, see docs/notes/cities.md.
NUM_VERIFIED = 30
# Half the width of the transition of a weight, as a share of the radius.
SOFTNESS = 0.05


def verification_weight(
    distance: np.ndarray | float, radius: float
) -> np.ndarray:
    """Returns the factor by which geometric verification scales a score.

    The factor is 1 for near places, 0 for far places, and 1/2 at the radius.

    Args:
        distance: distances from query to place according to the method's own
            pose [m], an array of any shape.
        radius: radius of a match [m].
    """
    far = np.asarray(distance, dtype=np.float64) / radius
    return np.clip((1.0 + SOFTNESS - far) / (2.0 * SOFTNESS), 0.0, 1.0)


def verified_scores(
    method: Method,
    query: Any,
    database: Any,
    scores: np.ndarray,
    radius: float,
) -> np.ndarray:
    """Returns scores (D,) after geometric verification.

    Geometric verification tests the `NUM_VERIFIED` places with the best scores.
    The method estimates the distance of each of these places from the query,
    and `verification_weight` returns a weight w from 1 (near) to 0 (far). If w
    is 0, the place is rejected: its score becomes NaN. Otherwise the score s
    becomes s - (1 - w) |s|; a positive score is thus multiplied by w. A place
    for which the method estimates no pose keeps its score. Scores of places
    that are not tested become NaN.

    If the method estimates no pose at all, all scores stay the same.

    Args:
        method: method that made the scores.
        query: descriptor of the query by the method.
        database: database of the D places, made by the method.
        scores: (D,) scores by the method; NaN for a place that is no candidate.
        radius: radius of a match [m].

    Raises:
        InputError: if the method returns something other than poses.
    """
    best = tested_places(scores).tolist()
    if not best:
        return scores
    poses = estimated_poses(method, query, database, best)
    of_place = dict(zip(best, poses, strict=True))
    return verified_by_poses(scores, of_place, [radius])[0]


def estimated_poses(
    method: Method, query: Any, database: Any, places: Sequence[int]
) -> list[np.ndarray | None]:
    """Returns the pose X_PQ (4, 4) of a query at each place.

    The pose is None at a place where the method estimates no pose.

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
    best = ranked_places(scores, NUM_VERIFIED)
    return best[~np.isnan(scores[best])]


def verified_by_poses(
    scores: np.ndarray,
    poses: Mapping[int, np.ndarray | None],
    radii: Sequence[float],
) -> list[np.ndarray]:
    """Returns scores (D,) after verification by each radius.

    See `verified_scores`.

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
        weight = verification_weight(distance, radius)
        values = scores[best] - (1.0 - weight) * np.abs(scores[best])
        result = np.full(len(scores), np.nan)
        result[best] = np.where(weight > 0.0, values, np.nan)
        results.append(result)
    return results
