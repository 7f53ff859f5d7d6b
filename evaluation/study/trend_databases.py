"""A query drive and many databases: their change and their AUC.

Each database is a separate job.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path

import numpy as np

from cns_drake.base.drives.drive import driven_way
from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.jobs.step import Reporter
from evaluation.change.tcr import temporal_change
from evaluation.drives import Drive, check_same_world, open_drive
from evaluation.drives.sampling import gather
from evaluation.recognition.description import Role
from evaluation.recognition.fault_kinds import mean_visible_change
from evaluation.recognition.overlap_truth import best_overlaps
from evaluation.recognition.place_recognition import judge_retrieval
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.recognition.retrieval import Retrieval
from evaluation.recognition.retrieval import compare as score
from evaluation.study import surveys
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.parts import MakePart, Part, StudyFiles


@dataclass(frozen=True)
class TrendPoint:
    """A method on one database.

    Attributes:
        auc, auc_low, auc_high: with its 95 % interval over blocks of the
            route.
        recall_at_1: over queries with a match.
        auc_strict: with recall = TP / N.
        auc_unchanged: AUC of the database's control; NaN without one.
        visible_change: mean over queries, see `PairEvidence`.
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
    protocol: RetrievalProtocol
    auc_strict: float
    auc_unchanged: float = math.nan
    visible_change: float = math.nan

    @property
    def failure(self) -> float:
        """What is missing of a perfect AUC."""
        return 1.0 - self.auc

    @property
    def kept(self) -> float:
        """Share of AUC that remains after the change; NaN if it is unknown."""
        if not self.auc_unchanged > 0.0:
            return math.nan
        return self.auc / self.auc_unchanged


def measure_trend(
    query: Path,
    databases: Sequence[Path],
    output: Path,
    cluster: Cluster,
    own_methods: Iterable[Path] = (),
    protocol: RetrievalProtocol = FAIR_PROTOCOL,
    controls: Sequence[Path] = (),
    lidar: str | None = None,
    settings: Iterable[str] = (),
) -> list[TrendPoint]:
    """Returns the points of all databases and methods.

    Results of an earlier run, finished or not, are used if they belong to the
    same recordings and methods. Only the points of a database are kept, because
    the surveys of many would fill a disk. Controls are drives on the routes of
    databases, but in the stage of the query; each serves the databases whose
    route it has.

    Raises:
        InputError: a recording cannot be read, two have one name, a control
            serves no database, or a database is of another world or shares
            no place with the query.
    """
    methods = choose_methods(own_methods, settings)
    query_drive = open_drive(query, lidar)
    names = {query_drive.name}
    if protocol.exclude_recent is not None:
        # For loop closure a drive may be its own database.
        names = set()
    opened: dict[Path, Drive] = {}
    for path in (*databases, *controls):
        drive = open_drive(path, lidar)
        if drive.name in names:
            raise InputError(f"{path}: {drive.name} is there twice")
        names.add(drive.name)
        check_same_world(drive, query_drive)
        opened[path] = drive
    serving: dict[str, str | None] = {}
    for path in databases:
        way = driven_way(opened[path].scenario)
        same = [
            opened[control].name
            for control in controls
            if way is not None and driven_way(opened[control].scenario) == way
        ]
        serving[opened[path].name] = same[0] if same else None
    for path in controls:
        if opened[path].name not in serving.values():
            raise InputError(f"--control: {path}: no database has its route")
    return measure_drives(
        query_drive.name,
        surveys.RecordedDrive(query.absolute(), lidar),
        {
            drive.name: surveys.RecordedDrive(path.absolute(), lidar)
            for path, drive in opened.items()
        },
        serving,
        output,
        cluster,
        methods,
        protocol,
    )


