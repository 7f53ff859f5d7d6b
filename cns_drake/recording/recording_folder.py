"""The folder of a recording: its files, and how far they have come."""

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
        scenario: what was recorded.
        fingerprint: of all that it was made of; see
            `cns_drake.scenarios.provenance`.
        metadata: what rosbag2 needs. It gets its name last: where it
            is, the recording is finished.
    """

    def __init__(self, path: Path):
        self.path = Path(os.path.abspath(path))
        self.mcap = self.path / f"{self.path.name}_0.mcap"
        self.scenario = self.path / "scenario.yaml"
        self.fingerprint = self.path / "fingerprint.txt"
        self.metadata = self.path / "metadata.yaml"

    def is_finished(self) -> bool:
        """Tells whether the folder holds a finished recording."""
        return self.metadata.is_file()

    def check(self, overwrite: bool) -> None:
        """Refuses a folder that a recording must not go into.

        Without `overwrite`, that is one with a finished recording, and one
        that holds files but none of a recording of this name.

        Raises:
            InputError: the folder must not be used, or cannot be looked at.
        """
        with user_errors(self.path):
            if not self.path.is_dir():
                if self.path.exists():
                    raise InputError(
                        f"{self.path}: there is a file of this name"
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
