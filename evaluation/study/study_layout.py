"""Paths of a study's files in its output folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cns_drake.base.files import file_name
from evaluation.study.chosen_methods import MethodChoice


@dataclass(frozen=True)
class SurveyFiles:
    """The parts that hold the survey of a recording.

    A job that needs one method's descriptions reads no other's.

    Attributes:
        folder: of the parts.
    """

    folder: Path

    @property
    def drive(self) -> Path:
        """Returns the file of the `SurveyedDrive`."""
        return self.folder / "drive.data"

    @property
    def fine(self) -> Path:
        """Returns the file of the cloud for pictures."""
        return self.folder / "fine.data"

    @property
    def scans(self) -> Path:
        """Returns the file of the scans of places or queries."""
        return self.folder / "scans.data"

    def described(self, method: MethodChoice) -> Path:
        """Returns the layout of (`PlacedDrive`, `DescribedDrive`)."""
        return self.folder / f"described_{file_name(method.name)}.data"


@dataclass(frozen=True)
class RecognitionFiles:
    """The parts that hold the results of methods on two recordings.

    Attributes:
        folder: of the parts.
    """

    folder: Path

    def result(self, method: MethodChoice) -> Path:
        """Returns the file of the `RecognitionResult` of a method."""
        return self.folder / f"{file_name(method.name)}.data"

    @property
    def evidence(self) -> Path:
        """Returns the file of the `PairEvidence` of all methods."""
        return self.folder / "why" / "evidence.data"


@dataclass(frozen=True)
class StudyFiles:
    """The files of a study.

    Attributes:
        output: its folder.
    """

    output: Path

    @property
    def figures(self) -> Path:
        """The folder of all figures."""
        return self.output / "figures"

    @property
    def _parts(self) -> Path:
        return self.output / "parts"

    def survey(self, recording: str) -> SurveyFiles:
        return SurveyFiles(self._parts / "surveys" / file_name(recording))

    def change(self, earlier: str, later: str) -> Path:
        """Returns the file of the `ChangeResult` of two recordings."""
        name = f"{file_name(earlier)},{file_name(later)}.data"
        return self._parts / "changes" / name

    def recognition(self, database: str, query: str) -> RecognitionFiles:
        name = f"{file_name(database)},{file_name(query)}"
        return RecognitionFiles(self._parts / "recognition" / name)

    @property
    def costs(self) -> Path:
        """Returns the file of the list of `Cost`."""
        return self._parts / "costs" / "costs.data"

    def page_drives(self, city: str) -> Path:
        """Returns the file of the `PageDrive`s of a city's stages, by name."""
        return self._parts / "pages" / f"{file_name(city)}.data"

    def trend_points(self, database: str, query: str) -> Path:
        """Returns the file of the `TrendPoint`s of two recordings."""
        name = f"{file_name(database)},{file_name(query)}.data"
        return self._parts / "trend" / name

    def rung(self, name: str) -> Path:
        """Returns the file of the `RungOutcome`s of a rung of a ladder."""
        return self._parts / "rungs" / f"{file_name(name)}.data"

    def drawn(self, stem: str) -> Path:
        """Returns the file that names the inputs of a figure."""
        return self._parts / "figures" / f"{file_name(stem)}.data"
