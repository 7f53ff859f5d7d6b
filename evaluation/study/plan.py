"""The jobs of a study."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from cns_drake.base.jobs.running import Job
from cns_drake.base.jobs.step import Steps
from evaluation.recognition.description import Role
from evaluation.recognition.protocol import (
    PAPER_PROTOCOL,
    RetrievalProtocol,
)
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.collection import (
    City,
    RecordingInfo,
    group_cities,
)
from evaluation.study.drive_source import DriveSource
from evaluation.study.fault_evidence import FindEvidence
from evaluation.study.figure_files import change_stems, routes_stem
from evaluation.study.measurements import MeasureChange, RecognisePlaces
from evaluation.study.method_costs import MeasureCosts
from evaluation.study.parts import PartStep
from evaluation.study.study_layout import StudyFiles, SurveyFiles
from evaluation.study.surveys import Survey
from evaluation.study.views import DrawChange, DrawCity

# Expected seconds to start a process with its imports, and for the maps of a
# drive of 3000 scans with 250 places and 150 queries.
_START_COST = 2.0
_MAP_COST = 10.0
_ROLE_COST = {"places": 12.0, "queries": 8.0}
# Costs of the other jobs, beyond their start.
_CHANGE_COST = 6.0
_CITY_COST = 4.0
_COSTS_COST = 8.0
_RECOGNITION_COST = {
    "ring++": 4.0,
    "btc": 1.5,
    "scan-context++": 1.0,
    "solid": 0.1,
}
_OTHER_RECOGNITION_COST = 2.0
_EVIDENCE_COST = 8.0


def plan_study(
    recordings: Iterable[RecordingInfo],
    output: Path,
    methods: Sequence[MethodChoice] | None = None,
    protocol: RetrievalProtocol = PAPER_PROTOCOL,
    *,
    with_costs: bool = False,
    reference: Reference = NO_REFERENCE,
) -> list[Job]:
    """Returns the jobs whose results `assemble` puts into a report.

    For a city with one stage, only its route is drawn.

    Args:
        recordings: each may be made by the jobs that it needs; drives of
            one map that share stage and route with others serve as same-stage
            controls.
        output: folder to write.
        methods: by default those of this package.
        protocol: of place recognition.
        with_costs: whether to measure the costs of the methods, too, after all
            other jobs.
        reference: published numbers beside those of the report.

    Raises:
        InputError: if two recordings claim the same place.
    """
    files = StudyFiles(output.absolute())
    chosen = choose_methods() if methods is None else tuple(methods)
    cities = group_cities(recordings, reference)
    jobs = [
        job
        for city in cities
        for job in _plan_city(city, files, chosen, protocol)
    ]
    pairs = [pair for city in cities for pair in city.recognition_pairs()]
    if with_costs and pairs:
        others = tuple(job.name for job in jobs)
        jobs.append(_cost_job(pairs[0], files, chosen, protocol, others))
    return jobs


def _plan_city(
    city: City,
    files: StudyFiles,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
) -> list[Job]:
    jobs = [
        survey_job(
            recording.name,
            recording.source,
            roles,
            methods,
            protocol,
            files.survey(recording.name),
            recording.needs,
        )
        for recording, roles in _roles(city, protocol)
    ]
    stages = city.stages.values()
    jobs.append(
        Job(
            name=f"draw {city.name}",
            step=DrawCity(
                city.name,
                tuple((r.stage, files.survey(r.name)) for r in stages),
                files.figures / routes_stem(city),
                files.page_drives(city.name),
            ),
            needs=_survey_names(stages),
            cost=_START_COST + _CITY_COST,
        )
    )
    jobs += [_change_job(city, pair, files) for pair in city.change_pairs()]
    jobs += [
        _recognition_job(city, pair, name, methods, protocol, files)
        for name, pair in _compared_pairs(city, protocol).items()
    ]
    return jobs


def _compared_pairs(
    city: City, protocol: RetrievalProtocol
) -> dict[str, tuple[RecordingInfo, RecordingInfo]]:
    """Returns all pairs of database and query, and their controls, by name.

    Two pairs may share a control.
    """
    pairs = city.recognition_pairs(
        with_itself=protocol.exclude_recent is not None
    )
    named = {_pair_name(city, pair): pair for pair in pairs}
    for pair in pairs:
        control = city.unchanged_pair(*pair)
        if control is not None:
            database, query = control
            name = f"control {database.name} > {query.name}"
            named[name] = control
    return named


def _pair_name(city: City, pair: tuple[RecordingInfo, RecordingInfo]) -> str:
    database, query = pair
    return f"{city.name} {database.stage} > {query.stage}"


def _roles(
    city: City, protocol: RetrievalProtocol
) -> list[tuple[RecordingInfo, set[Role]]]:
    """Returns all drives that are needed, with their roles."""
    roles: dict[str, tuple[RecordingInfo, set[Role]]] = {}

    def need(recording: RecordingInfo, *new: Role) -> None:
        roles.setdefault(recording.name, (recording, set()))[1].update(new)

    for recording in city.stages.values():
        need(recording)
    for pair in city.change_pairs():
        control = city.control(*pair)
        if control is not None:
            need(control)
    for database, query in _compared_pairs(city, protocol).values():
        need(database, "places")
        need(query, "queries")
    return list(roles.values())


def _change_job(
    city: City, pair: tuple[RecordingInfo, RecordingInfo], files: StudyFiles
) -> Job:
    control = city.control(*pair)
    drives = [*pair] if control is None else [*pair, control]
    earlier, later = pair
    surveys = tuple(files.survey(one.name) for one in drives)
    change = files.change(earlier.name, later.name)
    first, second = change_stems(city, pair)
    return Job(
        name=f"change {city.name} {earlier.stage} > {later.stage}",
        step=Steps(
            change,
            (
                MeasureChange(
                    city.name, (earlier.stage, later.stage), surveys, change
                ),
                DrawChange(
                    (surveys[0], surveys[1]),
                    change,
                    (files.figures / first, files.figures / second),
                    files.drawn(first),
                ),
            ),
        ),
        needs=_survey_names(drives),
        cost=_START_COST + _CHANGE_COST,
    )


def _recognition_job(
    city: City,
    pair: tuple[RecordingInfo, RecordingInfo],
    name: str,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    files: StudyFiles,
) -> Job:
    database, query = pair
    cost = sum(
        _RECOGNITION_COST.get(method.name, _OTHER_RECOGNITION_COST)
        for method in methods
    )
    surveys = files.survey(database.name), files.survey(query.name)
    results = files.recognition(database.name, query.name)
    steps: tuple[PartStep, ...] = tuple(
        RecognisePlaces(
            city.name,
            (database.stage, query.stage),
            surveys,
            method,
            protocol,
            results.result(method),
        )
        for method in methods
    )
    if name == _pair_name(city, pair):
        cost += _EVIDENCE_COST
        evidence = FindEvidence(
            (database.source, query.source),
            surveys,
            methods,
            results,
            protocol,
            results.evidence,
        )
        steps = (*steps, evidence)
    return Job(
        name=name,
        step=Steps(results.folder, steps),
        needs=_survey_names(pair),
        cost=_START_COST + cost,
    )


def _cost_job(
    pair: tuple[RecordingInfo, RecordingInfo],
    files: StudyFiles,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    others: tuple[str, ...],
) -> Job:
    """Returns the job that runs after all others, alone on the machine."""
    database, query = pair
    return Job(
        name="costs of the methods",
        step=MeasureCosts(
            query.source,
            (files.survey(database.name), files.survey(query.name)),
            methods,
            protocol,
            files.costs,
        ),
        needs=others,
        cost=_START_COST + _COSTS_COST,
    )


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
        source: see `Survey`.
        roles: likewise.
        methods: likewise.
        protocol: likewise.
        files: likewise.
        needs: names of the jobs that make the recording.
    """
    survey = Survey(source, frozenset(roles), methods, protocol, files)
    return Job(
        name=f"survey {name}",
        step=survey,
        needs=needs,
        cost=_START_COST + _MAP_COST + sum(_ROLE_COST[r] for r in survey.roles),
    )


def _survey_names(recordings: Iterable[RecordingInfo]) -> tuple[str, ...]:
    return tuple(f"survey {recording.name}" for recording in recordings)
