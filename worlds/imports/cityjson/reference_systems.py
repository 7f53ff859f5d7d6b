"""Reference systems of city files: axes and units of their coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pyproj

from evaluation.base import InputError, one_line, rotated
from worlds.maps import projected_system

# Direction of an axis -> its row among east, north and up, and its sign.
_ROWS = {
    "east": (0, 1.0),
    "west": (0, -1.0),
    "north": (1, 1.0),
    "south": (1, -1.0),
    "up": (2, 1.0),
    "down": (2, -1.0),
}
# A city may be at most this far outside its system's area of use [deg].
_NEAR_AREA_DEG = 0.5
# A projection that changes lengths by more than this share is refused.
_MOST_STRETCHED = 0.005
_PLAIN = ("east [metre]", "north [metre]", "up [metre]")


@dataclass(frozen=True, eq=False)
class ReferenceSystem:
    """The reference system of a CityJSON file: axes and units of coordinates.

    If the system defines no heights, heights are assumed to have the unit of
    the first two coordinates.

    Attributes:
        name: name of the system in the file; "" if there is none.
        axes: direction and unit of each of the three coordinates, in words.
        matrix: (3, 3) matrix that converts coordinates to metres east, north
            and up.
        heights_assumed: whether the unit of heights is assumed.
    """

    name: str = ""
    axes: tuple[str, ...] = _PLAIN
    matrix: np.ndarray = field(default_factory=lambda: np.eye(3))
    heights_assumed: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether coordinates are already metres east, north and up."""
        return self.axes == _PLAIN

    @property
    def is_north_first(self) -> bool:
        """Whether the first coordinate points north or south."""
        return self.axes[0].startswith(("north", "south"))

    def to_metres(self, points: np.ndarray) -> np.ndarray:
        """Converts coordinates (N, 3) to metres east, north and up."""
        if self.is_plain:
            return points
        return rotated(self.matrix, points)

    def exchanged(self) -> ReferenceSystem:
        """Returns the reference system with its first two axes exchanged.

        Many programs write the coordinate east first although the definition of
        the system says north first, or the other way round.
        """
        axes = (self.axes[1], self.axes[0], self.axes[2])
        return replace(self, axes=axes, matrix=self.matrix[:, [1, 0, 2]])

    def has_place(self, first: float, second: float) -> bool:
        """Returns whether a place is in or near the system's area of use.

        `first` and `second` are the first two coordinates of the place, in the
        order of the system's definition. The result is True for a system
        without an area of use, because nothing rules out the place.
        """
        system = horizontal_system(self.name)
        if system.area_of_use is None:
            return True
        longitude, latitude = to_degrees(system, first, second)
        west, south, east, north = system.area_of_use.bounds
        margin = _NEAR_AREA_DEG
        return bool(
            west - margin <= longitude <= east + margin
            and south - margin <= latitude <= north + margin
        )


def horizontal_system(name: str) -> pyproj.CRS:
    """Returns the horizontal part of a reference system, by its name.

    A system that is composed of codes, such as EPSG:31468+5783, has no area of
    use, but its horizontal part has one.
    """
    system = projected_system(name)
    return (system.sub_crs_list or [system])[0]


def to_degrees(
    system: pyproj.CRS, first: float, second: float
) -> tuple[float, float]:
    """Returns the longitude and latitude of a place [deg].

    `first` and `second` are the coordinates of the place in the system.
    """
    transformer = pyproj.Transformer.from_crs(system, "OGC:CRS84")
    longitude, latitude = transformer.transform(first, second)
    return longitude, latitude


def reference_system(name: str, where: str) -> ReferenceSystem:
    """Returns the axes and units of a reference system, by its name.

    Args:
        name: the system, in a form that `projected_system` takes; "" for metres
            east, north and up.
        where: place of the name in the file, for error messages.

    Raises:
        InputError: the system is unknown, is in degrees, or has axes that are
            not east, north and up.
    """
    if not name:
        return ReferenceSystem()
    try:
        system = projected_system(name)
    except ValueError as error:
        shown = one_line(name[:200])
        raise InputError(
            f"{where}: {shown} is not a known reference system (such as "
            "https://www.opengis.net/def/crs/EPSG/0/7415)"
        ) from error
    parts = system.sub_crs_list or [system]
    if any(part.is_geographic for part in parts):
        raise InputError(
            f"{where}: {name} is in degrees; project it to metres first (for"
            " example with cjio's crs_reproject)"
        )
    defined = [axis for part in parts for axis in part.axis_info]
    # Direction, name of the unit, and length of the unit [m].
    axes = [
        (axis.direction, axis.unit_name, axis.unit_conversion_factor)
        for axis in defined
    ]
    heights_assumed = len(axes) == 2
    if heights_assumed:
        axes.append(("up", *axes[0][1:]))
    rows = [_ROWS.get(direction, (-1, 0.0)) for direction, _, _ in axes]
    if sorted(row for row, _ in rows) != [0, 1, 2]:
        listed = ", ".join(f"{a.name} ({a.direction})" for a in defined)
        raise InputError(
            f"{where}: {name} ({system.name}) has the axes {listed}, which are"
            " not east, north and up; reproject the file first"
        )
    matrix = np.zeros((3, 3))
    for column, (row, sign) in enumerate(rows):
        matrix[row, column] = sign * axes[column][2]
    words = tuple(f"{direction} [{unit}]" for direction, unit, _ in axes)
    return ReferenceSystem(name, words, matrix, heights_assumed)


def check_lengths(name: str, place: np.ndarray, where: str) -> None:
    """Checks that a metre of a reference system is a metre on the ground.

    A place outside of the system's area of use is not checked, because its
    coordinates may belong to another system.

    Args:
        name: name of the reference system.
        place: (3,) place at which lengths are compared: metres east, north and
            up.
        where: file and field with the name, for error messages.

    Raises:
        InputError: lengths differ by more than 0.5 %, as in Web Mercator
            (EPSG:3857).
    """
    defined = reference_system(name, where)
    first, second, _ = np.linalg.solve(defined.matrix, place).tolist()
    if not defined.has_place(first, second):
        return
    system = horizontal_system(name)
    degrees = to_degrees(system, first, second)
    factors = pyproj.Proj(system).get_factors(*degrees)
    scales = factors.tissot_semimajor, factors.tissot_semiminor
    stretch = max(scales, key=lambda scale: abs(scale - 1.0))
    if _MOST_STRETCHED < abs(stretch - 1.0) < np.inf:
        raise InputError(
            f"{where}: in {name}, 1 m on the ground is {stretch:.3g} m long;"
            " project the file to another system first (for example with cjio's"
            " crs_reproject)"
        )
