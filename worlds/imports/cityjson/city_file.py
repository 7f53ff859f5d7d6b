"""The content of a CityJSON file, in metres east, north and up."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from worlds.imports.cityjson.reference_systems import ReferenceSystem
from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import FARTHEST

# A face: the corners (N, 3) of its outer ring, then those of its holes.
Face = list[np.ndarray]


class CityGeometry(NamedTuple):
    """One geometry of a CityJSON object.

    Attributes:
        lod: level of detail; 0 if unknown.
        faces: the faces; the faces of a solid enclose the solid.
        kinds: type of each face, such as RoofSurface; "" if unknown.
        is_solid: whether the geometry is a solid.
    """

    lod: float
    faces: list[Face]
    kinds: list[str]
    is_solid: bool


class CityObject(NamedTuple):
    """An object of a CityJSON file.

    Attributes:
        name: id of the object.
        object_type: type of the object, such as BuildingPart.
        attributes: attributes, as in the file.
        parents: ids of the objects of which this object is a part.
        geometries: geometries, except geometries that cannot be read.
    """

    name: str
    object_type: str
    attributes: Mapping[str, Any]
    parents: list[str]
    geometries: list[CityGeometry]


@dataclass
class CityFile:
    """The content of a CityJSON file.

    Attributes:
        objects: id -> object.
        system: reference system of the coordinates.
        faults: counts of faulty parts.
        order_is_open: whether the places of the vertices leave open which of
            the first two coordinates is east.
    """

    objects: dict[str, CityObject] = field(default_factory=dict)
    system: ReferenceSystem = field(default_factory=ReferenceSystem)
    faults: ImportFaults = field(default_factory=ImportFaults)
    order_is_open: bool = False

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the least and the greatest coordinates, (3,) each [m].

        Corners far from the others, such as -9999 in place of an unknown
        height, do not count. At least one object must have at least one face.
        """
        points = np.concatenate(
            [ring for face in self.faces() for ring in face]
        )
        away = np.abs(points - np.median(points, axis=0)) / FARTHEST
        far = away.max(axis=1)
        points = points[far <= max(1.0, far.min())]
        return points.min(axis=0), points.max(axis=0)

    def faces(self) -> Iterator[Face]:
        """Yields the faces of all geometries of all objects."""
        for city_object in self.objects.values():
            for geometry in city_object.geometries:
                yield from geometry.faces
