"""The result of a method on a pair of stages, as a study keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from evaluation.recognition.metrics import MODES, Mode, PlaceRecognitionMetrics
from evaluation.recognition.place_recognition import PlaceRecognition


@dataclass(frozen=True)
class RecognitionResult:
    """The result of a method on two stages of a map.

    Attributes:
        map_name: of the city.
        stages: of the database, and of the query.
        outcome: of the method.
        metrics: in each mode.
    """

    map_name: str
    stages: tuple[str, str]
    outcome: PlaceRecognition
    metrics: Mapping[Mode, PlaceRecognitionMetrics]

    @classmethod
    def of(
        cls, map_name: str, stages: tuple[str, str], outcome: PlaceRecognition
    ) -> RecognitionResult:
        """Returns the result of an outcome, counted in both modes."""
        return cls(
            map_name,
            stages,
            outcome,
            {mode: outcome.counting(mode).metrics for mode in MODES},
        )

    @property
    def method(self) -> str:
        return self.outcome.method

    @property
    def pair(self) -> tuple[str, str, str]:
        """Map, database, query."""
        return (self.map_name, *self.stages)
