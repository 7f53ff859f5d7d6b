"""The reference of a report: the paper's values, findings and aims."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
import functools

from evaluation.change.drive_change import ChangeResult
from evaluation.paper.aims import aims
from evaluation.paper.findings import findings
from evaluation.paper.paper_values import TITLE, paper
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report.reference import (
    NO_REFERENCE,
    Judgement,
    Reference,
)


def reference_for(map_names: Iterable[str]) -> Reference:
    """Returns the values of the CNS paper for a report on some maps.

    If none of the maps occurs in the paper, the result has no values.
    """
    if paper().city_names.isdisjoint(map_names):
        return NO_REFERENCE
    return paper_reference()


@functools.cache
def paper_reference() -> Reference:
    """Returns the values of the paper, with verdicts on its claims."""
    return replace(paper(), judge=_judge)


def _judge(
    results: Sequence[PlaceOutcome], changes: Sequence[ChangeResult]
) -> list[Judgement]:
    found = (
        (f"What {TITLE} claims", findings(results, changes)),
        (
            "How near to the paper's numbers, to which TCR_sym and the AUC of"
            " SOLiD were fitted",
            aims(results, changes),
        ),
    )
    return [Judgement(name, judged) for name, judged in found if judged]
