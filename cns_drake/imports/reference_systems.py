"""Coordinates of a file as metres, east, north and up.

The definition of the file's reference system, from pyproj, gives the order and
direction of its axes, and their units.
https://www.cityjson.org/specs/2.0.1/#referencesystem-crs
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pyproj
from pyproj.exceptions import CRSError, ProjError

from cns_drake.base.errors import InputError

# Direction of an axis -> row of east, north, up, and its sign.
_ROWS = {
    "east": (0, 1.0),
    "west": (0, -1.0),
    "north": (1, 1.0),
    "south": (1, -1.0),
    "up": (2, 1.0),
    "down": (2, -1.0),
}
# A city is within its system's area of use, or at most this far outside [deg].
_NEAR_AREA_DEG = 0.5
_PLAIN = ("east [metre]", "north [metre]", "up [metre]")


@dataclass(frozen=True, eq=False)
class ReferenceSystem:
    """The meaning of a file's three coordinates, each in words.

    A matrix (3, 3) leads from coordinates to metres east, north and up. The
    name is as the file has it; "" if it has none. Heights are assumed to have
    the unit of the other coordinates if the system has none.
    """

    name: str = ""
    axes: tuple[str, ...] = _PLAIN
    matrix: np.ndarray = field(default_factory=lambda: np.eye(3))
    heights_assumed: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether the coordinates are metres, east, north, up already."""
        return self.axes == _PLAIN

    @property
    def is_north_first(self) -> bool:
        """Whether the first coordinate leads north or south."""
        return self.axes[0].startswith(("north", "south"))

    def to_metres(self, points: np.ndarray) -> np.ndarray:
        """Returns coordinates (N, 3) as metres east, north and up (N, 3)."""
        if self.is_plain:
            return points
        return points @ self.matrix.T

    def exchanged(self) -> ReferenceSystem:
        """Returns the system with its first two coordinates exchanged.

        Many programs write east first, or north first, against the definition.
        """
        axes = (self.axes[1], self.axes[0], self.axes[2])
        return replace(self, axes=axes, matrix=self.matrix[:, [1, 0, 2]])

    def has_place(self, first: float, second: float) -> bool:
        """Returns whether coordinates, as defined, are in the area of use.

        A system that names none has none.
        """
        system = pyproj.CRS.from_user_input(self.name)
        if system.area_of_use is None:
            return False
        to_degrees = pyproj.Transformer.from_crs(system, "OGC:CRS84")
        longitude, latitude = to_degrees.transform(first, second)
        west, south, east, north = system.area_of_use.bounds
        near = _NEAR_AREA_DEG
        return bool(
            west - near <= longitude <= east + near
            and south - near <= latitude <= north + near
        )


def reference_system(name: str, where: str) -> ReferenceSystem:
    """Returns the axes and units of a reference system.

    Its name is an EPSG code, or a URL or URN of one, as the file has it.

    Raises:
        InputError: naming place and system, if it is unknown, is in degrees, or
            has axes that are not east, north and up.
    """
    if not name:
        return ReferenceSystem()
    try:
        system = pyproj.CRS.from_user_input(name)
    except (CRSError, ProjError) as error:
        raise InputError(
            f"{where}: {name} is not a known reference system (such as "
            "https://www.opengis.net/def/crs/EPSG/0/7415)"
        ) from error
    parts = system.sub_crs_list or [system]
    axes = [axis for part in parts for axis in part.axis_info]
    if any(part.is_geographic for part in parts):
        raise InputError(
            f"{where}: {name} is in degrees; project it to metres first (for"
            " example with cjio's crs_reproject)"
        )
    # Direction, unit and metres of it for each axis.
    meanings = [
        (axis.direction, axis.unit_name, axis.unit_conversion_factor)
        for axis in axes
    ]
    heights_assumed = len(axes) == 2
    if heights_assumed:
        meanings.append(("up", *meanings[0][1:]))
    rows = [_ROWS.get(direction, (-1, 0.0)) for direction, _, _ in meanings]
    if sorted(row for row, _ in rows) != [0, 1, 2]:
        listed = ", ".join(f"{a.name} ({a.direction})" for a in axes)
        raise InputError(
            f"{where}: {name} ({system.name}) has the axes {listed}, which are"
            " not east, north and up; reproject the file first"
        )
    matrix = np.zeros((3, 3))
    for column, (row, sign) in enumerate(rows):
        matrix[row, column] = sign * meanings[column][2]
    words = tuple(f"{direction} [{unit}]" for direction, unit, _ in meanings)
    return ReferenceSystem(name, words, matrix, heights_assumed)
