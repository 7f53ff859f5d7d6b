"""The survey of one recording, in a part for each use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from cns_drake.base.drives.drive import Drive
from cns_drake.base.jobs.step import Reporter, Step
from evaluation.drives.drive_views import MovedDrive
from evaluation.recognition.description import Role
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.drive_source import DriveSource
from evaluation.study.parts import is_current, read_part, write_part
from evaluation.study.recording_survey import (
    RecordingSurvey,
    SurveyedDrive,
    survey_recording,
)
from evaluation.study.study_layout import SurveyFiles


@dataclass(frozen=True)
class Survey(Step):
    """Writes the survey of a drive, or its missing parts.

    Attributes:
        source: opens the drive.
        roles: of the drive in place recognition; may be empty.
        methods: that describe its places and queries.
        protocol: sets the places and queries.
        files: to write.
    """

    source: DriveSource
    roles: frozenset[Role]
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    files: SurveyFiles

    @property
    def output(self) -> Path:
        return self.files.folder

    def is_done(self) -> bool:
        return not any(self._missing())

    def run(self, reporter: Reporter) -> None:
        missing = self._missing()
        self._write(self.find(self.source(), missing[0], reporter), *missing)

    def find(
        self,
        drive: Drive,
        methods: Iterable[MethodChoice],
        reporter: Reporter,
    ) -> RecordingSurvey:
        """Returns the survey of a drive, described by some of the methods.

        Args:
            drive: that of the source, or the same drive while it is being made.
            methods: to describe it; none if it has no role.
            reporter: takes the progress.

        Raises:
            InputError: see `survey_recording`.
        """
        return survey_recording(
            drive,
            self.roles,
            [method.make() for method in methods],
            self.protocol,
            reporter.track,
        )

    def write(self, found: RecordingSurvey) -> None:
        """Writes the parts of the survey that were missing.

        Raises:
            InputError: a file cannot be written.
        """
        self._write(found, *self._missing())

    def _write(
        self,
        found: RecordingSurvey,
        described: Mapping[MethodChoice, Mapping],
        maps: Mapping[str, Mapping],
    ) -> None:
        for method, inputs in described.items():
            if method.name in found.described:
                # Each value is dropped when it is written.
                value = found.drive.placed, found.described.pop(method.name)
                write_part(self.files.described(method), inputs, value)
        for name, inputs in maps.items():
            write_part(getattr(self.files, name), inputs, getattr(found, name))

    def _missing(
        self,
    ) -> tuple[dict[MethodChoice, Mapping], dict[str, Mapping]]:
        """Returns the missing parts, each with its inputs.

        Returns:
            The methods whose descriptions are missing, and the names of missing
            maps.
        """
        inputs = self.made_of(
            {
                "drive": self.source.identity(),
                "roles": sorted(self.roles),
                "protocol": self.protocol.described() if self.roles else None,
            }
        )
        described = {
            method: {**inputs, "method": method.inputs()}
            for method in (self.methods if self.roles else ())
        }
        return (
            {
                method: made_of
                for method, made_of in described.items()
                if not is_current(self.files.described(method), made_of)
            },
            {
                name: inputs
                for name in ("fine", "drive")
                if not is_current(getattr(self.files, name), inputs)
            },
        )


def open_surveyed(source: DriveSource, files: SurveyFiles) -> Drive:
    """Opens a drive that has been surveyed.

    Its poses are those of the survey: a recording would be unpacked as a whole
    for them.

    Raises:
        InputError: if it cannot be opened.
    """
    drive = source()
    known: SurveyedDrive = read_part(files.drive)
    return MovedDrive(drive, known.X_WS, drive.world_frame, drive.datum)
