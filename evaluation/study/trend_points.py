"""One drive that asks, and many databases: their change and their AUC.

Every database is a job of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from evaluation.change.tcr import temporal_change
from evaluation.jobs.cluster import Cluster
from evaluation.jobs.running import Job, Tell, run_jobs
from evaluation.recognition.place_recognition import judge_retrieval
from evaluation.recognition.retrieval import compare as score
from evaluation.sequences import check_same_world, open_sequence
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.drive_source import DriveSource, RecordedDrive
from evaluation.study.parts import (
    is_current,
    part_digest,
    read_part,
    write_part,
)
from evaluation.study.recording_survey import survey_recording
from evaluation.study.study_layout import StudyFiles, SurveyFiles
from evaluation.study.surveys import survey_inputs, survey_job, tracking
from evaluation.support.errors import InputError
from evaluation.support.files import make_folder

# Expected seconds for a database.
_COST = 30.0


@dataclass(frozen=True)
class TrendPoint:
    """A method on one database.

    Attributes:
        database: name of the drive.
        method: its name.
        tcr_sym: between database and query.
        auc, auc_low, auc_high: with its 95 % interval over queries.
        recall_at_1: over queries with a match.
        queries, with_match: how many.
    """

    database: str
    method: str
    tcr_sym: float
    auc: float
    auc_low: float
    auc_high: float
    recall_at_1: float
    queries: int
    with_match: int


def measure_trend(
    query: Path,
    databases: Sequence[Path],
    output: Path,
    cluster: Cluster,
    own_methods: Iterable[Path] = (),
) -> list[TrendPoint]:
    """Returns the points of all databases and methods.

    What an earlier run left, finished or not, is used as far as it belongs
    to the same recordings and methods. Of a database only its points are
    left, since the surveys of many would fill a disk.

    Args:
        query: the drive that asks.
        databases: the drives that are asked.
        output: folder for intermediate results, made if needed.
        cluster: where the work is done.
        own_methods: Python files with one method each, to run besides those
            of this package.

    Raises:
        InputError: a recording cannot be read, two have one name, or a
            database is of another world or shares no place with the query.
    """
    methods = choose_methods(own_methods)
    asking = open_sequence(query)
    sources: dict[str, DriveSource] = {}
    for path in databases:
        sequence = open_sequence(path)
        if sequence.name in sources or sequence.name == asking.name:
            raise InputError(f"{path}: {sequence.name} is there twice")
        sources[sequence.name] = _recorded(path)
        check_same_world(sequence, asking)
    return measure_drives(
        asking.name, _recorded(query), sources, output, cluster, methods
    )


def measure_drives(
    asking: str,
    query: DriveSource,
    databases: Mapping[str, DriveSource],
    output: Path,
    cluster: Cluster,
    methods: tuple[MethodChoice, ...],
) -> list[TrendPoint]:
    """Returns the points of drives that need not be recorded.

    Args:
        asking: name of the drive that asks.
        query: opens it.
        databases: name -> what opens a drive that is asked.
        output: folder for intermediate results, made if needed.
        cluster: where the work is done.
        methods: to run.

    Raises:
        InputError: see `measure_trend`.
    """
    files = StudyFiles(output.absolute())
    make_folder(output)
    survey = files.survey(asking)
    jobs = [survey_job(asking, query, {"queries"}, methods, survey)]
    points = {name: files.trend_points(name, asking) for name in databases}
    jobs += [
        Job(
            name=f"measure {name}",
            function=measure_database,
            arguments=(databases[name], survey, methods, result),
            needs=(jobs[0].name,),
            cost=_COST,
            output=result,
            is_done=is_database_measured,
        )
        for name, result in points.items()
    ]
    run_jobs(jobs, cluster)
    return [point for path in points.values() for point in read_part(path)]


def measure_database(
    source: DriveSource,
    query: SurveyFiles,
    methods: tuple[MethodChoice, ...],
    result: Path,
    tell: Tell,
) -> None:
    """Writes the points of one database: a job.

    Args:
        source: opens the database.
        query: survey of the drive that asks.
        methods: to run.
        result: to write.
        tell: is told how far it is.

    Raises:
        InputError: if the database cannot be read, no query has a match, or
            a file cannot be read or written.
    """
    inputs = _inputs(source, query, methods)
    running = [method.make() for method in methods]
    database = survey_recording(source(), {"places"}, running, tracking(tell))
    asking = read_part(query.drive)
    check_same_world(database.drive.placed, asking.placed)
    change = temporal_change(
        database.drive.coarse.centroids_W, asking.coarse.centroids_W
    )
    points = []
    for choice, method in zip(methods, running, strict=True):
        _, queries = read_part(query.described(choice))
        places = database.described[method.name]
        metrics = judge_retrieval(
            method, places.name, queries.name, score(method, places, queries)
        ).metrics
        points.append(
            TrendPoint(
                database=places.name,
                method=method.name,
                tcr_sym=float(change.symmetric),
                auc=float(metrics.auc),
                auc_low=float(metrics.auc_interval.low),
                auc_high=float(metrics.auc_interval.high),
                recall_at_1=float(metrics.recall_at_1),
                queries=metrics.num_queries,
                with_match=metrics.num_with_match,
            )
        )
    write_part(result, inputs, points)


def is_database_measured(
    source: DriveSource,
    query: SurveyFiles,
    methods: tuple[MethodChoice, ...],
    result: Path,
) -> bool:
    """Tells whether there is nothing to do; see `measure_database`."""
    return is_current(result, _inputs(source, query, methods))


def _inputs(
    source: DriveSource, query: SurveyFiles, methods: tuple[MethodChoice, ...]
) -> dict:
    return {
        **survey_inputs(source, frozenset({"places"})),
        "query": part_digest(query.drive),
        "queries": [part_digest(query.described(one)) for one in methods],
        "methods": [method.inputs() for method in methods],
    }


def _recorded(path: Path) -> RecordedDrive:
    return RecordedDrive(path.absolute())
