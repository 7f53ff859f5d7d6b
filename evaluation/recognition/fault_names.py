"""Finds why top-ranked places are wrong, from both drives' scans."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from evaluation.recognition.faults import ELSEWHERE, FAULTS
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.visible_change import (
    ENOUGH_OVERLAP,
    mean_visible_change,
    visible_change_added,
)

# The kinds of the reason `elsewhere`, which evidence from scans tells apart, in
# order of precedence: a wrong answer gets the first that fits.
ELSEWHERE_KINDS = ("occluded", "no_overlap", "changed", "twin", "unexplained")
# All reasons between two drives through one city.
FAULT_KINDS = (
    *(fault for fault in FAULTS if fault not in ("other_city", ELSEWHERE)),
    *ELSEWHERE_KINDS,
)
# Names of reasons in words, where these differ from the values in tables.
_WORDS = {"too_far": "near miss", "twin": "perceptual aliasing"}
# Share of the missing surroundings that must be hidden for the reason
# `occluded`.
_MOSTLY_HIDDEN = 0.5
# Share of the surroundings that must have changed for the reason `changed`.
MUCH_CHANGED = 0.25


def fault_words(kind: str) -> str:
    """Returns a reason in words, such as `near miss`."""
    return _WORDS.get(kind, kind.replace("_", " "))


@dataclass(frozen=True)
class PairEvidence:
    """Evidence from the scans of a pair of drives, for each of Q queries.

    A query can have several true matches. The right place of a query is the
    match whose scan shows most of the query's scan. Upright points are points
    on upright objects, such as walls and trunks.

    Attributes:
        overlaps: (Q,) share of the query's scan that the right place's scan
            shows; NaN without a match.
        hidden_shares: (Q,) share of the query's scan that is occluded for the
            right place's sensor; NaN without a match.
        changed: (Q,) share of upright points that show a change, among all
            upright points of the query and its right place. A point shows a
            change if it is not occluded for the sensor of the other scan, but
            the other scan has no point on the same structure. NaN without a
            match, or if a recording does not name its structures.
        changed_classes: for each query, the class of structures with most of
            the points counted in `changed`; "" if there are none.
        right_fits: (Q,) share of upright points that coincide when the scans of
            the query and its right place are aligned: the share of the query's
            points or the share of the place's points, whichever is less. NaN if
            `fits` is NaN for every method.
        fits: method -> (Q,) the same share as `right_fits`, but for the query
            and its wrong top-ranked place; NaN if the top-ranked place is
            right, or at most twice the protocol's radius away.
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
    def mean_visible_change(self) -> tuple[float, int]:
        """Mean visible change of queries with a match, and their number.

        The visible change of a query is 1 minus the overlap: the share of its
        scan that the scan of its right place does not show.
        """
        return mean_visible_change(self.overlaps)

    @property
    def visible_change_added(self) -> float:
        """Mean visible change minus the mean in the control.

        The control is the same comparison without a change of the city. The
        result is NaN without a control.
        """
        return visible_change_added(self.overlaps, self.unchanged)


def fault_kinds(result: PlaceOutcome, evidence: PairEvidence) -> list[str]:
    """Returns, for each query, why its top-ranked place is wrong.

    The right place is the match whose scan shows most of the query's scan.

    Returns:
        For each of Q queries, "" if the top-ranked place is a match, and
        otherwise the reason as `evaluation.recognition.faults.faults`
        finds it. In place of `elsewhere` stands the first of these kinds that
        applies:

        - `occluded`: the right place's scan shows less than half of the query's
          scan, and at least half of the other points are occluded for the right
          place's sensor.
        - `no_overlap`: the right place's scan shows less than half of the
          query's scan, for another reason.
        - `changed`: at least a quarter of the upright points of the query and
          of its right place show a change.
        - `twin` (perceptual aliasing): the top-ranked place resembles the query
          as much as the right place does.
        - `unexplained`: no other kind applies.
    """
    reasons = result.columns["why"]
    little = evidence.overlaps < ENOUGH_OVERLAP
    unseen = 1.0 - evidence.overlaps
    conditions = [
        little & (evidence.hidden_shares >= _MOSTLY_HIDDEN * unseen),
        little,
        evidence.changed >= MUCH_CHANGED,
        evidence.fits[result.method] >= evidence.right_fits,
    ]
    kinds = np.select(conditions, ELSEWHERE_KINDS[:-1], ELSEWHERE_KINDS[-1])
    return np.where(reasons == ELSEWHERE, kinds, reasons).tolist()
