"""One rung of a ladder: all methods find a query drive in a database.

Each method has two results, without the gate and with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cns_drake.base.jobs.step import Reporter
from evaluation.recognition.description import (
    DescribedDrive,
    DescribedScans,
    Role,
)
from evaluation.recognition.overlap_truth import best_overlaps
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import compare_both_ways
from evaluation.recognition.rung_outcome import RungOutcome
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.described_drives import describe
from evaluation.study.drive_source import DriveSource
from evaluation.study.parts import PartStep, part_digest, read_part
from evaluation.study.study_layout import SurveyFiles

# Distance between a city and the next distracting one [m]. No scan reaches so
# far.
_APART = 1e5


@dataclass(frozen=True)
class RungDrive:
    """A drive of a rung.

    Attributes:
        source: opens it.
        files: files of its descriptions and scans, if several rungs use them;
            None if only this rung does.
    """

    source: DriveSource
    files: SurveyFiles | None = None


@dataclass(frozen=True)
class MeasureRung(PartStep):
    """Writes the list of `RungOutcome`s of a rung, two for each method.

    Attributes:
        database: drive of the places.
        query: drive of the queries, in the same world frame.
        distractors: descriptions of drives through other cities, whose places
            are added to the database.
        num_distractors: number of these places.
        methods: to run.
        protocol: of place recognition.
        part: to write.
    """

    database: RungDrive
    query: RungDrive
    distractors: tuple[SurveyFiles, ...]
    num_distractors: int
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    part: Path

    def inputs(self) -> dict[str, object]:
        return {
            "database": self._identity(self.database),
            "query": self._identity(self.query),
            "distractors": [self._digests(one) for one in self.distractors],
            "number": self.num_distractors,
            "protocol": self.protocol.to_json(),
            "methods": [method.inputs() for method in self.methods],
        }

    def make(self, reporter: Reporter) -> list[RungOutcome]:
        place_scans: list[np.ndarray] = []
        query_scans: list[np.ndarray] = []
        places = self._described(self.database, "places", reporter, place_scans)
        queries = self._described(self.query, "queries", reporter, query_scans)
        overlaps = None
        found = []
        for choice in reporter.track(
            self.methods, "comparing", len(self.methods)
        ):
            database = places.pop(choice.name, None) or read_part(
                _file(self.database, choice)
            )
            query = queries.pop(choice.name, None) or read_part(
                _file(self.query, choice)
            )
            others = [
                read_part(one.described(choice)) for one in self.distractors
            ]
            known = [database, *others]
            searched = replace(
                database,
                places=joined_places(
                    [one.places for one in known], self.num_distractors
                ),
            )
            drives = [one.name for one in known for _ in one.places.frames]
            both = compare_both_ways(
                choice.make(), searched, query, self.protocol
            )
            if overlaps is None:
                overlaps = best_overlaps(
                    place_scans,
                    database.places.X_WS,
                    query_scans,
                    query.queries.X_WS,
                    both[0].matches[:, : len(place_scans)],
                )
            found += [
                RungOutcome.of(
                    choice.name, is_gated, one, query, drives, overlaps
                )
                for is_gated, one in zip((False, True), both, strict=True)
            ]
        return found

    def _described(
        self,
        drive: RungDrive,
        role: Role,
        reporter: Reporter,
        scans: list[np.ndarray],
    ) -> dict[str, DescribedDrive]:
        """Returns descriptions that are not in files, with all scans."""
        if drive.files is not None:
            scans += read_part(drive.files.scans)
            return {}
        return describe(
            drive.source, role, self.methods, self.protocol, reporter, scans
        )

    def _identity(self, drive: RungDrive) -> object:
        if drive.files is None:
            return drive.source.identity()
        return [*self._digests(drive.files), part_digest(drive.files.scans)]

    def _digests(self, files: SurveyFiles) -> list[str]:
        return [part_digest(files.described(one)) for one in self.methods]


def joined_places(
    drives: Sequence[DescribedScans], num_others: int
) -> DescribedScans:
    """Returns the places of a drive together with places of others.

    Args:
        drives: the first is that of the query's world. The others are moved so
            far away that none of their places is a match.
        num_others: greatest number of places of the others, from the first one
            on.
    """
    first, *others = drives
    poses = [first.X_WS]
    for number, one in enumerate(others, start=1):
        X_WS = one.X_WS.copy()
        X_WS[:, 0, 3] += number * _APART
        poses.append(X_WS)
    end = len(first.frames) + num_others
    return DescribedScans(
        frames=np.concatenate([one.frames for one in drives])[:end],
        stamps_ns=np.concatenate([one.stamps_ns for one in drives])[:end],
        X_WS=np.concatenate(poses)[:end],
        descriptors=[d for one in drives for d in one.descriptors][:end],
        clouds=[cloud for one in drives for cloud in one.clouds][:end],
    )


def _file(drive: RungDrive, choice: MethodChoice) -> Path:
    assert drive.files is not None
    return drive.files.described(choice)
