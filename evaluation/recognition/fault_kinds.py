"""Why the best place of a query is wrong, from what both drives saw there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from evaluation.recognition.recognition_result import RecognitionResult

# In the order in which they are asked; each wrong answer has the first.
FAULT_KINDS = (
    "no_place",
    "no_candidate",
    "too_far",
    "hidden",
    "no_overlap",
    "changed",
    "twin",
    "elsewhere",
)
# Up to so many radii a place is just too far away, and not another one.
NEARLY = 2.0
# A scan shows enough of another one, as truth by overlap has it.
_ENOUGH = 0.5
# Part of what stands around that has come or gone.
MUCH_CHANGED = 0.25


@dataclass(frozen=True)
class PairEvidence:
    """What the scans of Q queries and of places say about each other.

    The right place of a query is the match that shows most of its scan.

    Attributes:
        overlaps: (Q,) part of the query's scan that the right place shows;
            NaN without a match.
        hidden: (Q,) part of it that lies behind what the right place's
            sensor sees; likewise.
        changed: (Q,) part of the standing points of both scans that lie on
            a structure of which the other one shows nothing, although
            nothing hides them; NaN also where a recording does not name its
            structures.
        changed_classes: Q classes that most of these points have; "" where
            there are none.
        right_fits: (Q,) part of the standing points of the query and its
            right place that coincide when the two scans are laid on each
            other as well as can be; NaN where no method is wrong.
        fits: method -> (Q,) the same of the query and the wrong best place;
            NaN where that is right or just too far.
    """

    overlaps: np.ndarray
    hidden: np.ndarray
    changed: np.ndarray
    changed_classes: list[str]
    right_fits: np.ndarray
    fits: Mapping[str, np.ndarray]


def fault_kinds(result: RecognitionResult, evidence: PairEvidence) -> list[str]:
    """Returns what is wrong with the best place of each query.

    Args:
        result: of a method on a pair.
        evidence: of the pair.

    Returns:
        Q of: "" if it is right; `no_place` if the query has no match;
        `no_candidate` if the method has no place, or rejects all; `too_far`
        if it is within two radii; `hidden` if less than half of the query's
        scan is seen from the right place, and most of the rest is behind
        something there; `no_overlap` if it is less than half for another
        reason; `changed` if a quarter of what stands around has come or gone;
        `twin` if it fits on the query as well as the right place does;
        `elsewhere`.
    """
    outcome = result.outcome
    retrieval = outcome.retrieval
    best = retrieval.best_places
    distances = retrieval.distances[np.arange(len(best)), best]
    little = evidence.overlaps < _ENOUGH
    unseen = 1.0 - evidence.overlaps
    is_hidden = little & (evidence.hidden >= 0.5 * unseen)
    asked = [
        ~outcome.outcomes.has_match,
        best < 0,
        distances <= NEARLY * outcome.protocol.radius,
        is_hidden,
        little,
        evidence.changed >= MUCH_CHANGED,
        evidence.fits[result.method] >= evidence.right_fits,
    ]
    return np.where(
        outcome.outcomes.is_right,
        "",
        np.select(asked, FAULT_KINDS[:-1], FAULT_KINDS[-1]),
    ).tolist()
