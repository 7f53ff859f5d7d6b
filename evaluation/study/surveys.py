"""Jobs that survey one recording each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from cns_drake.base.jobs.running import Job, Tell
from cns_drake.base.progress import Track
from evaluation.recognition.description import Role
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.code_digest import measuring_code
from evaluation.study.drive_source import DriveSource
from evaluation.study.parts import is_current, write_part
from evaluation.study.recording_survey import survey_recording
from evaluation.study.study_layout import SurveyFiles

# Expected seconds: for a process to start and import all that it needs; for
# the maps of a drive of 3000 scans, with 250 places and 150 queries.
START_COST = 2.0
_MAP_COST = 10.0
_ROLE_COST = {"places": 12.0, "queries": 8.0}


def survey_job(
    name: str,
    source: DriveSource,
    roles: Iterable[Role],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    files: SurveyFiles,
    needs: tuple[str, ...] = (),
) -> Job:
    """Returns the job that surveys a recording.

    Args:
        name: of the recording.
        source: opens it.
        roles: what it serves as in place recognition; may be empty.
        methods: that describe its places and queries.
        protocol: where it has these.
        files: to write.
        needs: names of the jobs that make it.
    """
    roles = frozenset(roles)
    return Job(
        name=survey_name(name),
        function=survey_drive,
        arguments=(source, roles, methods, protocol, files),
        needs=needs,
        cost=START_COST + _MAP_COST + sum(_ROLE_COST[r] for r in roles),
        output=files.folder,
        is_done=is_surveyed,
    )


def survey_name(recording: str) -> str:
    """Returns the name of the job that surveys a recording."""
    return f"survey {recording}"


def survey_drive(
    source: DriveSource,
    roles: frozenset[Role],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    files: SurveyFiles,
    tell: Tell,
) -> None:
    """Writes the survey of a drive, or what is missing of it.

    Args:
        source: opens the drive.
        roles: what it serves as in place recognition; may be empty.
        methods: that describe its places and queries.
        protocol: where it has these.
        files: to write.
        tell: is told how far it is.

    Raises:
        InputError: if the drive cannot be read, or a file not be written.
    """
    inputs = survey_inputs(source, roles, protocol)
    missing, maps = _missing(inputs, methods if roles else (), files)
    if not missing and not maps:
        return
    survey = survey_recording(
        source(),
        roles,
        [method.make() for method in missing],
        protocol,
        tracking(tell),
    )
    for method in missing:
        # Each is let go when it is written.
        described = survey.described.pop(method.name)
        write_part(
            files.described(method),
            described_inputs(inputs, method),
            (survey.drive.placed, described),
        )
    for path, name in maps.items():
        write_part(path, inputs, getattr(survey, name))


def is_surveyed(
    source: DriveSource,
    roles: frozenset[Role],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    files: SurveyFiles,
) -> bool:
    """Tells whether nothing is missing; see `survey_drive`."""
    inputs = survey_inputs(source, roles, protocol)
    return _missing(inputs, methods if roles else (), files) == ([], {})


def _missing(
    inputs: dict, methods: Iterable[MethodChoice], files: SurveyFiles
) -> tuple[list[MethodChoice], dict[Path, str]]:
    """Returns methods without descriptions, and the maps to be written."""
    missing = [
        method
        for method in methods
        if not is_current(
            files.described(method), described_inputs(inputs, method)
        )
    ]
    maps = {files.fine: "fine", files.drive: "drive"}
    return missing, {
        path: name
        for path, name in maps.items()
        if not is_current(path, inputs)
    }


def survey_inputs(
    source: DriveSource, roles: frozenset[Role], protocol: RetrievalProtocol
) -> dict:
    """Returns what the maps and thumbnails of a drive depend on."""
    return {
        "drive": source.identity(),
        "roles": sorted(roles),
        "protocol": protocol.described() if roles else None,
        "code": measuring_code(),
    }


def described_inputs(inputs: dict, method: MethodChoice) -> dict:
    """Returns what a method's descriptions of a drive depend on."""
    return {**inputs, "method": method.inputs()}


def tracking(tell: Tell) -> Track:
    """Returns what tells a job's progress over a loop."""

    def track(items: Iterable, description: str, total: int) -> Iterator[Any]:
        del description
        for done, item in enumerate(items):
            tell.progress(done, total)
            yield item

    return track
