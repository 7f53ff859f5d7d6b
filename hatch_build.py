"""Builds the package: its worlds, and its README with addresses.

The shipped worlds become one archive of the wheel. Most of their 7,000 meshes
are alike: together they take a third of what they take one by one.

A package index shows the README without the repository beside it. Where the
workflow of a repository builds the package, links become addresses there.
"""

from __future__ import annotations

from collections.abc import Mapping
import lzma
import os
from pathlib import Path
import re
import tarfile
import tempfile
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

ARCHIVE = "worlds.tar.xz"
# Fast, but with a dictionary that holds the meshes of all maps.
_FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 1, "dict_size": 1 << 25}]
# A link of Markdown to a file of the repository.
_LINK = re.compile(r"(!?)(\[[^]]*\])\((?![a-z]+:|#)([^)]+)\)")


class AddressesHook(MetadataHookInterface):
    """Sets the README and the project's addresses."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Reads the README, and the repository that a workflow names."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        urls = dict(self.config["urls"])
        page = repository_page(os.environ)
        if page is not None:
            text = with_addresses(text, page, os.environ["GITHUB_SHA"])
            urls |= {
                "Source": page,
                "Issues": f"{page}/issues",
                "Changelog": f"{page}/blob/HEAD/CHANGELOG.md",
            }
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
        metadata["urls"] = urls


def repository_page(environment: Mapping[str, str]) -> str | None:
    """Returns the address of the workflow's repository; None without one."""
    names = ("GITHUB_SERVER_URL", "GITHUB_REPOSITORY", "GITHUB_SHA")
    if not all(environment.get(name) for name in names):
        return None
    return f"{environment[names[0]]}/{environment[names[1]]}"


def with_addresses(text: str, page: str, commit: str) -> str:
    """Returns Markdown whose links to files are addresses.

    Args:
        text: with paths from the top of the repository.
        page: the repository's address.
        commit: the version of the files.
    """

    def address(link: re.Match[str]) -> str:
        mark, words, path = link.groups()
        kind = "raw" if mark else "blob"
        return f"{mark}{words}({page}/{kind}/{commit}/{path})"

    return _LINK.sub(address, text)


class WorldsHook(BuildHookInterface):
    """Adds the archive to wheels; an editable installation needs none."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Packs the worlds, unless the checkout itself is installed."""
        if version == "editable":
            return
        self._folder = tempfile.TemporaryDirectory()
        archive = Path(self._folder.name) / ARCHIVE
        pack(Path(self.root) / "worlds", archive)
        build_data["force_include"][str(archive)] = f"worlds/{ARCHIVE}"

    def finalize(self, *_: Any) -> None:
        """Removes what `initialize` wrote."""
        if hasattr(self, "_folder"):
            self._folder.cleanup()


def pack(folder: Path, archive: Path) -> None:
    """Packs the maps in a folder; the same files give the same bytes.

    Args:
        folder: what is packed, by paths from there, but for Python's packages.
        archive: the tar file to write.
    """
    packages = {path.parent for path in folder.glob("*/__init__.py")}
    paths = [
        path
        for path in folder.rglob("*")
        if path.is_file()
        and packages.isdisjoint(path.parents)
        and not path.name.startswith(("__init__", "py.typed"))
        and "__pycache__" not in path.parts
    ]
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
