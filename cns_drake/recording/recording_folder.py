"""The folder of a recording: its files, and whether it is finished."""

from __future__ import annotations

import os
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.base.files import part_path, user_errors


class RecordingFolder:
    """A rosbag2 folder with one MCAP file.

    Attributes:
        path: the folder; its last part names the recording.
        mcap: the messages.
        scenario: the recorded scenario.
        fingerprint: of all inputs; see `cns_drake.scenarios.provenance`.
        metadata: for rosbag2. It gets its name last: with it, the recording is
            finished.
    """

    def __init__(self, path: Path):
        self.path = Path(os.path.abspath(path))
        self.mcap = self.path / f"{self.path.name}_0.mcap"
        self.scenario = self.path / "scenario.yaml"
        self.fingerprint = self.path / "fingerprint.txt"
        self.metadata = self.path / "metadata.yaml"

    def is_finished(self) -> bool:
        """Whether the folder holds a finished recording."""
        return self.metadata.is_file()

    def check(self, overwrite: bool) -> None:
        """Refuses a folder that a recording must not go into.

        Without `overwrite`, these are a folder with a finished recording, and
        one with files but without a recording of this name.

        Raises:
            InputError: the folder must not be used, or cannot be read.
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
            if self.is_finished():
                raise InputError(
                    f"{self.path}: the folder already exists and holds a "
                    "finished recording (--overwrite replaces it)"
                )
            own = (self.mcap, self.scenario, self.fingerprint, self.metadata)
            names = {file.name for file in (*own, *map(part_path, own))}
            found = sorted(entry.name for entry in self.path.iterdir())
        if found and names.isdisjoint(found):
            raise InputError(
                f"{self.path}: the folder already exists and holds other "
                f"files, such as '{found[0]}' (--overwrite keeps them and "
                "records beside them)"
            )
