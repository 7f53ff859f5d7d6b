"""Where the files of a study are in its folder."""

from collections.abc import Collection
from dataclasses import dataclass
import os
from pathlib import Path

from evaluation.base import InputError, Part, file_name, user_errors
from evaluation.recognition import FeatureFiles
from evaluation.results import check_output

# Longest name of a file without its ending; file systems allow 255 [bytes].
_LONGEST_BYTES = 200


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
