"""Measurements between two surveyed recordings."""

from __future__ import annotations

from pathlib import Path

from cns_drake.base.jobs.running import Tell
from evaluation.change.change_result import ChangeResult
from evaluation.change.drive_change import Surveyed
from evaluation.change.drive_change import compare as compare_maps
from evaluation.recognition.place_recognition import judge_retrieval
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.recognition_result import RecognitionResult
from evaluation.recognition.retrieval import compare as score
from evaluation.sequences import check_same_world
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.code_digest import measuring_code
from evaluation.study.parts import (
    is_current,
    part_digest,
    read_part,
    write_part,
)
from evaluation.study.recording_survey import SurveyedDrive
from evaluation.study.study_layout import RecognitionFiles, SurveyFiles
from evaluation.study.surveys import tracking


def measure_change(
    map_name: str,
    stages: tuple[str, str],
    surveys: tuple[SurveyFiles, ...],
    result: Path,
) -> None:
    """Writes the `ChangeResult` of two drives.

    Args:
        map_name: of the city.
        stages: of the earlier drive, and of the later one.
        surveys: of the earlier drive, the later one, and their control if
            there is one.
        result: to write.

    Raises:
        InputError: if the drives are of different worlds, or a file cannot
            be read or written.
    """
    inputs = _change_inputs(map_name, stages, surveys)
    if is_current(result, inputs):
        return
    earlier, later, *controls = (
        _to_surveyed(read_part(survey.drive)) for survey in surveys
    )
    control = controls[0] if controls else None
    report = compare_maps(earlier, later, control)
    change = ChangeResult(map_name, stages, report)
    write_part(result, inputs, change)


def is_measured(
    map_name: str,
    stages: tuple[str, str],
    surveys: tuple[SurveyFiles, ...],
    result: Path,
) -> bool:
    """Tells whether there is nothing to do; see `measure_change`."""
    return is_current(result, _change_inputs(map_name, stages, surveys))


def _change_inputs(
    map_name: str, stages: tuple[str, str], surveys: tuple[SurveyFiles, ...]
) -> dict:
    return {
        "map": map_name,
        "stages": stages,
        "drives": [part_digest(survey.drive) for survey in surveys],
        "code": measuring_code(),
    }


def recognise_places(
    map_name: str,
    stages: tuple[str, str],
    surveys: tuple[SurveyFiles, SurveyFiles],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    files: RecognitionFiles,
    tell: Tell,
) -> None:
    """Writes the `RecognitionResult`s of two drives: a job.

    Of a drive that is asked about itself and closes no loop, they are None.

    Args:
        map_name: of the city.
        stages: of the database, and of the query.
        surveys: likewise.
        methods: that described both.
        protocol: by which they did.
        files: to write.
        tell: is told how far it is.

    Raises:
        InputError: if the drives are of different worlds, no query has a
            match, a method fails, or a file cannot be read or written.
    """
    for method in methods:
        inputs = _recognition_inputs(
            map_name, stages, surveys, method, protocol
        )
        result = files.result(method)
        if not is_current(result, inputs):
            found = _recognise(
                map_name, stages, surveys, method, protocol, tell
            )
            write_part(result, inputs, found)


def _recognise(
    map_name: str,
    stages: tuple[str, str],
    surveys: tuple[SurveyFiles, SurveyFiles],
    method: MethodChoice,
    protocol: RetrievalProtocol,
    tell: Tell,
) -> RecognitionResult | None:
    parts = [survey.described(method) for survey in surveys]
    # The method comes first: what it kept may be of a type of its own.
    comparing = method.make()
    (placed, database), (placed_query, query) = map(read_part, parts)
    check_same_world(placed, placed_query)
    retrieval = score(comparing, database, query, protocol, tracking(tell))
    if database.name == query.name and not retrieval.matches.any():
        # A route need not close a loop.
        tell.note(f"{query.name}: it never comes back to where it was")
        return None
    outcome = judge_retrieval(
        comparing, database.name, query.name, retrieval, protocol
    )
    return RecognitionResult.of(map_name, stages, outcome)


def are_recognised(
    map_name: str,
    stages: tuple[str, str],
    surveys: tuple[SurveyFiles, SurveyFiles],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    files: RecognitionFiles,
) -> bool:
    """Tells whether there is nothing to do; see `recognise_places`."""
    return all(
        is_current(
            files.result(method),
            _recognition_inputs(map_name, stages, surveys, method, protocol),
        )
        for method in methods
    )


def _recognition_inputs(
    map_name: str,
    stages: tuple[str, str],
    surveys: tuple[SurveyFiles, SurveyFiles],
    method: MethodChoice,
    protocol: RetrievalProtocol,
) -> dict:
    parts = [survey.described(method) for survey in surveys]
    return {
        "map": map_name,
        "stages": stages,
        "method": method.inputs(),
        "protocol": protocol.to_json(),
        "drives": [part_digest(part) for part in parts],
        "code": measuring_code(),
    }


def _to_surveyed(drive: SurveyedDrive) -> Surveyed:
    return Surveyed(drive.name, drive.coarse, drive.positions, drive.placed)
