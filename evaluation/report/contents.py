"""The contents of a report: results, drives and figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import functools

from evaluation.change.drive_change import ChangeResult
from evaluation.recognition.costs import Cost
from evaluation.recognition.fault_names import PairEvidence
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report.illustrations import Illustration
from evaluation.report.page_data import PageDrive
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.report.tables import survival
from evaluation.report.tables.differences import MethodDifference
from evaluation.report.tables.queries import DriveTrack
from evaluation.results.table import Results

# A result, and the result on its control, if there is one.
Controlled = tuple[PlaceOutcome, PlaceOutcome | None]


@dataclass
class Report:
    """The contents of a report.

    Attributes:
        results: the results of all pairs and of their controls, with or without
            geometric verification as the report's protocol says.
        changes: change between the stages of each map.
        pairs: place recognition results of each pair of drives and, if there
            is one, of its control (the same routes without a change of the
            city).
        recognitions: place recognition of all pairs, but not of their controls;
            and of drives compared with themselves.
        sessions: place recognition in databases of several drives through one
            stage, each next to the database that contains only the first of
            these drives.
        differences: AUC differences between methods.
        evidence: (database, query) -> evidence on why the top-ranked place of a
            query is wrong.
        tracks: drive -> time stamps and poses, also for the controls.
        drives: drive -> what the page shows of it.
        illustrations: figures, in the order of the page.
        costs: time and memory of each method.
        notes: notes for the reader.
        made_by: version, protocol and settings of methods that made the report.
        pages: drive -> address of the web page of its recording, relative to
            the report; drives without a page may be left out.
        reference: published numbers to compare with.
        repeated: results by the protocol of the published numbers, if this
            protocol differs from the report's protocol.
    """

    results: Results = field(default_factory=lambda: Results((), ()))
    changes: list[ChangeResult] = field(default_factory=list)
    pairs: list[Controlled] = field(default_factory=list)
    recognitions: list[PlaceOutcome] = field(default_factory=list)
    sessions: list[PlaceOutcome] = field(default_factory=list)
    differences: Sequence[MethodDifference] = ()
    evidence: dict[tuple[str, str], PairEvidence] = field(default_factory=dict)
    tracks: dict[str, DriveTrack] = field(default_factory=dict)
    drives: dict[str, PageDrive] = field(default_factory=dict)
    illustrations: list[Illustration] = field(default_factory=list)
    costs: Sequence[Cost] = ()
    notes: Sequence[str] = ()
    made_by: Sequence[str] = ()
    pages: Mapping[str, str] = field(default_factory=dict)
    reference: Reference = NO_REFERENCE
    repeated: list[PlaceOutcome] = field(default_factory=list)

    @functools.cached_property
    def survivals(self) -> list[survival.Survival]:
        """Results of each method with and without change, on each pair."""
        stages = {
            name: stage
            for outcome, _ in self.pairs
            for name, stage in zip(
                (outcome.database, outcome.query),
                outcome.pair[1:],
                strict=True,
            )
        }
        return survival.survivals(self.results.rows, stages)

    @property
    def compared(self) -> list[PlaceOutcome]:
        """Results for which there are published numbers to compare."""
        known = filter(self.reference.covers, self.recognitions)
        return [*known, *self.repeated]
