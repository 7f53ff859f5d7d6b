"""Which jobs a study consists of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from cns_drake.base.jobs.running import Job
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
from evaluation.study.figure_files import change_stems, routes_stem
from evaluation.study.measurements import (
    are_recognised,
    recognise_places,
)
from evaluation.study.method_costs import are_costs_measured, measure_costs
from evaluation.study.study_layout import StudyFiles
from evaluation.study.surveys import START_COST, survey_job, survey_name
from evaluation.study.views import (
    draw_city,
    is_city_drawn,
    is_measured_and_drawn,
    measure_and_draw,
)

# Expected seconds of the jobs beyond their start: with 3000 scans, 250 places
# and 150 queries.
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


def plan_study(
    recordings: Iterable[RecordingInfo],
    output: Path,
    methods: Sequence[MethodChoice] | None = None,
    protocol: RetrievalProtocol = PAPER_PROTOCOL,
    *,
    with_costs: bool = False,
    reference: Reference = NO_REFERENCE,
) -> list[Job]:
    """Returns the jobs that leave what `assemble` makes a report of.

    A city with one stage only gets its route drawn.

    Args:
        recordings: which need not exist before the jobs that they need are
            done; drives of one map that share stage and route with others
            serve as same-stage controls.
        output: folder to write.
        methods: those of this package if left out.
        protocol: of place recognition.
        with_costs: measure what the methods cost, too, when all else is
            done.
        reference: which the report stands beside.

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
            function=draw_city,
            arguments=(
                city.name,
                tuple((r.stage, files.survey(r.name)) for r in stages),
                files.figures / routes_stem(city),
                files.drawn(routes_stem(city)),
                files.page_drives(city.name),
            ),
            needs=_survey_names(stages),
            cost=START_COST + _CITY_COST,
            output=files.page_drives(city.name),
            is_done=is_city_drawn,
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
    named = {f"{city.name} {d.stage} > {q.stage}": (d, q) for d, q in pairs}
    for pair in pairs:
        control = city.unchanged_pair(*pair)
        if control is not None:
            database, query = control
            name = f"control {database.name} > {query.name}"
            named[name] = control
    return named


def _roles(
    city: City, protocol: RetrievalProtocol
) -> list[tuple[RecordingInfo, set[Role]]]:
    """Returns all drives that are needed, with what they serve as."""
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
    return Job(
        name=f"change {city.name} {earlier.stage} > {later.stage}",
        function=measure_and_draw,
        arguments=(
            city.name,
            (earlier.stage, later.stage),
            tuple(files.survey(one.name) for one in drives),
            files.change(earlier.name, later.name),
            tuple(files.figures / stem for stem in change_stems(city, pair)),
            files.drawn(change_stems(city, pair)[0]),
        ),
        needs=_survey_names(drives),
        cost=START_COST + _CHANGE_COST,
        output=files.change(earlier.name, later.name),
        is_done=is_measured_and_drawn,
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
    results = files.recognition(database.name, query.name)
    return Job(
        name=name,
        function=recognise_places,
        arguments=(
            city.name,
            (database.stage, query.stage),
            (files.survey(database.name), files.survey(query.name)),
            methods,
            protocol,
            results,
        ),
        needs=_survey_names(pair),
        cost=START_COST + cost,
        output=results.folder,
        is_done=are_recognised,
    )


def _cost_job(
    pair: tuple[RecordingInfo, RecordingInfo],
    files: StudyFiles,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    others: tuple[str, ...],
) -> Job:
    """Returns the job that waits for all others, to have the machine alone."""
    database, query = pair
    return Job(
        name="costs of the methods",
        function=measure_costs,
        arguments=(
            query.source,
            (files.survey(database.name), files.survey(query.name)),
            methods,
            protocol,
            files.costs,
        ),
        needs=others,
        cost=START_COST + _COSTS_COST,
        output=files.costs,
        is_done=are_costs_measured,
    )


def _survey_names(recordings: Iterable[RecordingInfo]) -> tuple[str, ...]:
    return tuple(survey_name(recording.name) for recording in recordings)
