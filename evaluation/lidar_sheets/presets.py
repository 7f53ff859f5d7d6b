"""The data sheets that ship with the package, by name: the presets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
import os
from pathlib import Path
from typing import TYPE_CHECKING

from evaluation.base import no_such

if TYPE_CHECKING:
    from evaluation.lidar_sheets.data_sheet import LidarSheet

_FILES = {
    path.stem: path
    for path in sorted(
        Path(__file__).parent.glob("*.yaml"),
        key=lambda path: path.stem,
    )
}
# Endings of the names of a user's own sheets.
_ENDINGS = (".yaml", ".yml")


@cache
def _read_preset(name: str) -> LidarSheet:
    # Slow to import, and the names of the presets are known without.
    from evaluation.lidar_sheets.data_sheet import read_sheet

    return read_sheet(_FILES[name])


class _Presets(Mapping[str, "LidarSheet"]):
    """Name of a preset -> its data sheet, which is read when asked for."""

    def __getitem__(self, name: str) -> LidarSheet:
        if name not in _FILES:
            raise KeyError(name)
        return _read_preset(name)

    def __iter__(self) -> Iterator[str]:
        return iter(_FILES)

    def __len__(self) -> int:
        return len(_FILES)


LIDAR_PRESETS: Mapping[str, LidarSheet] = _Presets()
# The LiDAR of a drive that names none.
DEFAULT_PRESET = "cns"


def check_preset(name: str) -> None:
    """Checks that there is a preset of this name.

    Raises:
        ValueError: there is no such preset; the message lists all presets.
    """
    if name not in LIDAR_PRESETS:
        raise ValueError(no_such("preset", name, LIDAR_PRESETS))


def check_one_unit(preset: object, unit: object) -> None:
    """Checks that a LiDAR is not given twice.

    Args:
        preset: name of a preset; None if there is none.
        unit: data sheet of the user's; None if there is none.

    Raises:
        ValueError: both are given.
    """
    if preset is not None and unit is not None:
        raise ValueError("give either a unit or a preset")


def is_sheet_file(unit: object, folder: Path = Path()) -> bool:
    """Returns whether a LiDAR is given by a data sheet's file, not a preset.

    Args:
        unit: name of a preset, or a file.
        folder: folder in which the path of a file starts.
    """
    if not isinstance(unit, str):
        return isinstance(unit, Path)
    return unit not in LIDAR_PRESETS and (
        unit.endswith(_ENDINGS) or os.path.isfile(folder / unit)
    )


def find_sheet(unit: str | Path | LidarSheet) -> LidarSheet:
    """Returns the data sheet of a LiDAR.

    Args:
        unit: name of a preset, the file of a data sheet, or a data sheet.

    Raises:
        ValueError: there is no such preset.
        InputError: the file cannot be read, or is no data sheet.
    """
    # Slow to import, and not needed for the names of presets.
    from evaluation.lidar_sheets.data_sheet import LidarSheet, read_sheet

    if isinstance(unit, LidarSheet):
        return unit
    if is_sheet_file(unit):
        return read_sheet(Path(unit))
    check_preset(str(unit))
    return LIDAR_PRESETS[str(unit)]
