"""Checks the scores of a method before they reach a table."""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
from typing import Any

import numpy as np

from cns_drake.base.errors import InputError
from evaluation.methods.method import Method
from evaluation.recognition.gate import gated
from evaluation.recognition.ranking import ranking


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
) -> np.ndarray:
    """Returns a method's scores for the last of some queries, (D,) float64.

    Its second stage, if it has one, and the gate are included.

    Args:
        method: that described queries and places.
        queries: descriptors, from the first of the drive to the current one.
        query_cloud: cloud of the current query, for a second stage.
        database: the result of `build_database` for the places.
        place_clouds: clouds of the D places, for a second stage.
        is_known: (D,) bool, which places may be candidates. Unless all are,
            every place is compared, because a search for the best few of all
            would find others.
        gate_radius: radius of a match for `gated` [m]; None without a gate.
        exhaustive: see `Method.score`.

    Raises:
        InputError: if the method returns anything else.
    """
    found = method.score_in_drive(
        queries, database, exhaustive=exhaustive or not is_known.all()
    )
    scores = _checked(method, "score", found, len(is_known))
    scores = np.where(is_known, scores, np.nan)
    if method.rerank_best:
        assert query_cloud is not None
        scores = _reranked(method, scores, query_cloud, place_clouds)
    if gate_radius is None:
        return scores
    return gated(method, queries[-1], database, scores, gate_radius)


def _reranked(
    method: Method,
    scores: np.ndarray,
    query: np.ndarray,
    places: Sequence[np.ndarray],
) -> np.ndarray:
    """Returns the scores (D,) after the second stage of a method.

    Args:
        method: that has one.
        scores: (D,) of its first stage.
        query: cloud of the query.
        places: clouds of the D places.

    Raises:
        InputError: if the method does not return scores.
    """
    order = ranking(scores)
    num_candidates = int((~np.isnan(scores)).sum())
    best = order[: min(method.rerank_best, num_candidates)]
    result = np.full(len(scores), np.nan)
    if len(best):
        clouds = [places[place] for place in best]
        found = method.rerank(query, clouds, scores[best])
        result[best] = _checked(method, "rerank", found, len(best))
    return result


def _checked(
    method: Method, function: str, scores: object, number: int
) -> np.ndarray:
    """Returns scores (number,) as float64.

    Raises:
        InputError: if they are not that. A conversion would drop the
            imaginary part of a complex score and the mask of a masked one.
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
