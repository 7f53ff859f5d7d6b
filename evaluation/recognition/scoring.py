"""Asks a method for the scores of places, and checks them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from evaluation.base import InputError, read_only
from evaluation.methods import Method, checked_scores
from evaluation.recognition.query_outcomes import ranked_places


def score_places(
    method: Method,
    queries: Sequence[Any],
    query_cloud: np.ndarray | None,
    database: Any,
    place_clouds: Sequence[np.ndarray],
    is_known: np.ndarray,
    *,
    exhaustive: bool,
    where: str,
) -> np.ndarray:
    """Returns a method's scores for the last of several queries, (D,).

    The scores are float64, and include the method's second stage, if there is
    one, but no geometric verification.

    Args:
        method: method that described queries and places.
        queries: descriptors, from the first of the drive to the current one.
        query_cloud: cloud of the current query, for a second stage.
        database: the result of `build_database` for the places.
        place_clouds: clouds of the D places, for a second stage.
        is_known: (D,) bool, which places may be candidates. If a place is
            excluded, the query is compared with every place, because a search
            for a few top-ranked places might return only excluded places.
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
                f"{method.name}: {where}: {missing} of {len(scores)} scores are"
                " NaN (skips_places = True, in the class, allows it for places"
                " that are no candidates)"
            )
    scores = np.where(is_known, scores, np.nan)
    if method.rerank_best:
        assert query_cloud is not None
        scores = _reranked(method, scores, query_cloud, place_clouds)
    return scores


def _reranked(
    method: Method,
    scores: np.ndarray,
    query: np.ndarray,
    places: Sequence[np.ndarray],
) -> np.ndarray:
    """Returns the scores (D,) after the second stage of a method.

    Args:
        scores: (D,) scores of the first stage; NaN for a place that is no
            candidate.
        query: cloud of the query.
        places: clouds of the D places.
    """
    best = ranked_places(scores, method.rerank_best)
    best = best[~np.isnan(scores[best])]
    result = np.full(len(scores), np.nan)
    if len(best):
        # Later queries are compared with the same clouds.
        clouds = [read_only(places[place]) for place in best]
        found = method.rerank(read_only(query), clouds, scores[best])
        result[best] = checked_scores(method, "rerank", found, len(best))
    return result
