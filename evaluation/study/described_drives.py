"""Descriptions of a drive's places or queries, without its map."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cns_drake.base.jobs.step import Step, Tell
from evaluation.recognition.description import (
    DescribedDrive,
    Role,
    describe_drive,
)
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.sequences.recent_scans import RecentScans
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.drive_source import DriveSource
from evaluation.study.parts import is_current, write_part
from evaluation.study.study_layout import SurveyFiles


@dataclass(frozen=True)
class DescribeDrive(Step):
    """Writes what each method keeps of a drive.

    Only the scans that are described are read.

    Attributes:
        source: opens the drive.
        role: what the drive serves as.
        methods: that describe it.
        protocol: where it has places and queries.
        files: to write; only those of the descriptions.
    """

    source: DriveSource
    role: Role
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    files: SurveyFiles

    @property
    def output(self) -> Path:
        return self.files.folder

    def is_done(self) -> bool:
        return not self._missing()

    def run(self, tell: Tell) -> None:
        missing = self._missing()
        found = describe(self.source, self.role, missing, self.protocol, tell)
        for choice, inputs in missing.items():
            # Each is let go when it is written.
            value = found.pop(choice.name)
            write_part(self.files.described(choice), inputs, value)

    def _missing(self) -> dict[MethodChoice, dict]:
        """Returns methods without a description, and what it is made of."""
        inputs = self.made_of(
            {
                "drive": self.source.identity(),
                "role": self.role,
                "protocol": self.protocol.described(),
            }
        )
        made_of = {m: {**inputs, "method": m.inputs()} for m in self.methods}
        return {
            method: one
            for method, one in made_of.items()
            if not is_current(self.files.described(method), one)
        }


def describe(
    source: DriveSource,
    role: Role,
    methods: Iterable[MethodChoice],
    protocol: RetrievalProtocol,
    tell: Tell,
) -> dict[str, DescribedDrive]:
    """Returns name of method -> what it keeps of a drive.

    Args:
        source: opens the drive.
        role: what the drive serves as.
        methods: that describe it.
        protocol: where it has places and queries.
        tell: takes the progress.

    Raises:
        InputError: see `describe_drive`.
    """
    running = [choice.make() for choice in methods]
    kept = max(map(protocol.scans, running), default=1)
    drive = RecentScans(source(), kept)
    found = describe_drive(drive, running, {role}, protocol, tell.track)
    return {
        method.name: one for method, one in zip(running, found, strict=True)
    }
