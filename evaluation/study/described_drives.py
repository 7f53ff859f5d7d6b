"""Descriptions of a drive's places or queries, without its map."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cns_drake.base.jobs.step import Reporter, Step
from evaluation.drives.drive_views import RecentScans
from evaluation.recognition.description import (
    DescribedDrive,
    Role,
    describe_drive,
)
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.drive_source import DriveSource
from evaluation.study.parts import is_current, write_part
from evaluation.study.study_layout import SurveyFiles


@dataclass(frozen=True)
class DescribeDrive(Step):
    """Writes each method's descriptions of a drive.

    Only the scans that are described are read.

    Attributes:
        source: opens the drive.
        role: of the drive.
        methods: that describe it.
        protocol: where it has places and queries.
        files: to write; only those of the descriptions, and of the scans.
        with_scans: whether to keep the described scans, too.
    """

    source: DriveSource
    role: Role
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    files: SurveyFiles
    with_scans: bool = False

    @property
    def output(self) -> Path:
        return self.files.folder

    def is_done(self) -> bool:
        return not self._missing()

    def run(self, reporter: Reporter) -> None:
        missing = self._missing()
        methods = [one for one in self.methods if self._file(one) in missing]
        scans: list[np.ndarray] | None = [] if self.with_scans else None
        found = describe(
            self.source, self.role, methods, self.protocol, reporter, scans
        )
        for choice in methods:
            # Each value is dropped when it is written.
            file = self._file(choice)
            write_part(file, missing[file], found.pop(choice.name))
        if self.files.scans in missing:
            write_part(self.files.scans, missing[self.files.scans], scans)

    def _file(self, method: MethodChoice) -> Path:
        return self.files.described(method)

    def _missing(self) -> dict[Path, dict]:
        """Returns the missing parts, and their inputs."""
        inputs = self.made_of(
            {
                "drive": self.source.identity(),
                "role": self.role,
                "protocol": self.protocol.described(),
            }
        )
        parts = {
            self._file(method): {**inputs, "method": method.inputs()}
            for method in self.methods
        }
        if self.with_scans:
            parts[self.files.scans] = inputs
        return {
            file: made_of
            for file, made_of in parts.items()
            if not is_current(file, made_of)
        }


def describe(
    source: DriveSource,
    role: Role,
    methods: Iterable[MethodChoice],
    protocol: RetrievalProtocol,
    reporter: Reporter,
    scans: list[np.ndarray] | None = None,
) -> dict[str, DescribedDrive]:
    """Returns name of method -> its descriptions of a drive.

    Args:
        source: opens the drive.
        role: of the drive.
        methods: that describe it.
        protocol: where it has places and queries.
        reporter: takes the progress.
        scans: gets the single scan (N, 3) float32 of each described frame, in
            the frame of the sensor.

    Raises:
        InputError: see `describe_drive`.
    """
    running = [choice.make() for choice in methods]
    kept = max(map(protocol.scans, running), default=1)
    drive = RecentScans(source(), kept)

    def keep(_: int, scan: np.ndarray) -> None:
        assert scans is not None
        scans.append(scan.astype(np.float32))

    found = describe_drive(
        drive,
        running,
        {role},
        protocol,
        reporter.track,
        visit=None if scans is None else keep,
    )
    return {
        method.name: one for method, one in zip(running, found, strict=True)
    }
