"""Number of rings and field of view of a LiDAR, by its data sheet."""

from typing import NamedTuple

from evaluation.base import InputError
from evaluation.lidar_sheets import (
    DEFAULT_PRESET,
    LIDAR_PRESETS,
    SpinningSheet,
    make_sheet,
)

# Ending of the name of a unit that hangs upside down, such as NCLT's.
_UPSIDE_DOWN = "-upside-down"


class LidarField(NamedTuple):
    """Number of rings and vertical field of view of a LiDAR.

    Attributes:
        rings: number of rings (channels).
        lowest_deg: elevation of the lowest ring [deg]; negative below the
            horizon.
        highest_deg: elevation of the highest ring [deg].
    """

    rings: int
    lowest_deg: float
    highest_deg: float


def lidar_field(unit: object, rings: object = None) -> LidarField | None:
    """Returns the number of rings and the field of view of a LiDAR model.

    The result is None if the model is unknown, or if all its beams have the
    same elevation.

    Args:
        unit: name of a preset, such as `vlp-16`, with `-upside-down` for a unit
            that hangs upside down; or the fields of a data sheet, as recordings
            have them; or a `LidarField`, which is returned.
        rings: number of rings, if it differs from the data sheet's.
    """
    if unit is None or isinstance(unit, LidarField):
        return unit
    name = unit if isinstance(unit, str) else ""
    try:
        sheet = LIDAR_PRESETS.get(name.removesuffix(_UPSIDE_DOWN))
        if isinstance(unit, dict):
            sheet = make_sheet(unit, "unit")
        if sheet is None:
            return None
        if isinstance(rings, int) and rings > 0:
            sheet = sheet.with_rings(rings)
    except (InputError, ValueError):
        return None
    lowest, highest = sheet.field_deg
    if lowest == highest:
        return None
    if name.endswith(_UPSIDE_DOWN):
        lowest, highest = -highest, -lowest
    if not isinstance(sheet, SpinningSheet):
        # It has no rings: the number of the default preset stands in.
        sheet = LIDAR_PRESETS[DEFAULT_PRESET]
    return LidarField(sheet.num_rings, lowest, highest)
