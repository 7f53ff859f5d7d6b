"""Reasons for a wrong best place, from the scans of both drives."""

from collections.abc import Mapping
from dataclasses import dataclass
import math

import numpy as np

from evaluation.recognition.place_recognition import PlaceRecognition

# The kinds in order of precedence: a wrong answer gets the first one that fits.
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
# Within this number of radii a place counts as too far away and not as
# elsewhere.
NEARLY = 2.0
# Least overlap of two scans, as in truth by overlap.
_ENOUGH = 0.5
# Least part of the surroundings that has come or gone.
MUCH_CHANGED = 0.25


@dataclass(frozen=True)
class PairEvidence:
    """Comparisons of the scans of Q queries and of places.

    The right place of a query is the match that shows most of its scan.

    Attributes:
        overlaps: (Q,) part of the query's scan that the right place shows;
            NaN without a match.
        hidden: (Q,) part of the query's scan that is hidden from the right
            place's sensor; NaN without a match.
        changed: (Q,) part of the standing points of both scans on a structure
            that the other scan lacks without being hidden; NaN also if a
            recording does not name its structures.
        changed_classes: Q names of the class with most of these points; ""
            without any.
        right_fits: (Q,) part of the standing points of the query and its right
            place that coincide at the best alignment of the two scans; NaN if
            no method is wrong.
        fits: method -> (Q,) the same part for the query and its wrong best
            place; NaN where the best place is right or only too far.
        unchanged: (Q,) `overlaps` in the control; None without one.
    """

    overlaps: np.ndarray
    hidden: np.ndarray
    changed: np.ndarray
    changed_classes: list[str]
    right_fits: np.ndarray
    fits: Mapping[str, np.ndarray]
    unchanged: np.ndarray | None = None

    @property
    def visible_changes(self) -> np.ndarray:
        """(Q,) share of each query's scan that its match does not show."""
        return 1.0 - self.overlaps

    @property
    def visible_change(self) -> tuple[float, int]:
        """Mean visible change, and the number of queries that have one."""
        return mean_visible_change(self.overlaps)

    @property
    def visible_change_added(self) -> float:
        """Mean visible change less the control's; NaN without a control."""
        return visible_change_added(self.overlaps, self.unchanged)


def visible_change_added(now: np.ndarray, before: np.ndarray | None) -> float:
    """Returns the mean visible change less that of a baseline.

    The difference cancels what two viewpoints hide from each other, their
    parallax, which both values contain.

    Args:
        now: (Q,) overlaps, see `PairEvidence`.
        before: (Q,) overlaps of the same queries in the baseline.

    Returns:
        NaN if no query has both, or the queries are not the same.
    """
    if before is None or len(before) != len(now):
        return math.nan
    added = before - now
    known = added[~np.isnan(added)]
    return float(known.mean()) if len(known) else math.nan


def mean_visible_change(overlaps: np.ndarray) -> tuple[float, int]:
    """Returns the mean visible change, and the number of queries.

    The visible change of a query is the part of its scan that the best of its
    matches does not show.

    Args:
        overlaps: (Q,) `PairEvidence.overlaps`; NaN for queries that have no
            match, which do not count.

    Returns:
        The mean and the number of queries with a match; NaN and 0 if there are
        none.
    """
    known = overlaps[~np.isnan(overlaps)]
    if len(known) == 0:
        return math.nan, 0
    return float(1.0 - known.mean()), len(known)


def fault_kinds(result: PlaceRecognition, evidence: PairEvidence) -> list[str]:
    """Returns the reason for each query's wrong best place.

    Returns:
        Q of: "" if it is right; `no_place` if the query has no match;
        `no_candidate` if the method has no place, or rejects all; `too_far`
        if it is within two radii; `hidden` if less than half of the query's
        scan is visible from the right place, and most of the rest is hidden
        there; `no_overlap` if it is less than half for another reason;
        `changed` if a quarter of the surroundings has come or gone; `twin` if
        it fits the query as well as the right place does; else `elsewhere`.
    """
    retrieval = result.retrieval
    little = evidence.overlaps < _ENOUGH
    unseen = 1.0 - evidence.overlaps
    is_hidden = little & (evidence.hidden >= 0.5 * unseen)
    conditions = [
        ~result.outcomes.has_match,
        retrieval.best_places < 0,
        retrieval.best_distances <= NEARLY * result.protocol.radius,
        is_hidden,
        little,
        evidence.changed >= MUCH_CHANGED,
        evidence.fits[result.method] >= evidence.right_fits,
    ]
    return np.where(
        result.outcomes.is_right,
        "",
        np.select(conditions, FAULT_KINDS[:-1], FAULT_KINDS[-1]),
    ).tolist()
