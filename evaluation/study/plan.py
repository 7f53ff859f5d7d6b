"""The whole benchmark: its jobs, and the report of a folder of recordings."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.jobs.step import Steps
from evaluation.recognition.description import Role
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.study.assembly import assemble
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.collection import (
    City,
    Pair,
    RecordingInfo,
    Repetition,
    find_recordings,
    group_cities,
)
from evaluation.study.fault_evidence import explain_faults
from evaluation.study.figures import (
    change_stems,
    draw_changes,
    draw_city,
    figure_files,
    routes_stem,
)
from evaluation.study.measurements import (
    measure_change,
    measure_costs,
    recognise_places,
)
from evaluation.study.parts import MakePart, StudyFiles
from evaluation.study.surveys import Description, Survey

# Expected seconds to start a process with its imports, and for the maps of a
# drive of 3000 scans with 250 places and 150 queries.
_START_COST = 2.0
_MAP_COST = 10.0
_ROLE_COST = {"places": 12.0, "queries": 8.0}
# Those of the other jobs, beyond their start.
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
    protocol: RetrievalProtocol = FAIR_PROTOCOL,
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
        protocol: that of place recognition.
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


def write_report(
    recordings: Path,
    output: Path,
    cluster: Cluster,
    own_methods: Iterable[Path] = (),
    protocol: RetrievalProtocol = FAIR_PROTOCOL,
    on_note: Callable[[str], None] = lambda text: None,
    *,
    settings: Iterable[str] = (),
    with_costs: bool = False,
    reference_for: Callable[[set[str]], Reference] = lambda maps: NO_REFERENCE,
    lidar: str | None = None,
) -> Path:
    """Measures all recordings in a folder; writes tables, figures, a page.

    See `evaluation.study` for the files. Results of an earlier run, finished
    or not, are used if they belong to the same recordings and methods.

    Args:
        recordings: folder of recordings; drives of one map that share stage
            and route with others serve as same-stage controls.
        output: folder to write, made if needed.
        cluster: where the work is done.
        own_methods: Python files with one method each, to run besides those
            of this package.
        protocol: that of place recognition.
        on_note: gets notes on recordings that are left out, and on cities
            without a pair to compare.
        settings: see `choose_methods`.
        with_costs: whether to measure the costs of the methods, too.
        reference_for: returns the reference for the report of some maps.
        lidar: name of the LiDAR, for recordings with several.

    Returns:
        The path of `report.html`.

    Raises:
        InputError: a recording cannot be read, or the output cannot be
            written.
    """
    methods = choose_methods(own_methods, settings)
    found = find_recordings(recordings, on_note, lidar)
    reference = reference_for({one.map_name for one in found})
    jobs = plan_study(
        found,
        output,
        methods,
        protocol,
        with_costs=with_costs,
        reference=reference,
    )
    make_folder(output)
    run_jobs(jobs, cluster)
    return assemble(
        found,
        output,
        methods,
        protocol=protocol,
        with_costs=with_costs,
        reference=reference,
        on_note=on_note,
    )


def _plan_city(
    city: City,
    files: StudyFiles,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
) -> list[Job]:
    compared = _compared_pairs(city, protocol)
    explained = {
        one.name
        for name, pair in compared.items()
        if name == _pair_name(city, pair)
        for one in pair
    }
    repeated = [
        (pair, city.repetitions(pair, methods, protocol))
        for pair in city.recognition_pairs()
    ]
    jobs = [
        Job(
            name=f"survey {recording.name}",
            step=Survey(
                recording.source,
                frozenset(roles),
                methods,
                protocol,
                files.survey(recording.name),
                with_scans=recording.name in explained,
                further=_further(recording, repeated),
            ),
            needs=recording.needs,
            cost=_START_COST
            + _MAP_COST
            + sum(_ROLE_COST[role] for role in roles),
        )
        for recording, roles in _roles(city, protocol)
    ]
    stages = city.stages.values()
    stem = files.figures / routes_stem(city)
    shown = tuple(
        (one.stage, files.survey(one.name).drive, files.survey(one.name).fine)
        for one in stages
    )
    jobs.append(
        Job(
            name=f"draw {city.name}",
            step=MakePart(
                files.page_drives(city.name),
                draw_city,
                (city.name, shown, stem),
                figure_files(stem),
            ),
            needs=_survey_names(stages),
            cost=_START_COST + _CITY_COST,
        )
    )
    jobs += [_change_job(city, pair, files) for pair in city.change_pairs()]
    jobs += [
        _recognition_job(city, pair, name, methods, protocol, files)
        for name, pair in compared.items()
    ]
    return jobs


def _compared_pairs(city: City, protocol: RetrievalProtocol) -> dict[str, Pair]:
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


def _pair_name(city: City, pair: Pair) -> str:
    database, query = pair
    return f"{city.name} {database.stage} > {query.stage}"


def _further(
    recording: RecordingInfo,
    repeated: Iterable[tuple[Pair, Sequence[Repetition]]],
) -> tuple[Description, ...]:
    """Returns what repetitions describe of a drive."""
    roles: dict[Repetition, set[Role]] = {}
    for (database, query), found in repeated:
        for one in found:
            if query is recording:
                roles.setdefault(one, set()).add("queries")
            if database is recording and not one.shares_places:
                roles.setdefault(one, set()).add("places")
    return tuple(
        Description(one.method, frozenset(needed), one.protocol)
        for one, needed in roles.items()
    )


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


def _change_job(city: City, pair: Pair, files: StudyFiles) -> Job:
    control = city.control(*pair)
    drives = [*pair] if control is None else [*pair, control]
    earlier, later = pair
    surveys = tuple(files.survey(one.name) for one in drives)
    change = files.change(earlier.name, later.name)
    names = change_stems(city, pair)
    stems = tuple(files.figures / name for name in names)
    shown = tuple((survey.drive, survey.fine) for survey in surveys[:2])
    stages = earlier.stage, later.stage
    return Job(
        name=f"change {city.name} {earlier.stage} > {later.stage}",
        step=Steps(
            change.path,
            (
                MakePart(
                    change,
                    measure_change,
                    (city.name, stages, tuple(one.drive for one in surveys)),
                ),
                MakePart(
                    files.drawn(names[0]),
                    draw_changes,
                    (change, shown, stems),
                    figure_files(*stems),
                ),
            ),
        ),
        needs=_survey_names(drives),
        cost=_START_COST + _CHANGE_COST,
    )


def _recognition_job(
    city: City,
    pair: Pair,
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
    stages = database.stage, query.stage

    def recognise(
        method: MethodChoice,
        protocol: RetrievalProtocol,
        places_key: str,
        key: str,
    ) -> MakePart:
        described = surveys[0].described(places_key), surveys[1].described(key)
        return MakePart(
            results.result(key),
            recognise_places,
            (city.name, stages, described, method, protocol),
        )

    steps = [recognise(one, protocol, one.name, one.name) for one in methods]
    if name == _pair_name(city, pair):
        cost += _EVIDENCE_COST
        evidence = MakePart(
            results.evidence,
            explain_faults,
            (
                tuple((survey.drive, survey.scans) for survey in surveys),
                methods,
                tuple(results.result(method.name) for method in methods),
                protocol,
            ),
        )
        repeated = (
            recognise(one.method, one.protocol, one.places_key, one.key)
            for one in city.repetitions(pair, methods, protocol)
        )
        steps += [evidence, *repeated]
    return Job(
        name=name,
        step=Steps(results.folder, tuple(steps)),
        needs=_survey_names(pair),
        cost=_START_COST + cost,
    )


def _cost_job(
    pair: Pair,
    files: StudyFiles,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    others: tuple[str, ...],
) -> Job:
    """Returns the job that runs after all others, alone on the machine."""
    query = pair[1]
    surveys = tuple(files.survey(one.name) for one in pair)
    described = tuple(
        tuple(survey.described(method.name) for survey in surveys)
        for method in methods
    )
    return Job(
        name="costs of the methods",
        step=MakePart(
            files.costs,
            measure_costs,
            (query.source, surveys[1].drive, methods, described, protocol),
        ),
        needs=others,
        cost=_START_COST + _COSTS_COST,
    )


def _survey_names(recordings: Iterable[RecordingInfo]) -> tuple[str, ...]:
    return tuple(f"survey {recording.name}" for recording in recordings)
