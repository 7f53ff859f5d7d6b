"""Reads CityJSON 1.0 to 2.0 and CityJSONSeq files.

https://www.cityjson.org/specs/2.0.1/. A file of type CityJSON holds all
objects. In a sequence (.jsonl), the first line is of type CityJSON, and each
further line is a feature with its own vertices. pyproj defines the order,
direction and units of the axes of the file's reference system.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
import itertools
from pathlib import Path
import re
from typing import Any, NamedTuple

import numpy as np
import pyproj

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular, user_errors
from cns_drake.base.json_text import parse_json
from cns_drake.imports.options import ImportFaults
from cns_drake.imports.reference_systems import (
    ReferenceSystem,
    horizontal_system,
    reference_system,
    to_degrees,
)

# A projection that changes lengths by more than this share is refused.
_MOST_STRETCHED = 0.005


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
    system = horizontal_system(name)
    degrees = to_degrees(system, first, second)
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
