"""The folder of a recording: its files, and whether it is finished."""

import os
from pathlib import Path

from cns_drake.base import InputError, part_path, user_errors


class RecordingFolder:
    """The files of a recording: a rosbag2 folder with one MCAP file.

    The name of the folder is the name of the recording. `fingerprint.txt`
    contains a hash of everything that determines the recording; see
    `cns_drake.scenarios.provenance`. The MCAP file is completed last, so a
    folder with this file and `metadata.yaml` contains a finished recording.

    Attributes:
        path: the folder, as an absolute path.
        mcap: path of the MCAP file.
        scenario: path of `scenario.yaml`.
        fingerprint: path of `fingerprint.txt`.
        metadata: path of `metadata.yaml`.
    """

    def __init__(self, path: Path):
        self.path = Path(os.path.abspath(path))
        self.mcap = self.path / f"{self.path.name}_0.mcap"
        self.scenario = self.path / "scenario.yaml"
        self.fingerprint = self.path / "fingerprint.txt"
        self.metadata = self.path / "metadata.yaml"

    def is_finished(self) -> bool:
        """Whether the folder contains a finished recording."""
        return self.metadata.is_file() and self.mcap.is_file()

    def files(self) -> tuple[Path, ...]:
        """Returns the paths of all these files."""
        return self.mcap, self.scenario, self.fingerprint, self.metadata

    def check(self, overwrite: bool) -> None:
        """Checks that a recording may be written to the folder.

        Args:
            overwrite: whether the folder may contain anything.

        Raises:
            InputError: the folder cannot be used, contains a recording, or
                contains files, none of which belongs to a recording of this
                name. With `overwrite`, only the first of these faults is an
                error. What a killed run has left is no recording.
        """
        with user_errors(self.path):
            if not self.path.is_dir():
                if self.path.exists():
                    raise InputError(
                        f"{self.path}: a file has this name; give another "
                        "folder"
                    )
                return
            if overwrite:
                return
            if self.mcap.exists():
                raise InputError(
                    f"{self.path}: the folder already exists and holds a "
                    "recording (--overwrite replaces it)"
                )
            own = self.files()
            names = {file.name for file in (*own, *map(part_path, own))}
            names.add(f"{part_path(self.mcap).name}.lock")
            found = sorted(entry.name for entry in self.path.iterdir())
        if found and names.isdisjoint(found):
            raise InputError(
                f"{self.path}: the folder already exists and holds other "
                f"files, such as '{found[0]}' (--overwrite keeps them and "
                "records beside them)"
            )
