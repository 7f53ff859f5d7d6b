"""The reference of a report: published numbers, and claims to judge.

A study of a user's own city has no such numbers and uses `Reference` itself,
which publishes and judges nothing. A study with published numbers gets an
object of a subclass.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from evaluation.change.drive_change import ChangeResult
from evaluation.recognition.metrics import Mode
from evaluation.recognition.place_recognition import RecognitionResult


@dataclass(frozen=True)
class Published:
    """Published numbers of a method on a pair of drives."""

    auc: float
    recall_at_1: float
    f1_max: float


@dataclass(frozen=True)
class Finding:
    """A claim, and its verdict by our numbers.

    Attributes:
        claim: to be judged.
        verdict: whether it holds here.
        evidence: the numbers behind the verdict.
    """

    claim: str
    verdict: str
    evidence: str


@dataclass(frozen=True)
class Judgement:
    """Findings under a heading that says whose claims they judge."""

    heading: str
    findings: Sequence[Finding]


class Reference:
    """Published numbers and claims; this class has none.

    Attributes:
        title: the source's name in the report.
        counting: the modes in which the source counted its methods, in words
            for a caption and in brief for a figure; used only if something is
            published.
    """

    title: str = ""
    counting: tuple[str, str] = ("", "")

    def compares_back(self, map_name: str, earlier: str, last: str) -> bool:
        """Returns whether the earlier stage also asks the last one."""
        del map_name, earlier, last
        return False

    def change(self, map_name: str, stages: Sequence[str]) -> float | None:
        """Returns the published TCR_sym of a pair of stages."""
        del map_name, stages
        return None

    def further_changes(
        self, map_names: Iterable[str]
    ) -> list[tuple[str, str, float]]:
        """Returns changes to compare with: label, stages and TCR_sym."""
        del map_names
        return []

    def covers(self, result: RecognitionResult) -> bool:
        """Returns whether the number is published."""
        del result
        return False

    def mode(self, method: str) -> Mode:
        """Returns the mode in which a method was counted."""
        del method
        return "all"

    def values(self, result: RecognitionResult, mode: Mode) -> Published | None:
        """Returns the published numbers, counted in a mode."""
        del result, mode
        return None

    def auc_over_change(self, method: str) -> list[tuple[float, float]]:
        """Returns the published points (TCR_sym, AUC) of a method."""
        del method
        return []

    def judge(
        self,
        results: Sequence[RecognitionResult],
        changes: Sequence[ChangeResult],
    ) -> list[Judgement]:
        """Returns verdicts on all claims that our numbers can judge."""
        del results, changes
        return []


NO_REFERENCE = Reference()
