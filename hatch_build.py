"""Packs the shipped worlds into one archive of the wheel.

Most of their 7,000 meshes are alike: together they take a third of what they
take one by one.
"""

from __future__ import annotations

import lzma
from pathlib import Path
import tarfile
import tempfile
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ARCHIVE = "worlds.tar.xz"
# Fast, but with a dictionary that holds the meshes of all maps.
_FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 1, "dict_size": 1 << 25}]


class WorldsHook(BuildHookInterface):
    """Adds the archive to wheels; an editable installation needs none."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Packs the worlds, unless the checkout itself is installed."""
        if version == "editable":
            return
        self._folder = tempfile.TemporaryDirectory()
        archive = Path(self._folder.name) / ARCHIVE
        pack(Path(self.root) / "worlds", archive)
        build_data["force_include"][str(archive)] = f"cns_drake/{ARCHIVE}"

    def finalize(self, *_: Any) -> None:
        """Removes what `initialize` wrote."""
        if hasattr(self, "_folder"):
            self._folder.cleanup()


def pack(folder: Path, archive: Path) -> None:
    """Packs the files of a folder; the same files give the same bytes.

    Args:
        folder: what is packed, by paths from there.
        archive: the tar file to write.
    """
    paths = [path for path in folder.rglob("*") if path.is_file()]
    # Meshes of one name are nearly the same in all maps: side by side.
    paths.sort(key=lambda path: (path.suffix, path.name, path.as_posix()))
    with (
        lzma.open(archive, "wb", filters=_FILTERS) as stream,
        tarfile.open(fileobj=stream, mode="w") as tar,
    ):
        for path in paths:
            member = tarfile.TarInfo(path.relative_to(folder).as_posix())
            member.size = path.stat().st_size
            with path.open("rb") as content:
                tar.addfile(member, content)
