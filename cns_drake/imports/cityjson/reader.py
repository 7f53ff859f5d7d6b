"""CityJSON 1.0 to 2.0 and CityJSONSeq: objects and their faces.

https://www.cityjson.org/specs/2.0.1/. A file of type CityJSON holds all
objects; in a drive (.jsonl) a first line of that type is followed by a
feature a line, each with vertices of its own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
import re
from typing import Any

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular
from cns_drake.base.json_text import parse_json
from cns_drake.imports.cityjson.reference_systems import (
    ReferenceSystem,
    reference_system,
)
from cns_drake.imports.options import ImportFaults

# A face: the corners (N, 3) of its outer ring, then those of its holes.
Face = list[np.ndarray]

# No place on Earth is farther from the origin of a survey grid [m].
_FARTHEST = 1e8
_NESTING = {
    "MultiSurface": 0,
    "CompositeSurface": 0,
    "Solid": 1,
    "MultiSolid": 2,
    "CompositeSolid": 2,
}


@dataclass(frozen=True)
class CityGeometry:
    """One geometry of an object.

    Attributes:
        lod: level of detail, such as 2.2; 0 if the file has none.
        faces: all of them.
        kinds: the type of each face, such as RoofSurface; "" if unknown.
        is_solid: whether the faces close a solid.
    """

    lod: float
    faces: list[Face]
    kinds: list[str]
    is_solid: bool


@dataclass(frozen=True)
class CityObject:
    """An object of a city.

    Attributes:
        name: its id.
        kind: its type, such as Building.
        attributes: as the file has them.
        parents: ids.
        geometries: the readable ones.
    """

    name: str
    kind: str
    attributes: Mapping[str, Any]
    parents: tuple[str, ...]
    geometries: tuple[CityGeometry, ...]


@dataclass
class CityFile:
    """The content of a file.

    Attributes:
        objects: by id.
        system: its reference system.
        faults: counts of unreadable parts.
    """

    objects: dict[str, CityObject] = field(default_factory=dict)
    system: ReferenceSystem = field(default_factory=ReferenceSystem)
    faults: ImportFaults = field(default_factory=ImportFaults)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the least and the greatest coordinates, (3,) each [m].

        At least one object must have a face.
        """
        points = np.concatenate(
            [
                ring
                for one in self.objects.values()
                for geometry in one.geometries
                for face in geometry.faces
                for ring in face
            ]
        )
        return points.min(axis=0), points.max(axis=0)


def read_cityjson(path: Path) -> CityFile:
    """Reads a file.

    Raises:
        InputError: if it cannot be read, is no CityJSON, or its coordinates
            cannot be brought to metres.
    """
    city = CityFile()
    whole: dict = {}
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
            city.system = _reference_system(document, where)
        elif kind != "CityJSONFeature" or not whole:
            raise InputError(f"{where}: type {kind!r} is not CityJSON")
        _read_objects(document, whole, where, city)
    if not city.objects:
        raise InputError(f"{path}: the file has no objects")
    _check_metres(city, path)
    return city


def _documents(path: Path) -> Iterator[tuple[int, dict]]:
    """Yields line number (0: the whole file) and JSON object."""
    check_regular(path)
    try:
        if path.suffix == ".jsonl":
            with path.open("rb") as stream:
                for number, line in enumerate(stream, start=1):
                    if line.strip():
                        yield number, _object(line, f"{path}: line {number}")
        else:
            yield 0, _object(path.read_bytes(), str(path))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error


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


def _check_metres(city: CityFile, path: Path) -> None:
    if not any(
        geometry.faces
        for one in city.objects.values()
        for geometry in one.geometries
    ):
        raise InputError(f"{path}: no object has a surface")
    low, high = city.bounds()
    within = (np.abs([low, high]) <= [180.0, 90.0, np.inf]).all()
    if within and (high - low)[:2].max() < 1.0 < (high - low)[2]:
        raise InputError(
            f"{path}: coordinates look like degrees; project them to metres"
            " first (for example with cjio's crs_reproject)"
        )


