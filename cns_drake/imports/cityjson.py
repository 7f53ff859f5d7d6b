"""Reads CityJSON 1.0 to 2.0 and CityJSONSeq files as structures.

https://www.cityjson.org/specs/2.0.1/. A file of type CityJSON holds all
objects. In a sequence (.jsonl), the first line is of type CityJSON, and each
further line is a feature with its own vertices. pyproj defines the order,
direction and units of the axes of the file's reference system.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
import itertools
from pathlib import Path
import re
from typing import Any, NamedTuple

import numpy as np
import pyproj
from pyproj.exceptions import CRSError, ProjError
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular, user_errors
from cns_drake.base.json_text import parse_json
from cns_drake.city.geometry import Finish
from cns_drake.imports import foreign_city
from cns_drake.imports.building_years import construction_year
from cns_drake.imports.faces import face_triangles, joined
from cns_drake.imports.foreign_city import ForeignCity, Imported
from cns_drake.imports.options import ImportFaults

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
        matrix: (3, 3) converts coordinates to metres east, north and up.
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
        return points @ self.matrix.T

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
        system = _horizontal_system(self.name)
        if system.area_of_use is None:
            return True
        longitude, latitude = _degrees(system, first, second)
        west, south, east, north = system.area_of_use.bounds
        near = _NEAR_AREA_DEG
        return bool(
            west - near <= longitude <= east + near
            and south - near <= latitude <= north + near
        )


def _horizontal_system(name: str) -> pyproj.CRS:
    """Returns the system of the first two coordinates.

    A system that is composed of codes, such as EPSG:31468+5783, has no area of
    use; its horizontal part does.
    """
    system = pyproj.CRS.from_user_input(name)
    return (system.sub_crs_list or [system])[0]


def _degrees(
    system: pyproj.CRS, first: float, second: float
) -> tuple[float, float]:
    """Returns the longitude and latitude of a place [deg]."""
    to_degrees = pyproj.Transformer.from_crs(system, "OGC:CRS84")
    longitude, latitude = to_degrees.transform(first, second)
    return longitude, latitude


def reference_system(name: str, where: str) -> ReferenceSystem:
    """Returns the axes and units of a reference system, by its name.

    Args:
        name: EPSG code, or the URL or URN of an EPSG code; "" for metres east,
            north and up.
        where: place of the name in the file, for error messages.

    Raises:
        InputError: the system is unknown, is in degrees, or has axes that are
            not east, north and up.
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
    # Direction, unit, and length of the unit in metres, for each axis.
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


# Members of objects that are read, or that do not place anything.
_MEMBERS = {
    "type", "geometry", "attributes", "parents", "children", "children_roles",
    "geographicalExtent", "address", "bbox", "extent", "members",
}  # fmt: skip
# A city is mirrored if less than this share of its geometries look outwards.
_MIRRORED_SHARE = 0.1
# At most this many geometries are looked at.
_MOST_VOTES = 1000
# They count if six times the volume of a solid, or twice the area of surfaces,
# is more than this [m^3, m^2].
_LEAST_VOTE = 1e-3
_BEYOND = "coordinates beyond the area of their reference system"
# A geometry of a lower level of detail is left out if a higher one covers more
# than this share of it.
_COVERED = 0.5
# A face: the corners (N, 3) of its outer ring, then those of its holes.
Face = list[np.ndarray]