def measure_drives(
    query_name: str,
    query: surveys.DriveSource,
    sources: Mapping[str, surveys.DriveSource],
    controls: Mapping[str, str | None],
    output: Path,
    cluster: Cluster,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol = FAIR_PROTOCOL,
) -> list[TrendPoint]:
    """Returns the points of drives that need not be recorded.

    The sources, by name, open databases and controls. A database has a control
    on its route through the city of the query, or None.

    Raises:
        InputError: see `measure_trend`.
    """
    files = StudyFiles(output.absolute())
    make_folder(output)
    survey = files.survey(query_name)
    asked = frozenset[Role]({"queries"})
    step = surveys.Survey(
        query, asked, methods, protocol, survey, with_scans=True
    )
    jobs = [Job(f"survey {query_name}", step)]
    parts = {name: files.part("trend", name, query_name) for name in sources}
    shared = (
        (survey.drive, survey.scans),
        tuple(survey.described(one.name) for one in methods),
        methods,
        protocol,
    )
    jobs += [
        Job(
            f"measure {name}",
            MakePart(part, measure_database, (sources[name], *shared)),
            (jobs[0].name,),
        )
        for name, part in parts.items()
    ]
    run_jobs(jobs, cluster)
    points: list[TrendPoint] = []
    for name, control in controls.items():
        unchanged = {}
        if control is not None:
            measured = parts[control].read()
            unchanged = {point.method: point.auc for point in measured}
        points += [
            replace(point, auc_unchanged=unchanged.get(point.method, math.nan))
            for point in parts[name].read()
        ]
    return points


def measure_database(
    reporter: Reporter,
    source: surveys.DriveSource,
    surveyed: tuple[Part, Part],
    described: tuple[Part, ...],
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
) -> list[TrendPoint]:
    """Returns the points of one database, in the world of the query.

    The query drive is a `SurveyedDrive` and `KeptScans`, and is described by
    each method.
    """
    running = [method.make() for method in methods]
    database = surveys.survey_recording(
        source(), {"places"}, running, protocol, reporter.track, with_scans=True
    )
    drive, scans = database.drive, database.scans
    assert drive is not None
    assert isinstance(scans, surveys.KeptScans)
    query_track, query_scans = (part.read() for part in surveyed)
    check_same_world(database.placed, query_track.placed)
    change = temporal_change(
        drive.coarse.centroids_W, query_track.coarse.centroids_W
    )
    points: list[TrendPoint] = []
    visible_change = math.nan
    for method, part in zip(running, described, strict=True):
        _, queries = part.read()
        places = database.described[method.name]
        retrieval = score(method, places, queries, protocol)
        found = judge_retrieval(
            method, places.name, queries.name, retrieval, protocol
        )
        if not points:
            # Matches do not depend on the method.
            visible_change = _visible_change(
                surveys.KeptDrive(drive, scans),
                surveys.KeptDrive(query_track, query_scans),
                retrieval,
                protocol,
            )
        metrics = found.metrics
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
                protocol=found.protocol,
                auc_strict=float(metrics.auc_strict),
                visible_change=visible_change,
            )
        )
    return points


def _visible_change(
    database: surveys.KeptDrive,
    query: surveys.KeptDrive,
    retrieval: Retrieval,
    protocol: RetrievalProtocol,
) -> float:
    """Returns the mean over queries, see `PairEvidence`."""
    is_match = np.any(retrieval.matches, axis=0).tolist()
    place_scans = [
        gather(database, frame, 1, protocol.max_range)
        if is_needed
        else np.empty((0, 3))
        for frame, is_needed in zip(
            retrieval.database_frames.tolist(), is_match, strict=True
        )
    ]
    frames = retrieval.query_frames
    query_scans = [protocol.query_scan(query, k) for k in frames.tolist()]
    overlaps = best_overlaps(
        place_scans,
        database.X_WS[retrieval.database_frames],
        query_scans,
        protocol.query_poses(query.X_WS[frames], frames),
        retrieval.matches,
    )
    return mean_visible_change(overlaps)[0]
