"""Measurements between two surveyed recordings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cns_drake.base.jobs.step import Reporter
from evaluation.change.drive_change import ChangeResult, Surveyed
from evaluation.change.drive_change import compare as compare_maps
from evaluation.drives import check_same_world
from evaluation.recognition.place_recognition import (
    RecognitionResult,
    judge_retrieval,
)
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import compare as score
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.parts import PartStep, part_digest, read_part
from evaluation.study.recording_survey import SurveyedDrive
from evaluation.study.study_layout import SurveyFiles


@dataclass(frozen=True)
class MeasureChange(PartStep):
    """Writes the `ChangeResult` of two drives; they must be of one world.

    Attributes:
        map_name: of the city.
        stages: of the earlier drive, and of the later one.
        surveys: of the earlier drive, the later one, and their control if
            there is one.
        part: to write.
    """

    map_name: str
    stages: tuple[str, str]
    surveys: tuple[SurveyFiles, ...]
    part: Path

    def inputs(self) -> dict[str, object]:
        return {
            "map": self.map_name,
            "stages": self.stages,
            "drives": [part_digest(survey.drive) for survey in self.surveys],
        }

    def make(self, reporter: Reporter) -> ChangeResult:
        earlier, later, *controls = (
            _to_surveyed(read_part(survey.drive)) for survey in self.surveys
        )
        control = controls[0] if controls else None
        report = compare_maps(earlier, later, control)
        return ChangeResult(self.map_name, self.stages, report)


@dataclass(frozen=True)
class RecognisePlaces(PartStep):
    """Writes the `RecognitionResult` of a method on two drives of one world.

    The result is None if a drive is compared with itself and closes no loop.

    Attributes:
        map_name: of the city.
        stages: of the database, and of the query.
        surveys: likewise.
        method: that described both.
        protocol: of the descriptions.
        part: to write.
    """

    map_name: str
    stages: tuple[str, str]
    surveys: tuple[SurveyFiles, SurveyFiles]
    method: MethodChoice
    protocol: RetrievalProtocol
    part: Path

    @property
    def _described(self) -> list[Path]:
        return [survey.described(self.method) for survey in self.surveys]

    def inputs(self) -> dict[str, object]:
        return {
            "map": self.map_name,
            "stages": self.stages,
            "method": self.method.inputs(),
            "protocol": self.protocol.to_json(),
            "drives": [part_digest(part) for part in self._described],
        }

    def make(self, reporter: Reporter) -> RecognitionResult | None:
        # The method comes first, because it registers the type of its
        # descriptions.
        method = self.method.make()
        (placed, database), (placed_query, query) = map(
            read_part, self._described
        )
        check_same_world(placed, placed_query)
        retrieval = score(
            method, database, query, self.protocol, reporter.track
        )
        if database.name == query.name and not retrieval.matches.any():
            # A route need not close a loop.
            reporter.note(f"{query.name}: it never comes back to where it was")
            return None
        outcome = judge_retrieval(
            method, database.name, query.name, retrieval, self.protocol
        )
        return RecognitionResult.of(self.map_name, self.stages, outcome)


def _to_surveyed(drive: SurveyedDrive) -> Surveyed:
    return Surveyed(drive.name, drive.coarse, drive.positions, drive.placed)
