"""The paper as the reference of a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from evaluation.change.drive_change import ChangeResult
from evaluation.paper import printed_values as printed
from evaluation.paper.aims import aims
from evaluation.paper.findings import findings
from evaluation.recognition.metrics import Mode
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.report.reference import (
    NO_REFERENCE,
    Judgement,
    Published,
    Reference,
)


def reference_for(map_names: Iterable[str]) -> Reference:
    """Returns the paper if one of the maps is from it, else no reference."""
    if printed.city_names().isdisjoint(map_names):
        return NO_REFERENCE
    return PaperReference()


class PaperReference(Reference):
    """The paper's values and claims."""

    title = "the paper “The City that Never Settles”"
    counting = (
        "counted as the paper seems to have done: RING++ on the queries that"
        " have a match (mode filtered), the others on all (mode all)",
        "the paper (RING++ filtered, others all)",
    )

    def compares_back(self, map_name: str, earlier: str, last: str) -> bool:
        return any(
            key[:3] == (map_name, last, earlier)
            for key in printed.recognition_values()
        )

    def change(self, map_name: str, stages: Sequence[str]) -> float | None:
        first, second = stages
        return printed.tcr_values().get((map_name, first, second))

    def further_changes(
        self, map_names: Iterable[str]
    ) -> list[tuple[str, str, float]]:
        """Returns the change of real drives through KAIST."""
        if printed.city_names().isdisjoint(map_names):
            return []
        kaist = printed.tcr_values()["kaist", "01", "06"]
        return [("kaist (real)", "01 ↔ 06", kaist)]

    def covers(self, result: RecognitionResult) -> bool:
        return printed.is_printed(result)

    def mode(self, method: str) -> Mode:
        return printed.mode_of(method)

    def values(self, result: RecognitionResult, mode: Mode) -> Published | None:
        return printed.values_of(result, mode)

    def auc_over_change(self, method: str) -> list[tuple[float, float]]:
        return printed.auc_over_change(method)

    def judge(
        self,
        results: Sequence[RecognitionResult],
        changes: Sequence[ChangeResult],
    ) -> list[Judgement]:
        found = (
            (f"What {self.title} claims", findings(results, changes)),
            ("How near to the paper's numbers", aims(results, changes)),
        )
        return [Judgement(name, judged) for name, judged in found if judged]
