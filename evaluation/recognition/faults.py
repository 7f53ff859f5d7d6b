"""Reasons for wrong top-ranked places, which follow from distances."""

from __future__ import annotations

import numpy as np

from evaluation.recognition.query_outcomes import QueryOutcomes

# The reason for a wrong top-ranked place to which no other one applies.
ELSEWHERE = "elsewhere"
# Reasons for wrong top-ranked places, in order of precedence.
FAULTS = ("no_place", "no_candidate", "other_city", "near_miss", ELSEWHERE)
# Up to this multiple of the radius, a wrong place is `near_miss`; beyond it,
# `elsewhere`.
NEARLY = 2.0


def faults(
    outcomes: QueryOutcomes,
    match_frames: np.ndarray,
    distances: np.ndarray,
    radius: float,
) -> np.ndarray:
    """Returns, for each query, why its top-ranked place is wrong.

    The top-ranked place is the place that the method ranks first.

    Args:
        outcomes: outcomes of Q queries.
        match_frames: (Q,) frame of the top-ranked place; -1 without a
            candidate.
        distances: (Q,) distance to the top-ranked place [m]; NaN if this place
            is in another city.
        radius: radius of a match [m].

    Returns:
        (Q,) "" if the top-ranked place is a match, and otherwise the first
        reason that applies: `no_place` if the query has no match;
        `no_candidate` if the method finds no place, or rejects all places;
        `other_city` if the top-ranked place is in another city; `near_miss` if
        the top-ranked place is at most twice the radius away; `elsewhere` if no
        other reason applies.
    """
    wrong = [
        ~outcomes.has_match,
        match_frames < 0,
        np.isnan(distances),
        distances <= NEARLY * radius,
    ]
    kinds = np.select(wrong, FAULTS[:-1], FAULTS[-1])
    return np.where(outcomes.is_right, "", kinds)
