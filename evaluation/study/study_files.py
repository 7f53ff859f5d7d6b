"""Where the files of a study are in its folder."""

from collections.abc import Collection
from dataclasses import dataclass
import os
from pathlib import Path

from evaluation.base import InputError, Part, file_name, user_errors
from evaluation.results import check_output

# Longest name of a file without its ending; file systems allow 255 [bytes].
_LONGEST_BYTES = 200


@dataclass(frozen=True)
class FeatureFiles:
    """The files (`Part`) with all that a study needs of a recording.

    The files contain the drive's poses and map, the scans at places and
    queries, and, in one file for each method, the descriptors of these scans.

    Attributes:
        folder: folder of the files.
    """

    folder: Path

    @property
    def drive(self) -> Part:
        """The file with the drive's poses and map, a `DriveSummary`."""
        return Part(self.folder / "drive.data")

    @property
    def fine(self) -> Part:
        """The file with the cloud for pictures, an array (K, 3)."""
        return Part(self.folder / "fine.data")

    @property
    def scans(self) -> Part:
        """The file with the drive's scans at places and queries.

        For a drive with a map, the file contains a `KeptScans`; otherwise a
        list of scans (N, 3).
        """
        return Part(self.folder / "scans.data")

    def described(self, key: str) -> Part:
        """Returns the file with a method's descriptors of the drive.

        The file contains a `DriveDescriptors`.

        Args:
            key: `MethodChoice.key` of the method; for descriptors by a second
                protocol, the result of
                `evaluation.study.features.described_key`.
        """
        return Part(self.folder / f"described_{file_name(key)}.data")

    def cost(self, key: str) -> Part:
        """Returns the file with the `DescribingCost` of these descriptors."""
        return Part(self.folder / f"cost_{file_name(key)}.data")


@dataclass(frozen=True)
class StudyFiles:
    """The paths of all files of a study.

    Attributes:
        output: folder of the study.
    """

    output: Path

    def check(self) -> None:
        """Checks before all work what stands in the way of the study's files.

        Raises:
            InputError: `check_output` refuses the folder, or a file has the
                name of one of its folders.
        """
        check_output(self.output, ["page"])
        for folder in (self._parts, self.figures):
            if os.path.lexists(folder) and not folder.is_dir():
                raise InputError(f"{folder}: not a folder")

    @property
    def _parts(self) -> Path:
        return self.output / "parts"

    @property
    def figures(self) -> Path:
        """The folder of all figures."""
        return self.output / "figures"

    def change(self, stem: str) -> Part:
        """Returns the part of a picture of a change, named `stem`."""
        return self.part("changes", stem)

    def remove_other_changes(self, kept: Collection[Path]) -> None:
        """Removes pictures of changes, except those that a run needs.

        An earlier run drew them, of drives that are no longer there. The
        witness of a picture is its part, so no picture of the user's goes.

        Raises:
            InputError: a file cannot be removed.
        """
        for path in sorted({*self.figures.glob("change_*.*")} - {*kept}):
            if self.change(path.stem).path.is_file():
                with user_errors(path):
                    path.unlink()

    def features(self, recording: str) -> FeatureFiles:
        """Returns the files with a recording's map and descriptors."""
        folder = self._parts / "features"
        return FeatureFiles(folder / file_name(recording))

    def part(self, kind: str, *names: str) -> Part:
        """Returns the file of an intermediate result.

        Args:
            kind: kind of result, such as `changes`; the name of a folder.
            names: names of the drives to which the result belongs.
        """
        name = ",".join(map(file_name, names))
        # Two long names together are too long for a file.
        if len(name.encode()) > _LONGEST_BYTES:
            name = file_name(name)
        return Part(self._parts / kind / f"{name}.data")
