"""Finds the worlds that ship with cns-drake.

A wheel contains them as one archive.
"""

from collections.abc import Mapping
import errno
import functools
import hashlib
import json
import os
from pathlib import Path
import tarfile
from types import MappingProxyType

from evaluation.base import (
    InputError,
    cache_folder,
    did_you_mean,
    is_own,
    mark_used,
    remove_unused,
    scratch_folder,
)
from worlds.maps.map_folder import MapFolder, drive_name, no_drives

# File in the cache with the size of each file beside it [bytes].
_SIZES = "sizes.json"


@functools.cache
def worlds_folder() -> Path:
    """Returns the folder of shipped maps.

    In a source checkout, this is the package `worlds` itself. A wheel contains
    the maps as an archive, which is unpacked to the user's cache.

    Raises:
        InputError: there is no cache, or it cannot be written.
    """
    package = Path(__file__).resolve().parents[1]
    archive = package / "worlds.tar.xz"
    return unpacked(archive) if archive.exists() else package


@functools.cache
def shipped_cities() -> Mapping[str, Path]:
    """Returns name -> folder of each of the paper's four cities."""
    return _maps_in(worlds_folder())


@functools.cache
def shipped_maps() -> Mapping[str, Path]:
    """Returns name -> folder of each shipped map.

    The maps are the cities, and after these the maps for stress tests, which
    nothing uses unless it is asked for them by name.

    Example:
        from worlds import shipped_maps

        print(*shipped_maps())
    """
    stress = _maps_in(worlds_folder() / "stress")
    return MappingProxyType({**shipped_cities(), **stress})


def _maps_in(folder: Path) -> Mapping[str, Path]:
    folders = {
        path.name: path
        for path in sorted(folder.iterdir())
        if MapFolder(path).roads.exists()
    }
    return MappingProxyType(folders)


def recordable_maps() -> list[str]:
    """Returns the names of the cities with a drive that can be recorded.

    A drive can be recorded if the map has the stage through which it goes.
    """
    return [
        name
        for name, folder in shipped_cities().items()
        if MapFolder(folder).recordable_drives()
    ]


def recordable_map(name: str) -> Path:
    """Returns the folder of a map whose drives can be recorded.

    Args:
        name: a shipped map, or a folder.

    Raises:
        InputError: there is no such map, or the map has no drive that can be
            recorded.
    """
    folder = shipped_maps().get(name, Path(name))
    if not folder.is_dir():
        maps = recordable_maps()
        raise InputError(
            f"unknown map '{name}'; there are: {', '.join(maps)}; or give a "
            f"folder{did_you_mean(name, maps)}"
        )
    if not MapFolder(folder).recordable_drives():
        raise no_drives(folder)
    return folder


def shipped_drives() -> dict[str, Path]:
    """Returns name (`<map>_<NN>`) -> file of each shipped drive."""
    return {
        drive_name(path): path
        for folder in shipped_maps().values()
        for path in MapFolder(folder).drives()
    }


def recordable_drives() -> dict[str, Path]:
    """Returns name -> scenario file of each recordable drive of a city.

    A drive is recordable if its map has the stage through which it goes.
    """
    return {
        drive_name(path): path
        for folder in shipped_cities().values()
        for path in MapFolder(folder).recordable_drives()
    }


def unpacked(archive: Path) -> Path:
    """Returns a folder with the files of an archive, unpacked only once.

    The folder is in the user's cache. The folder's name contains a digest of
    the archive, so that each release has a folder of its own.

    Several processes may call the function at the same time: each unpacks to a
    temporary folder and then renames it, so that the folder is always whole,
    and the first process to finish provides it. If files are missing or cut
    off, the archive is unpacked again. Folders of older releases that nobody
    has used for a month are removed.

    Raises:
        InputError: if the cache cannot be written, or others can write there.
    """
    cache = cache_folder()
    if cache is None:
        raise InputError(
            "XDG_CACHE_HOME: name a folder, in which the shipped worlds are "
            "unpacked; you have no home folder"
        )
    digest = hashlib.sha256(archive.read_bytes()).hexdigest()[:16]
    name = archive.name.partition(".")[0]
    folder = cache / f"{name}-{digest}"
    try:
        if not _is_whole(folder):
            _unpack(archive, folder)
            remove_unused(cache, f"{name}-{'[0-9a-f]' * 16}")
    except (OSError, InputError) as error:
        fault = error.strerror if isinstance(error, OSError) else error
        raise InputError(
            f"{folder}: {fault}; the shipped worlds are "
            "unpacked there: name another folder in XDG_CACHE_HOME"
        ) from error
    mark_used(folder)
    return folder


def _is_whole(folder: Path) -> bool:
    """Returns whether a folder has all files of the archive, in their sizes.

    Raises:
        OSError: others can have filled the folder.
    """
    if not folder.exists():
        return False
    if not is_own(folder):
        raise PermissionError(errno.EPERM, "others can write there")
    try:
        sizes = json.loads((folder / _SIZES).read_bytes())
        return all(
            os.path.getsize(folder / name) == size
            for name, size in sizes.items()
        )
    except (OSError, ValueError, AttributeError, TypeError):
        return False


def _unpack(archive: Path, folder: Path) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    with scratch_folder(folder) as scratch:
        new = scratch / folder.name
        with tarfile.open(archive) as tar:
            # Python 3.11.2, which Debian 12 has, lacks filters.
            tar.extraction_filter = getattr(
                tarfile, "data_filter", lambda member, _: member
            )
            tar.extractall(new)
            sizes = {one.name: one.size for one in tar if one.isfile()}
        (new / _SIZES).write_text(json.dumps(sizes))
        try:
            if folder.exists() and not _is_whole(folder):
                folder.rename(scratch / "damaged")
            new.rename(folder)
        except OSError:
            # Otherwise another process was faster.
            if not _is_whole(folder):
                raise