# No place on Earth is farther than this from the origin of a survey grid [m].
_FARTHEST = 1e8
_NESTING = {
    "MultiSurface": 0,
    "CompositeSurface": 0,
    "Solid": 1,
    "MultiSolid": 2,
    "CompositeSolid": 2,
}
_WATER = Finish(foreign_city.WATER, "water")
# Beginning of a type -> its class, and a finish if that of the class would
# mislead.
_CLASSES: dict[str, tuple[str, Finish | None]] = {
    "Building": ("building", None),
    "Bridge": ("other-structure", None),
    "Tunnel": ("other-structure", None),
    "OtherConstruction": ("other-structure", None),
    "Road": ("road", None),
    "Railway": ("other-ground", None),
    "TransportSquare": ("road", None),
    "Square": ("road", None),
    "Track": ("road", None),
    "Waterway": ("other-ground", _WATER),
    "WaterBody": ("other-ground", _WATER),
    "LandUse": ("other-ground", None),
    "PlantCover": ("terrain", Finish(foreign_city.LAWN)),
    "SolitaryVegetationObject": ("vegetation", None),
    "TINRelief": ("terrain", None),
    "CityFurniture": ("other-object", None),
    "GenericCityObject": ("other-structure", None),
}
_LONGEST_NAME = 80


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
        kind: type of the object, such as BuildingPart.
        attributes: attributes, as in the file.
        parents: ids of the objects of which this object is a part.
        geometries: geometries, except geometries that cannot be read.
    """

    name: str
    kind: str
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
        order_is_open: whether the order of east and north in the file is
            unknown, because both orders lead to places in the system's area of
            use.
    """

    objects: dict[str, CityObject] = field(default_factory=dict)
    system: ReferenceSystem = field(default_factory=ReferenceSystem)
    faults: ImportFaults = field(default_factory=ImportFaults)
    order_is_open: bool = False

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the least and the greatest coordinates, (3,) each [m].

        At least one object must have at least one face.
        """
        points = np.concatenate(
            [ring for face in self.faces() for ring in face]
        )
        return points.min(axis=0), points.max(axis=0)

    def faces(self) -> Iterator[Face]:
        """Yields the faces of all geometries of all objects."""
        for one in self.objects.values():
            for geometry in one.geometries:
                yield from geometry.faces


def read_cityjson(path: Path) -> CityFile:
    """Reads a CityJSON file.

    Raises:
        InputError: if it cannot be read, is not CityJSON, or its coordinates
            cannot be converted to metres.
    """
    city = CityFile()
    whole: dict = {}
    whole_system = ""
    templates = _Templates({}, "")
    for number, document in _documents(path):
        kind = document.get("type")
        where = str(path) if number == 0 else f"{path}: line {number}"
        if kind == "CityJSON":
            whole = document
            version = str(document.get("version", ""))
            if not re.match(r"[12]\.", version):
                raise InputError(
                    f"{where}: CityJSON of version {version!r}, not 1.0 to 2.0"
                )
            system = _reference_system(document, where)
            if city.objects and system.name != whole_system:
                raise InputError(
                    f"{where}: metadata.referenceSystem: not that of the lines"
                    f" before, {whole_system or 'none'}"
                )
            if not city.objects:
                city.system, whole_system = system, system.name
            templates = _Templates(document, where)
        elif kind != "CityJSONFeature" or not whole:
            raise InputError(f"{where}: type {kind!r} is not CityJSON")
        _read_objects(document, whole, templates, where, city)
    if not city.objects:
        raise InputError(f"{path}: the file has no objects")
    if not any(city.faces()):
        raise InputError(f"{path}: no object has a surface")
    _check_order(city)
    low, high = city.bounds()
    within = (np.abs([low, high]) <= [180.0, 90.0, np.inf]).all()
    if within and (high - low)[:2].max() < 1.0 < (high - low)[2]:
        raise InputError(
            f"{path}: coordinates look like degrees; project them to metres"
            " first (for example with cjio's crs_reproject)"
        )
    if city.system.name:
        _check_lengths(city.system.name, (low + high) / 2.0, path)
    return city


def _check_lengths(name: str, place: np.ndarray, path: Path) -> None:
    """Checks that a metre of a reference system is a metre on the ground.

    Places beyond the area of the system are not checked, since they may well be
    those of another one.

    Args:
        name: name of the reference system.
        place: (3,) metres east, north and up.
        path: the file, for the message.

    Raises:
        InputError: if it is not, as in Web Mercator (EPSG:3857).
    """
    defined = reference_system(name, "")
    first, second, _ = np.linalg.solve(defined.matrix, place).tolist()
    if not defined.has_place(first, second):
        return
    system = _horizontal_system(name)
    degrees = _degrees(system, first, second)
    factors = pyproj.Proj(system).get_factors(*degrees)
    extremes = factors.tissot_semimajor, factors.tissot_semiminor
    stretch = max(extremes, key=lambda factor: abs(factor - 1.0))
    if _MOST_STRETCHED < abs(stretch - 1.0) < np.inf:
        raise InputError(
            f"{path}: metadata.referenceSystem: in {name}, 1 m on the ground is"
            f" {stretch:.3g} m long; project the file to another system first"
            " (for example with cjio's crs_reproject)"
        )


def _documents(path: Path) -> Iterator[tuple[int, dict]]:
    """Yields each JSON object with its line number, 0 for a whole file."""
    check_regular(path)
    with user_errors(path):
        if path.suffix == ".jsonl":
            with path.open("rb") as stream:
                for number, line in enumerate(stream, start=1):
                    if line.strip():
                        yield number, _object(line, f"{path}: line {number}")
        else:
            yield 0, _object(path.read_bytes(), str(path))


def _object(text: bytes, where: str) -> dict:
    try:
        value = parse_json(text)
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: not UTF-8 ({error.reason})") from error
    except RecursionError as error:
        raise InputError(f"{where}: nested too deeply") from error
    except ValueError as error:
        raise InputError(f"{where}: no JSON ({error})") from error
    if not isinstance(value, dict):
        raise InputError(f"{where}: no JSON object")
    return value


def _reference_system(document: dict, where: str) -> ReferenceSystem:
    metadata = document.get("metadata")
    if not isinstance(metadata, dict):
        return ReferenceSystem()
    found = metadata.get("referenceSystem", metadata.get("crs", ""))
    if isinstance(found, dict):
        found = f"EPSG:{found.get('epsg', '')}"
    return reference_system(str(found), f"{where}: metadata.referenceSystem")


def _read_objects(
    document: dict,
    whole: dict,
    templates: _Templates,
    where: str,
    city: CityFile,
) -> None:
    objects = document.get("CityObjects", {})
    if not isinstance(objects, dict):
        raise InputError(f"{where}: CityObjects: not an object")
    if not objects:
        return
    transform = document.get("transform", whole.get("transform"))
    if transform is None and not str(whole.get("version")).startswith("1.0"):
        city.faults.add("no transform; vertices taken as coordinates", where)
    vertices = _vertices(document, transform, where)
    if not city.objects and len(vertices):
        _settle_axes(city, vertices)
    templates.vertices = city.system.to_metres(vertices)
    templates.system = city.system
    for name, value in objects.items():
        if not isinstance(value, dict) or not isinstance(
            value.get("type"), str
        ):
            city.faults.add("object without a type, left out", name)
            continue
        if name in city.objects:
            city.faults.add("object that is there twice, its last taken", name)
        for key in value.keys() - _MEMBERS:
            city.faults.add(f"{key} of an object, not read", name)
        listed = value.get("geometry") or []
        geometries = [
            _read_geometry(geometry, templates, name, city.faults)
            for geometry in (listed if isinstance(listed, list) else [listed])
        ]
        parents = value.get("parents") or []
        attributes = value.get("attributes")
        city.objects[name] = CityObject(
            name,
            value["type"],
            attributes if isinstance(attributes, dict) else {},
            list(map(str, parents if isinstance(parents, list) else [])),
            [one for one in geometries if one is not None],
        )
    for name, value in objects.items():
        children = value.get("children") if isinstance(value, dict) else None
        for child in children if isinstance(children, list) else []:
            part = city.objects.get(str(child))
            if part is not None and not part.parents:
                city.objects[part.name] = part._replace(parents=[name])


def _settle_axes(city: CityFile, vertices: np.ndarray) -> None:
    """Decides on the order of the first two coordinates, if it can.

    Many programs write east first although the definition says north first.
    East first is assumed if only then a vertex in the middle of the file is in
    the area of use. If both orders lead there, the order stays open, and
    `_check_order` decides by the faces. Assumptions are counted as faults.
    """
    defined = city.system
    if not defined.name:
        city.faults.add(
            "no reference system; metres east, north and up assumed", "the file"
        )
        return
    first, second, _ = vertices[len(vertices) // 2].tolist()
    is_there = defined.has_place(first, second)
    city.order_is_open = defined.has_place(second, first)
    if city.order_is_open and not is_there and defined.is_north_first:
        city.order_is_open = False
        _exchange_axes(city)
    elif not is_there:
        city.faults.add(_BEYOND, defined.name)
    if defined.heights_assumed and not defined.is_plain:
        city.faults.add(
            "reference system without heights; its horizontal unit taken for "
            "them",
            defined.name,
        )


def _exchange_axes(city: CityFile) -> None:
    """Exchanges the first two coordinates of the system and of all faces."""
    defined = city.system
    city.system = defined.exchanged()
    turn = city.system.matrix @ np.linalg.inv(defined.matrix)
    for face in city.faces():
        face[:] = [ring @ turn.T for ring in face]
    order = [axis.partition(" ")[0] for axis in defined.axes[:2]]
    city.faults.add(
        f"reference system with {order[0]} first, but coordinates with"
        f" {order[1]} first; read as {order[1]} first",
        defined.name,
    )


def _check_order(city: CityFile) -> None:
    """Exchanges the first two coordinates if the city would be mirrored.

    It does so only where both orders are possible. Faces are counter-clockwise,
    seen from outside; in a mirrored city they are inside out.
    """
    if city.system.name and not city.order_is_open:
        return
    votes = list(itertools.islice(_look_outwards(city), _MOST_VOTES))
    if not votes:
        if city.system.is_north_first:
            kind = "order of axes that no face shows, taken as defined"
            city.faults.add(kind, city.system.name)
    elif sum(votes) < _MIRRORED_SHARE * len(votes):
        if city.order_is_open:
            _exchange_axes(city)
            if any(kind == _BEYOND for kind, _, _ in city.faults.rows()):
                city.faults.take_back(_BEYOND)
        elif len(votes) > 1:
            city.faults.add(
                "all inside out: the city may be mirrored (north first?)",
                "the file",
            )


def _look_outwards(city: CityFile) -> Iterator[bool]:
    """Yields whether the faces of each geometry look outwards.

    Solids tell this by their volume. Roofs, floors and terrains tell it by the
    direction in which they look.
    """
    for one in city.objects.values():
        above = {"RoofSurface": 1.0, "GroundSurface": -1.0}
        if one.kind == "TINRelief":
            above[""] = 1.0
        for geometry in one.geometries:
            if not geometry.faces:
                continue
            middle = geometry.faces[0][0][0]
            total = 0.0
            for face, kind in zip(geometry.faces, geometry.kinds, strict=True):
                for ring in face:
                    p = ring - middle
                    twice = np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)
                    if geometry.is_solid:
                        total += float(p[0] @ twice)
                    else:
                        total += above.get(kind, 0.0) * float(twice[2])
            if abs(total) > _LEAST_VOTE:
                yield total > 0.0


def _vertices(document: dict, transform: object, where: str) -> np.ndarray:
    """Returns the vertices (N, 3) in the coordinates of the file."""
    points = _numbers(document.get("vertices", []), f"{where}: vertices")
    if transform is not None and not isinstance(transform, dict):
        raise InputError(f"{where}: transform: not an object")
    for key in (transform or {}).keys() - {"scale", "translate"}:
        raise InputError(f"{where}: transform.{key} is not read")
    if transform:
        scale, move = (
            _numbers([transform.get(key)], f"{where}: transform.{key}")
            for key in ("scale", "translate")
        )
        if not (scale > 0.0).all():
            raise InputError(f"{where}: transform.scale: not above 0")
        with np.errstate(over="ignore", invalid="ignore"):
            points = points * scale + move
    if not (np.abs(points) <= _FARTHEST).all():  # NaN fails, too.
        raise InputError(
            f"{where}: vertices: a coordinate beyond {_FARTHEST:g} m"
        )
    return points


def _numbers(values: Any, where: str) -> np.ndarray:
    """Returns values of a file as an array (N, 3) of float64."""
    try:
        with np.errstate(over="ignore"):
            points = np.array(values, dtype=np.float64).reshape(-1, 3)
        if len(points) != len(values):
            raise ValueError
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"{where}: every item must be three numbers"
        ) from error
    return points


class _Templates:
    """Geometry templates of a file, which objects place in the world.

    Attributes:
        vertices: (N, 3) vertices of the document whose objects are read [m].
        system: reference system of the templates.
    """

    def __init__(self, whole: dict, where: str):
        templates = whole.get("geometry-templates")
        templates = templates if isinstance(templates, dict) else {}
        self._geometries = templates.get("templates") or []
        self._points = _numbers(
            templates.get("vertices-templates", []),
            f"{where}: geometry-templates.vertices-templates",
        )
        self.vertices = np.zeros((0, 3))
        self.system = ReferenceSystem()

    def place(self, instance: dict) -> tuple[Any, np.ndarray]:
        """Returns an instance's template, and the vertices of the instance.

        The vertices (N, 3) are those of the template, transformed to the place
        of the instance [m].

        Args:
            instance: geometry of the type `GeometryInstance`, which refers to a
                template and a transformation.

        Raises:
            LookupError, TypeError, ValueError: if the instance is faulty.
        """
        template = self._geometries[instance["template"]]
        (reference,) = instance["boundaries"]
        X = np.array(instance["transformationMatrix"], dtype=np.float64)
        X = X.reshape(4, 4)
        with np.errstate(over="ignore", invalid="ignore"):
            placed = self._points @ X[:3, :3].T + X[:3, 3]
        is_affine = (X[3] == [0.0, 0.0, 0.0, 1.0]).all()
        if reference < 0 or not is_affine:
            raise ValueError
        if not (np.abs(placed) <= _FARTHEST).all():
            raise ValueError
        return template, (
            self.system.to_metres(placed) + self.vertices[reference]
        )


def _read_geometry(
    geometry: Any, templates: _Templates, name: str, faults: ImportFaults
) -> CityGeometry | None:
    vertices = templates.vertices
    try:
        lod = _lod(geometry.get("lod"))
        kind = geometry["type"]
        if kind == "GeometryInstance":
            geometry, vertices = templates.place(geometry)
            kind = geometry["type"]
            lod = lod or _lod(geometry.get("lod"))
        if kind not in _NESTING:
            faults.add(f"geometry of type {kind}, left out", name)
            return None
        boundaries = geometry["boundaries"]
        for _ in range(_NESTING[kind]):
            boundaries = [face for group in boundaries for face in group]
        kinds = _surface_kinds(
            geometry.get("semantics"), _NESTING[kind], len(boundaries)
        )
    except (LookupError, TypeError, ValueError, AttributeError):
        faults.add("geometry that is not an object, left out", name)
        return None
    faces, kept = [], []
    for boundary, one in zip(boundaries, kinds, strict=True):
        face = _face(boundary, vertices)
        if face is None:
            faults.add("face with unknown vertices, left out", name)
        else:
            faces.append(face)
            kept.append(one)
    return CityGeometry(lod, faces, kept, _NESTING[kind] > 0)


def _lod(value: object) -> float:
    return float(str(value)) if value is not None else 0.0


def _face(boundary: Any, vertices: np.ndarray) -> Face | None:
    """Returns a face; None if an index is not that of a vertex."""
    face = []
    try:
        for ring in boundary:
            indices = np.array(ring)
            if len(indices) == 0:
                continue
            if indices.dtype.kind != "i" or indices.ndim != 1:
                return None
            if indices.min() < 0 or indices.max() >= len(vertices):
                return None
            face.append(vertices[indices])
    except (TypeError, ValueError):
        return None
    return face or None


def _surface_kinds(semantics: Any, nesting: int, number: int) -> Sequence[str]:
    """Returns the type of each of a number of faces; "" if unknown."""
    unknown = [""] * number
    if not isinstance(semantics, dict):
        return unknown
    values, surfaces = semantics.get("values"), semantics.get("surfaces")
    for _ in range(nesting):
        if not isinstance(values, list) or None in values:
            return unknown
        values = [one for group in values for one in group]
    if not isinstance(values, list) or len(values) != number:
        return unknown
    if not isinstance(surfaces, list):
        return unknown
    return [
        ""
        if value is None or not 0 <= value < len(surfaces)
        else str(surfaces[value].get("type", ""))
        for value in values
    ]


def import_cityjson(
    path: Path, lod: float | None, year_attribute: str | None
) -> ForeignCity:
    """Imports a city from a CityJSON file; the origin is its centre.

    `lod` is the level of detail to read; None for the highest level of each
    object. `year_attribute` is the attribute with the year of construction;
    None for the usual names.

    Raises:
        InputError: if the file cannot be used.
    """
    city = read_cityjson(path)
    low, high = city.bounds()
    origin = np.array([*np.round((low + high)[:2] / 2.0), np.floor(low[2])])
    return ForeignCity(
        import_structures(city, origin, lod, year_attribute),
        tuple(origin.tolist()),
        city.system.name,
        city.faults,
        axes=() if city.system.is_plain else city.system.axes,
    )


def import_structures(
    city: CityFile,
    origin: np.ndarray,
    lod: float | None,
    year_attribute: str | None,
) -> list[Imported]:
    """Returns a structure for each object that has a surface.

    A building and its parts become one structure.

    Args:
        city: the content of the file.
        origin: (3,) origin of the map in the file's coordinates [m].
        lod: level of detail to read; None for the highest level of each object.
        year_attribute: attribute with the year of construction; None for the
            usual names.
    """
    groups = _families(city)
    names = _unique_names(groups)
    found = []
    for root, members in groups.items():
        first = city.objects[root]
        chosen = _geometries(members, lod, city.faults)
        surfaces = _surfaces(chosen, root, city.faults, origin)
        if not any(map(len, surfaces.values())):
            kind = "object without a surface"
            if not chosen and any(one.geometries for one in members):
                kind = f"object without level of detail {lod:g}"
            city.faults.add(f"{kind}, left out", root)
            continue
        name = names[root]
        semantic_class, finish = _class_of(first.kind)
        years = [
            construction_year(one.attributes, year_attribute, name, city.faults)
            for one in members
        ]
        found.append(
            foreign_city.make_imported(
                name,
                semantic_class,
                first.kind,
                surfaces,
                {"body": finish, "roof": foreign_city.RED_ROOF},
                next((year for year in years if year is not None), None),
                tags={
                    key: str(value)
                    for one in reversed(members)
                    for key, value in one.attributes.items()
                    if isinstance(value, str | int | float)
                },
                lod=max(geometry.lod for geometry in chosen),
            )
        )
    return found


def _families(city: CityFile) -> dict[str, list[CityObject]]:
    """Returns id of each object without parents -> the object and its parts."""
    groups: dict[str, list[CityObject]] = {}
    for name, one in city.objects.items():
        root = name
        seen = {name}
        while True:
            parents = [
                p
                for p in city.objects[root].parents
                if p in city.objects
                # A group is not one structure: it may contain half a city.
                and city.objects[p].kind != "CityObjectGroup"
            ]
            if not parents or parents[0] in seen:
                break
            root = parents[0]
            seen.add(root)
        groups.setdefault(root, []).append(one)
    return groups


def _unique_names(ids: Iterable[str]) -> dict[str, str]:
    """Returns id -> unique name of letters, digits, dots and dashes."""
    plain = {
        one: re.sub(r"[^\w.-]+", "_", one, flags=re.ASCII)[:_LONGEST_NAME]
        or "object"
        for one in ids
    }
    counts = Counter(plain.values())
    names: dict[str, str] = {}
    taken: set[str] = set()
    for one, name in plain.items():
        number = 1
        while name in taken or (number == 1 and counts[plain[one]] > 1):
            name = f"{plain[one]}_{number}"
            number += 1
        taken.add(name)
        names[one] = name
    return names


def _geometries(
    members: list[CityObject], lod: float | None, faults: ImportFaults
) -> list[CityGeometry]:
    """Returns the geometries of an object and its parts that are used.

    What a part shows in more detail is not used again from its whole, or the
    other way round.
    """
    chosen: list[tuple[CityObject, CityGeometry]] = []
    for one in members:
        usable = [g for g in one.geometries if lod is None or g.lod == lod]
        if usable:
            highest = max(g.lod for g in usable)
            chosen += [(one, g) for g in usable if g.lod == highest]
    # A footprint is dropped if there is any better geometry.
    chosen = [pair for pair in chosen if pair[1].lod >= 1.0] or chosen
    kept = []
    for one, geometry in chosen:
        is_whole = not one.parents
        # Levels with the same integer part, such as 2 and 2.2, may be used
        # together.
        better = [
            other
            for owner, other in chosen
            if _is_house(one)
            and _is_house(owner)
            and other.lod > geometry.lod
            and (is_whole or int(other.lod) > int(geometry.lod))
        ]
        if better and _is_covered(geometry, better):
            faults.add("geometry with a better one inside, left out", one.name)
        else:
            kept.append(geometry)
    return kept


def _is_house(one: CityObject) -> bool:
    """Returns whether an object is a building or its part, not a balcony."""
    return not one.parents or one.kind.endswith("Part")


def _is_covered(one: CityGeometry, others: Sequence[CityGeometry]) -> bool:
    """Returns whether other geometries cover one, seen from above."""
    own = _footprint([one])
    shared = own.intersection(_footprint(others)).area
    return bool(shared > _COVERED * own.area)


def _footprint(geometries: Iterable[CityGeometry]) -> BaseGeometry:
    polygons = [
        shapely.make_valid(shapely.Polygon(np.round(face[0][:, :2], 3)))
        for geometry in geometries
        for face in geometry.faces
        if len(face[0]) > 2
    ]
    return shapely.union_all([one for one in polygons if one.area > 0.0])


def _surfaces(
    geometries: Iterable[CityGeometry],
    name: str,
    faults: ImportFaults,
    origin: np.ndarray,
) -> dict[str, np.ndarray]:
    """Returns `body` and `roof` -> triangles (M, 3, 3) in the world [m].

    Surfaces without triangles are left out.
    """
    found: dict[str, list[np.ndarray]] = {}
    for geometry in geometries:
        faces = [
            face_triangles([ring - origin for ring in face], name, faults)
            for face in geometry.faces
        ]
        if geometry.is_solid and _volume(faces) < -1e-3:
            faults.add("solid turned inside out, reversed", name)
            faces = [triangles[:, ::-1] for triangles in faces]
        for triangles, kind in zip(faces, geometry.kinds, strict=True):
            if kind == "ClosureSurface":
                faults.add("face that only closes a solid, left out", name)
                continue
            part = "roof" if kind == "RoofSurface" else "body"
            found.setdefault(part, []).append(triangles)
    return {part: np.concatenate(found[part]) for part in sorted(found)}


def _volume(faces: list[np.ndarray]) -> float:
    """Returns the volume that triangles (M, 3, 3) enclose [m^3]."""
    triangles = joined(faces)
    if len(triangles) == 0:
        return 0.0
    a, b, c = np.moveaxis(triangles - triangles[0, 0], 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def _class_of(kind: str) -> tuple[str, Finish | None]:
    for beginning, look in _CLASSES.items():
        if kind.startswith(beginning):
            return look
    return "other-object", None
