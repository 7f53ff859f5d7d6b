"""The gate of the protocol: places that a method's own pose puts too far away.

A method that estimates the query's pose relative to a place also gives their
distance. The gate compares that distance with the radius of a match. The same
rule serves every method; no method uses the radius.

The gate looks at the `NUM_GATED` places with the best scores. A score counts
in full up to a distance of `1 - SOFTNESS` radii, falls linearly, and the place
is rejected from `1 + SOFTNESS` radii on. Poses have errors of some decimetres,
and a hard limit would accept and reject by chance.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cns_drake.base.errors import InputError
from evaluation.methods.method import Method
from evaluation.recognition.pose_errors import checked_pose
from evaluation.recognition.ranking import ranking

# These values were chosen on development worlds, see docs/notes/fitting.md.
NUM_GATED = 30
SOFTNESS = 0.05


def gate_weight(
    distance: np.ndarray | float, radius: float, softness: float = SOFTNESS
) -> np.ndarray:
    """Returns the part of a score that counts at a distance, from 1 to 0.

    Args:
        distance: between query and place by the method's own pose [m]; any
            shape.
        radius: of a match [m].
        softness: half the width of the ramp, as a part of the radius.
    """
    far = np.asarray(distance, dtype=np.float64) / radius
    return np.clip((1.0 + softness - far) / (2.0 * softness), 0.0, 1.0)


def gated(
    method: Method, query: Any, database: Any, scores: np.ndarray, radius: float
) -> np.ndarray:
    """Returns scores (D,) after the gate; NaN for rejected places.

    Places after the best `NUM_GATED` are no candidates. A place whose pose the
    method does not estimate keeps its score. If the method estimates no pose at
    all, every score stays.

    A score s with weight w becomes s - (1 - w) |s|: the part w of a positive
    score, and a negative score falls likewise.

    Args:
        method: of the scores.
        query: its description of the query.
        database: its database of the D places.
        scores: (D,) of the method; NaN for a place that is no candidate.
        radius: of a match [m].

    Raises:
        InputError: if the method returns something other than poses.
    """
    num_candidates = int((~np.isnan(scores)).sum())
    order = ranking(scores)
    best = order[: min(NUM_GATED, num_candidates)]
    if len(best) == 0:
        return scores
    found = method.relative_poses(query, database, best.tolist())
    if len(found) != len(best):
        raise InputError(
            f"{method.name}: relative_poses returned {len(found)} poses of"
            f" {len(best)} places"
        )
    poses = [checked_pose(method, X_PQ) for X_PQ in found]
    if all(X_PQ is None for X_PQ in poses):
        return scores
    distance = np.array(
        [0.0 if X is None else np.linalg.norm(X[:3, 3]) for X in poses]
    )
    weight = gate_weight(distance, radius)
    values = scores[best] - (1.0 - weight) * np.abs(scores[best])
    result = np.full(len(scores), np.nan)
    result[best] = np.where(weight > 0.0, values, np.nan)
    return result