def _read_objects(
    document: dict, whole: dict, where: str, city: CityFile
) -> None:
    objects = document.get("CityObjects", {})
    if not isinstance(objects, dict):
        raise InputError(f"{where}: CityObjects: not an object")
    if not objects:
        return
    transform = document.get("transform", whole.get("transform"))
    vertices = _vertices(document, transform, where)
    if not city.objects and len(vertices):
        _settle_axes(city, vertices)
    vertices = city.system.to_metres(vertices)
    templates = _Templates(whole, vertices, city.system, where)
    for name, value in objects.items():
        if not isinstance(value, dict) or not isinstance(
            value.get("type"), str
        ):
            city.faults.add("object without a type, left out", name)
            continue
        geometries = []
        listed = value.get("geometry") or []
        for geometry in listed if isinstance(listed, list) else [listed]:
            found = _read_geometry(
                geometry, vertices, templates, name, city.faults
            )
            if found is not None:
                geometries.append(found)
        parents = value.get("parents") or []
        attributes = value.get("attributes")
        city.objects[name] = CityObject(
            name=name,
            kind=value["type"],
            attributes=attributes if isinstance(attributes, dict) else {},
            parents=tuple(
                map(str, parents if isinstance(parents, list) else [])
            ),
            geometries=tuple(geometries),
        )


def _settle_axes(city: CityFile, vertices: np.ndarray) -> None:
    """Settles the order of coordinates, and counts assumptions."""
    defined = city.system
    middle = vertices[len(vertices) // 2]
    city.system = defined.as_used(middle)
    if city.system == defined and defined.name:
        first, second, _ = middle.tolist()
        if not defined.has_place(first, second):
            city.faults.add(
                "coordinates beyond the area of their reference system",
                defined.name,
            )
    if city.system != defined:
        city.faults.add(
            "reference system with north first, but coordinates with east "
            "first; read as east first",
            defined.name,
        )
    if defined.heights_assumed and not defined.is_plain:
        city.faults.add(
            "reference system without heights; its horizontal unit taken for "
            "them",
            defined.name,
        )


def _vertices(document: dict, transform: object, where: str) -> np.ndarray:
    """Returns the vertices (N, 3) in coordinates of the file."""
    points = _numbers(document.get("vertices", []), f"{where}: vertices")
    if isinstance(transform, dict):
        scale = _numbers([transform.get("scale")], f"{where}: transform.scale")
        move = _numbers(
            [transform.get("translate")], f"{where}: transform.translate"
        )
        with np.errstate(over="ignore", invalid="ignore"):
            points = points * scale + move
    if not (np.abs(points) <= _FARTHEST).all():  # NaN fails, too.
        raise InputError(
            f"{where}: vertices: a coordinate beyond {_FARTHEST:g} m"
        )
    return points


def _numbers(values: Any, where: str) -> np.ndarray:
    """Returns (N, 3) float64."""
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
    """Geometry templates, which objects place in the world."""

    def __init__(
        self,
        whole: dict,
        vertices: np.ndarray,
        system: ReferenceSystem,
        where: str,
    ):
        templates = whole.get("geometry-templates")
        templates = templates if isinstance(templates, dict) else {}
        self.geometries = templates.get("templates") or []
        self.points = _numbers(
            templates.get("vertices-templates", []),
            f"{where}: geometry-templates.vertices-templates",
        )
        self.vertices = vertices
        self.system = system

    def place(self, instance: dict) -> tuple[object, np.ndarray]:
        """Returns a template and its vertices in the world.

        Raises:
            LookupError, TypeError, ValueError: if the instance is faulty.
        """
        template = self.geometries[instance["template"]]
        (reference,) = instance["boundaries"]
        X = np.array(instance["transformationMatrix"], dtype=np.float64)
        X = X.reshape(4, 4)
        with np.errstate(over="ignore", invalid="ignore"):
            placed = self.points @ X[:3, :3].T + X[:3, 3]
        if reference < 0 or not (np.abs(placed) <= _FARTHEST).all():
            raise ValueError
        in_metres = self.system.to_metres(placed)
        return template, in_metres + self.vertices[reference]


def _read_geometry(
    geometry: Any,
    vertices: np.ndarray,
    templates: _Templates,
    name: str,
    faults: ImportFaults,
) -> CityGeometry | None:
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
    """Returns a face; None if an index is none of the vertices."""
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
    """Returns the type of each face; "" if unknown."""
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
