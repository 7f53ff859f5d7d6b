"""Finds why the best place of a query is wrong, from both drives' scans."""

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
    """Evidence from the scans of a pair of drives, for each of Q queries.

    A query can have several true matches. Here, its right place is the match
    whose scan shows most of the query's scan. Upright points are points on
    upright objects, such as walls and trunks.

    Attributes:
        overlaps: (Q,) share of the query's scan that the right place's scan
            shows; NaN without a match.
        hidden_shares: (Q,) share of the query's scan that is hidden from the
            right place's sensor; NaN without a match.
        changed: (Q,) share of upright points that show a change, among all
            upright points of the query and its right place. A point shows a
            change if it is not hidden from the sensor of the other scan, but
            that scan has no point on the same structure. NaN without a match,
            or if a recording does not name its structures.
        changed_classes: for each query, the class of structures with most of
            the points counted in `changed`; "" if there are none.
        right_fits: (Q,) share of upright points that coincide when the scans of
            the query and its right place are aligned: the share of the query's
            points or of the place's, whichever is less. NaN if `fits` is NaN
            for every method.
        fits: method -> (Q,) the same share for the query and its wrong best
            place; NaN if the best place is right, or at most twice the
            protocol's radius away.
        unchanged: (Q,) `overlaps` of the control, which is the same comparison
            without a change of the city; None without a control.
    """

    overlaps: np.ndarray
    hidden_shares: np.ndarray
    changed: np.ndarray
    changed_classes: list[str]
    right_fits: np.ndarray
    fits: Mapping[str, np.ndarray]
    unchanged: np.ndarray | None = None

    @property
    def visible_changes(self) -> np.ndarray:
        """(Q,) share of a query's scan that its right place does not show."""
        return 1.0 - self.overlaps

    @property
    def visible_change(self) -> tuple[float, int]:
        """Mean visible change of queries with a match, and their number.

        The visible change of a query is the share of its scan that the scan of
        its right place does not show, 1 minus the overlap.
        """
        return mean_visible_change(self.overlaps)

    @property
    def visible_change_added(self) -> float:
        """Mean visible change minus that of the control; NaN without a control.

        The control is the same comparison without a change of the city.
        """
        return visible_change_added(self.overlaps, self.unchanged)


def visible_change_added(now: np.ndarray, before: np.ndarray | None) -> float:
    """Returns the mean visible change minus that of a baseline.

    The visible change also contains parts of a scan that are hidden only
    because the viewpoints differ (parallax). Subtracting the baseline removes
    this share.

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
    """Returns, for each query, why its best place is wrong.

    The best place is the one that the method ranks first. The right place is
    the match whose scan shows most of the query's scan.

    Returns:
        For each of Q queries, "" if the best place is a match, and otherwise
        the first of these reasons that applies:

        - `no_place`: the query has no match.
        - `no_candidate`: the method finds no place, or rejects all places.
        - `too_far`: the best place is just beyond the radius of a match: at
          most twice that radius away.
        - `hidden`: the right place's scan shows less than half of the query's
          scan, and at least half of the rest is hidden from its sensor.
        - `no_overlap`: the right place's scan shows less than half of the
          query's scan, for another reason.
        - `changed`: at least a quarter of the surroundings is new or gone.
        - `twin`: the best place fits the query as well as the right place does.
        - `elsewhere`: no other reason applies.
    """
    retrieval = result.retrieval
    little = evidence.overlaps < _ENOUGH
    unseen = 1.0 - evidence.overlaps
    is_hidden = little & (evidence.hidden_shares >= 0.5 * unseen)
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
