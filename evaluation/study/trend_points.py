"""A database of a trend: its change, and the AUC of each method."""

from __future__ import annotations

from dataclasses import dataclass
import math
from pathlib import Path

from cns_drake.base.jobs.step import Reporter
from evaluation.change.tcr import temporal_change
from evaluation.drives import check_same_world
from evaluation.recognition.place_recognition import judge_retrieval
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import compare as score
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.drive_source import DriveSource
from evaluation.study.parts import PartStep, part_digest, read_part
from evaluation.study.recording_survey import survey_recording
from evaluation.study.study_layout import SurveyFiles


@dataclass(frozen=True)
class TrendPoint:
    """A method on one database.

    Attributes:
        database: name of the drive.
        method: its name.
        tcr_sym: between database and query.
        auc, auc_low, auc_high: with its 95 % interval over queries.
        recall_at_1: over queries with a match.
        queries, with_match: numbers of queries, and of those with a match.
        protocol: of place recognition.
        auc_unchanged: of the database's control; NaN without one.
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
    auc_unchanged: float = math.nan

    @property
    def kept(self) -> float:
        """Share of AUC that remains after the change; NaN if it is unknown."""
        if not self.auc_unchanged > 0.0:
            return math.nan
        return self.auc / self.auc_unchanged


@dataclass(frozen=True)
class MeasureDatabase(PartStep):
    """Writes the list of `TrendPoint`s of one database.

    Attributes:
        source: opens the database, which is in the world of the query.
        query: survey of the query drive.
        methods: to run.
        protocol: of place recognition.
        part: to write.
    """

    source: DriveSource
    query: SurveyFiles
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    part: Path

    def inputs(self) -> dict[str, object]:
        return {
            "drive": self.source.identity(),
            "protocol": self.protocol.to_json(),
            "query": part_digest(self.query.drive),
            "queries": [
                part_digest(self.query.described(one)) for one in self.methods
            ],
            "methods": [method.inputs() for method in self.methods],
        }

    def make(self, reporter: Reporter) -> list[TrendPoint]:
        running = [method.make() for method in self.methods]
        database = survey_recording(
            self.source(), {"places"}, running, self.protocol, reporter.track
        )
        query_track = read_part(self.query.drive)
        check_same_world(database.drive.placed, query_track.placed)
        change = temporal_change(
            database.drive.coarse.centroids_W, query_track.coarse.centroids_W
        )
        points = []
        for choice, method in zip(self.methods, running, strict=True):
            _, queries = read_part(self.query.described(choice))
            places = database.described[method.name]
            found = judge_retrieval(
                method,
                places.name,
                queries.name,
                score(method, places, queries, self.protocol),
                self.protocol,
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
                )
            )
        return points
