"""The places of the shipped worlds."""

from __future__ import annotations

import functools
from pathlib import Path

from cns_drake.base.map_folder import MapFolder, drive_name
from cns_drake.scenarios.worlds_archive import unpacked


@functools.cache
def worlds_folder() -> Path:
    """Returns the folder of shipped maps.

    In a checkout it is beside the package. A wheel has an archive of it, which
    is unpacked to the user's cache.

    Raises:
        InputError: if the cache cannot be written.
    """
    package = Path(__file__).resolve().parents[1]
    archive = package / "worlds.tar.xz"
    return unpacked(archive) if archive.exists() else package.parent / "worlds"


def vehicle_file() -> Path:
    """Returns the SDF file of the vehicle."""
    return worlds_folder() / "vehicle.sdf"


def suspension_file() -> Path:
    """Returns the YAML file of the vehicle's springs."""
    return worlds_folder() / "suspension.yaml"


def shipped_maps() -> dict[str, Path]:
    """Returns the folder of each shipped map, by name."""
    return {
        path.name: path
        for path in sorted(worlds_folder().iterdir())
        if MapFolder(path).roads.exists()
    }


def shipped_drives() -> dict[str, Path]:
    """Returns the file of each shipped drive, by name (`<map>_<NN>`)."""
    return {
        drive_name(path): path
        for folder in shipped_maps().values()
        for path in MapFolder(folder).drives()
    }


def recordable_drives() -> dict[str, Path]:
    """Returns the shipped drives whose stage is shipped as well, by name."""
    return {
        drive_name(path): path
        for folder in shipped_maps().values()
        for path in MapFolder(folder).recordable_drives()
    }
