"""Reasons for a wrong best place, from the scans of both drives."""

from collections.abc import Mapping
from dataclasses import dataclass
import math

import numpy as np

from evaluation.recognition.place_recognition import PlaceRecognition

# The reasons in order of precedence: a wrong answer gets the first that fits.
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
# Up to this multiple of the radius, a wrong place is `too_far`; beyond it,
# `elsewhere`.
NEARLY = 2.0
# Overlap below which two scans show different surroundings.
_ENOUGH = 0.5
# Share of the surroundings that must have changed for the reason `changed`.
MUCH_CHANGED = 0.25


@dataclass(frozen=True)
class PairEvidence:
    """Comparisons of the scans of Q queries and of places.

    The right place of a query is the match whose scan shows most of the query's
    scan.

    Attributes:
        overlaps: (Q,) share of the query's scan that the right place's scan
            shows; NaN without a match.
        hidden: (Q,) share of the query's scan that is hidden from the right
            place's sensor; NaN without a match.
        changed: (Q,) share of both scans' upright points that lie on a
            structure that is absent from the other scan although it is not
            hidden there. NaN without a match, or if a recording does not name
            its structures.
        changed_classes: Q names of the class with most of these points; "" if
            there are none.
        right_fits: (Q,) share of the upright points of the query and its right
            place that coincide at the best alignment of the two scans; NaN if
            no method is wrong.
        fits: method -> (Q,) the same share for the query and its wrong best
            place; NaN if the best place is right or only too far.
        unchanged: (Q,) `overlaps` of the control; None without a control.
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
        """(Q,) share of each query's scan that the right place lacks."""
        return 1.0 - self.overlaps

    @property
    def visible_change(self) -> tuple[float, int]:
        """Mean visible change, and the number of queries that have one."""
        return mean_visible_change(self.overlaps)

    @property
    def visible_change_added(self) -> float:
        """Mean visible change minus the control's; NaN without a control."""
        return visible_change_added(self.overlaps, self.unchanged)


def visible_change_added(now: np.ndarray, before: np.ndarray | None) -> float:
    """Returns the mean visible change minus that of a baseline.

    Both values contain what is not visible only because of the different
    viewpoints (parallax); the difference cancels this part.

    Args:
        now: (Q,) overlaps, see `PairEvidence`.
        before: (Q,) overlaps of the same queries in the baseline.

    Returns:
        The difference; NaN if no query has both values, or the queries differ.
    """
    if before is None or len(before) != len(now):
        return math.nan
    added = before - now
    known = added[~np.isnan(added)]
    return float(known.mean()) if len(known) else math.nan


def mean_visible_change(overlaps: np.ndarray) -> tuple[float, int]:
    """Returns the mean visible change, and the number of queries.

    The visible change of a query is the share of its scan that the best of its
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
        Q reasons, the first that applies: "" if the best place is right;
        `no_place` if the query has no match; `no_candidate` if the method finds
        no place or rejects all; `too_far` if the best place is within two
        radii; `hidden` if the right place shows less than half of the query's
        scan, and most of the rest is hidden there; `no_overlap` if it shows
        less than half for another reason; `changed` if at least a quarter of
        the surroundings has come or gone; `twin` if the best place fits the
        query as well as the right place does; otherwise `elsewhere`.
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
