"""Reads CityJSON 1.0 to 2.0 and CityJSONSeq files.

Specification: https://www.cityjson.org/specs/2.0.1/. A file of type CityJSON
holds all objects. In a sequence (.jsonl), the first line is of type CityJSON,
and each further line is a feature with its own vertices. pyproj defines the
order, direction and units of the axes of the file's reference system.
"""

from collections.abc import Iterator, Sequence
import contextlib
from dataclasses import dataclass, field
import itertools
from pathlib import Path
import re
from typing import Any, NamedTuple

import numpy as np

from evaluation.base import (
    InputError,
    check_expansion,
    check_regular,
    dot,
    errors_at,
    parse_json,
    product,
    rotated,
    user_errors,
    value_errors,
)
from worlds.imports.cityjson.city_file import (
    CityFile,
    CityGeometry,
    CityObject,
    Face,
)
from worlds.imports.cityjson.reference_systems import (
    ReferenceSystem,
    check_lengths,
    reference_system,
)
from worlds.imports.faults import WHOLE_FILE, ImportFaults
from worlds.imports.part_tables import PartTable

# Every city is wider than 1 m, and narrower than 1 deg (about 100 km).
# Coordinates that extend over less than this are therefore degrees, if the
# city's height, which is in metres in both cases, is greater than this.
_DEGREES_BELOW = 1.0
_PARTS = PartTable(Path(__file__).with_name("parts.yaml"))
# A city is mirrored if less than this share of its geometries look outwards.
_MIRRORED_SHARE = 0.1
# At most this many geometries are judged.
_MOST_JUDGED = 1000
# A geometry is judged if six times the volume of a solid [m^3], or twice the
# area of other surfaces as seen from above [m^2], is greater than this.
_LEAST_JUDGED = 1e-3
# Type of a face -> 1 if the face must look upwards, -1 if downwards.
_UP_OR_DOWN = {"RoofSurface": 1.0, "GroundSurface": -1.0}
_UP_OR_DOWN_IN_TERRAIN = {**_UP_OR_DOWN, "": 1.0}
_BEYOND = "coordinates beyond the area of their reference system"
# Type of a geometry -> depth of the lists that contain its faces.
_NESTING = {
    "MultiSurface": 0,
    "CompositeSurface": 0,
    "Solid": 1,
    "MultiSolid": 2,
    "CompositeSolid": 2,
}
# Versions that are read, with a patch of the format.
_VERSION = re.compile(r"(1\.[01]|2\.0)(\.\d+)?")
# No place on Earth is farther than this from the origin of a survey grid [m].
_FARTHEST = 1e8


def read_cityjson(path: Path) -> CityFile:
    """Reads a CityJSON file.

    Raises:
        InputError: the file cannot be read, is not CityJSON, has no surface, or
            has coordinates that cannot be converted to metres.
    """
    city = _read_documents(path)
    if not city.objects:
        raise InputError(f"{path}: the file has no objects")
    if not any(city.faces()):
        raise InputError(f"{path}: no object has a surface")
    _exchange_mirrored_axes(city)
    low, high = city.bounds()
    if _look_like_degrees(low, high):
        raise InputError(
            f"{path}: coordinates look like degrees; project them to metres"
            " first (for example with cjio's crs_reproject)"
        )
    if city.system.name:
        check_lengths(
            city.system.name,
            (low + high) / 2.0,
            f"{path}: metadata.referenceSystem",
        )
    return city


def _look_like_degrees(low: np.ndarray, high: np.ndarray) -> bool:
    """Returns whether a city's coordinates are longitude, latitude and metres.

    `low` and `high` (3,) are the least and the greatest coordinates of the
    city.
    """
    are_places = (np.abs([low, high]) <= [180.0, 90.0, np.inf]).all()
    *sides, height = (high - low).tolist()
    return bool(are_places and max(sides) < _DEGREES_BELOW < height)


def _read_documents(path: Path) -> CityFile:
    """Returns the content of a file: the objects of all its documents."""
    city = CityFile()
    # The last document of type CityJSON, and the name of its reference system.
    whole: dict = {}
    whole_system = ""
    templates = _Templates()
    for number, document in _documents(path):
        kind = document.get("type")
        where = str(path) if number == 0 else f"{path}: line {number}"
        if kind == "CityJSON":
            whole = document
            _check_version(document, where)
            system = _reference_system(document, where)
            if city.objects and system.name != whole_system:
                raise InputError(
                    f"{where}: metadata.referenceSystem: not that of the lines"
                    f" before, {whole_system or 'none'}"
                )
            if not city.objects:
                city.system, whole_system = system, system.name
            templates = _read_templates(document, where)
        elif kind != "CityJSONFeature" or not whole:
            raise InputError(f"{where}: type {kind!r} is not CityJSON")
        _read_objects(document, whole, templates, where, city)
    return city


def _check_version(document: dict, where: str) -> None:
    version = str(document.get("version", ""))
    if not _VERSION.fullmatch(version):
        raise InputError(
            f"{where}: CityJSON of version {version!r}, not 1.0 to 2.0"
        )


def _documents(path: Path) -> Iterator[tuple[int, dict]]:
    """Yields the number of each line of a file, and the JSON object in it.

    The number is 0 if the whole file is one object.
    """
    check_regular(path)
    with user_errors(path):
        if path.suffix == ".jsonl":
            with path.open("rb") as stream:
                for number, line in enumerate(stream, start=1):
                    if line.strip():
                        yield (
                            number,
                            _json_object(line, f"{path}: line {number}"),
                        )
        else:
            yield 0, _json_object(path.read_bytes(), str(path))


def _json_object(text: bytes, where: str) -> dict:
    """Returns the JSON object in a text."""
    try:
        value = parse_json(text)
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: not UTF-8 ({error.reason})") from error
    except ValueError as error:
        raise InputError(f"{where}: no JSON ({error})") from error
    if not isinstance(value, dict):
        raise InputError(f"{where}: no JSON object")
    return value


def _reference_system(document: dict, where: str) -> ReferenceSystem:
    """Returns the reference system that the metadata of a document names."""
    metadata = document.get("metadata")
    if not isinstance(metadata, dict):
        return ReferenceSystem()
    name = metadata.get("referenceSystem", metadata.get("crs", ""))
    if isinstance(name, dict):
        name = f"EPSG:{name.get('epsg', '')}"
    return reference_system(str(name), f"{where}: metadata.referenceSystem")


@dataclass
class _Templates:
    """Geometry templates of a file, which objects place in the world.

    Attributes:
        geometries: the templates, as in the file.
        points: (N, 3) vertices of all templates, in coordinates of the file.
    """

    geometries: Sequence[Any] = ()
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def check_places(self, objects: dict) -> None:
        """Refuses objects that place templates far too often.

        Raises:
            ValueError: they do.
        """
        placed = [
            geometry.get("template")
            for value in objects.values()
            if isinstance(value, dict)
            and isinstance(value.get("geometry"), list)
            for geometry in value["geometry"]
            if isinstance(geometry, dict)
        ]
        used = [one for one in placed if isinstance(one, int)]
        check_expansion(
            -1, lambda one: used if one == -1 else (), self._num_faces
        )

    def _num_faces(self, index: int) -> int:
        """Returns the number of faces of a template; 0 if it is faulty."""
        with contextlib.suppress(LookupError, TypeError, ValueError):
            geometry = self.geometries[index] if index >= 0 else {}
            nesting = _NESTING[geometry["type"]]
            return len(_flat(None, geometry["boundaries"], nesting))
        return 0


def _read_templates(document: dict, where: str) -> _Templates:
    """Returns the templates in a document of type CityJSON.

    `where` names the file and the line of the document in error messages.
    """
    templates = document.get("geometry-templates")
    templates = templates if isinstance(templates, dict) else {}
    points = to_triples(
        templates.get("vertices-templates", []),
        f"{where}: geometry-templates.vertices-templates",
    )
    return _Templates(templates.get("templates") or [], points)


class _GeometrySource(NamedTuple):
    """What the geometries of a document refer to.

    Attributes:
        vertices: (N, 3) vertices of the document [m].
        templates: templates of the file.
        system: reference system of the templates.
    """

    vertices: np.ndarray
    templates: _Templates
    system: ReferenceSystem

    def instance(self, instance: dict) -> tuple[Any, np.ndarray]:
        """Returns an instance's template, and the vertices of the instance.

        The vertices (N, 3) are the template's vertices, transformed to the
        place of the instance [m].

        Args:
            instance: geometry of the type `GeometryInstance`, which refers to a
                template and a transformation.

        Raises:
            LookupError, TypeError, ValueError: if the instance is faulty.
        """
        template = self.templates.geometries[instance["template"]]
        (reference,) = instance["boundaries"]
        X = np.array(instance["transformationMatrix"], dtype=np.float64)
        X = X.reshape(4, 4)
        with np.errstate(over="ignore", invalid="ignore"):
            placed = rotated(X[:3, :3], self.templates.points) + X[:3, 3]
        is_affine = (X[3] == [0.0, 0.0, 0.0, 1.0]).all()
        if reference < 0 or not is_affine:
            raise ValueError
        if not (np.abs(placed) <= _FARTHEST).all():
            raise ValueError
        return template, (
            self.system.to_metres(placed) + self.vertices[reference]
        )


def _read_geometry(
    geometry: Any, source: _GeometrySource, name: str, faults: ImportFaults
) -> CityGeometry | None:
    """Returns a geometry of an object; None if the geometry cannot be read.

    Args:
        geometry: the geometry in the file.
        source: the vertices and templates to which the geometry refers.
        name: id of the object, as an example in `faults`.
        faults: counts geometries and faces that are left out.
    """
    vertices = source.vertices
    if isinstance(geometry, dict):
        _PARTS.account(["geometry"], geometry, name, faults)
    try:
        lod = _level_of_detail(geometry.get("lod"))
        kind = geometry["type"]
        if kind == "GeometryInstance":
            geometry, vertices = source.instance(geometry)
            kind = geometry["type"]
            lod = lod or _level_of_detail(geometry.get("lod"))
        if kind not in _NESTING:
            faults.add(f"geometry of type {kind}, left out", name)
            return None
        boundaries = geometry["boundaries"]
        for _ in range(_NESTING[kind]):
            boundaries = [face for group in boundaries for face in group]
        kinds = _surface_kinds(geometry, name, faults)
    except (LookupError, TypeError, ValueError, AttributeError):
        faults.add("geometry that is not an object, left out", name, ruins=True)
        return None
    faces, kinds_of_faces = [], []
    for boundary, kind_of_face in zip(boundaries, kinds, strict=True):
        face = _face_of_boundary(boundary, vertices)
        if face is None:
            faults.add("face with unknown vertices, left out", name, ruins=True)
        else:
            faces.append(face)
            kinds_of_faces.append(kind_of_face)
    return CityGeometry(lod, faces, kinds_of_faces, _NESTING[kind] > 0)


def _level_of_detail(value: object) -> float:
    """Returns the level of detail that a geometry states; 0 if none."""
    return float(str(value)) if value is not None else 0.0


def _face_of_boundary(boundary: Any, vertices: np.ndarray) -> Face | None:
    """Returns a face; None if an index belongs to no vertex."""
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


def _surface_kinds(
    geometry: dict, name: str, faults: ImportFaults
) -> Sequence[str]:
    """Returns the type of each face of a geometry; "" for an unknown type.

    Args:
        geometry: the geometry, whose boundaries can be read.
        name: id of the object, as an example in `faults`.
        faults: counts semantics that do not fit the geometry.
    """
    nesting = _NESTING[geometry["type"]]
    boundaries = geometry["boundaries"]
    semantics = geometry.get("semantics")
    unknown = [""] * len(_flat(None, boundaries, nesting))
    if semantics is None:
        return unknown
    try:
        _PARTS.account(["semantics"], semantics, name, faults)
        surfaces = semantics["surfaces"]
        for surface in surfaces:
            _PARTS.account(["surface"], surface, name, faults)
        values = _flat(semantics.get("values"), boundaries, nesting)
        types = [str(surface.get("type", "")) for surface in surfaces]
    except (AttributeError, LookupError, TypeError, ValueError):
        faults.add("semantics that do not fit their faces, ignored", name)
        return unknown
    kinds = []
    for value in values:
        is_index = type(value) is int and 0 <= value < len(types)
        kinds.append(types[value] if is_index else "")
        if not is_index and value is not None:
            faults.add("semantics of a face that are not there", name)
    return kinds


def _flat(values: Any, boundaries: Sequence, nesting: int) -> list:
    """Returns the value of each face, from values nested like the boundaries.

    None is the value of all faces within its place.

    Raises:
        TypeError, ValueError: the values are nested otherwise.
    """
    if values is None:
        values = [None] * len(boundaries)
    pairs = list(zip(values, boundaries, strict=True))
    if nesting == 0:
        return [value for value, _ in pairs]
    return [
        inner
        for value, group in pairs
        for inner in _flat(value, group, nesting - 1)
    ]


def _read_objects(
    document: dict,
    whole: dict,
    templates: _Templates,
    where: str,
    city: CityFile,
) -> None:
    """Adds the objects of a document to a city.

    The first document with vertices also settles the order of the city's axes.

    Args:
        document: the document, a JSON object.
        whole: the last document of type CityJSON, whose transform the document
            has if it has none of its own.
        templates: the templates of `whole`.
        where: place of the document, for error messages.
        city: the city, which gets the objects.
    """
    _PARTS.account(["file"], document, where, city.faults)
    objects = document.get("CityObjects", {})
    if not isinstance(objects, dict):
        raise InputError(f"{where}: CityObjects: not an object")
    if not objects:
        return
    transform = document.get("transform", whole.get("transform"))
    if transform is None and not str(whole.get("version")).startswith("1.0"):
        city.faults.add("no transform; vertices taken as coordinates", where)
    vertices = _read_vertices(document, transform, where)
    if not city.objects and len(vertices):
        _count_assumptions(city)
        _settle_axes(city, vertices)
    vertices = city.system.to_metres(vertices)
    with value_errors(f"{where}: geometry-templates"):
        templates.check_places(objects)
    source = _GeometrySource(vertices, templates, city.system)
    for name, value in objects.items():
        if not isinstance(value, dict) or not isinstance(
            value.get("type"), str
        ):
            city.faults.add("object without a type, left out", name)
            continue
        if name in city.objects:
            city.faults.add("object that is there twice, its last taken", name)
        with errors_at(where):
            city.objects[name] = _read_object(name, value, source, city.faults)
    _add_parents(objects, city)


def _count_assumptions(city: CityFile) -> None:
    """Adds assumptions about the reference system to the city's faults."""
    system = city.system
    if not system.name:
        city.faults.add(
            "no reference system; metres east, north and up assumed", WHOLE_FILE
        )
    elif system.heights_assumed and not system.is_plain:
        city.faults.add(
            "reference system without heights; its horizontal unit taken for "
            "them",
            WHOLE_FILE,
        )


def _read_object(
    name: str, value: dict, source: _GeometrySource, faults: ImportFaults
) -> CityObject:
    """Returns an object of the file; what is not read is counted in `faults`.

    `source` is what the object's geometries refer to.
    """
    _PARTS.account(["object"], value, name, faults)
    listed = value.get("geometry") or []
    geometries = [
        _read_geometry(geometry, source, name, faults)
        for geometry in (listed if isinstance(listed, list) else [listed])
    ]
    parents = value.get("parents") or []
    attributes = value.get("attributes")
    attributes = attributes if isinstance(attributes, dict) else {}
    known = {k: v for k, v in attributes.items() if v not in (None, "")}
    _PARTS.account(["attributes"], known, name, faults)
    return CityObject(
        name,
        value["type"],
        attributes,
        list(map(str, parents if isinstance(parents, list) else [])),
        [geometry for geometry in geometries if geometry is not None],
    )


def _add_parents(objects: dict, city: CityFile) -> None:
    """Adds the parents that only the children of an object name."""
    for name, value in objects.items():
        children = value.get("children") if isinstance(value, dict) else None
        for child in children if isinstance(children, list) else []:
            part = city.objects.get(str(child))
            if part is not None and not part.parents:
                city.objects[part.name] = part._replace(parents=[name])


def _settle_axes(city: CityFile, vertices: np.ndarray) -> None:
    """Decides which of the first two coordinates is east, if it can.

    Many programs write east first although the definition of the reference
    system says north first. East first is assumed if only this order brings the
    middle vertex of the file into the system's area of use.

    In two cases, the order stays open, and `_exchange_mirrored_axes` decides by
    the faces: both orders bring the vertex into the area, or the system is
    defined as east first and only north first brings the vertex there.

    An exchange counts as a fault of the city. It also counts as a fault if the
    vertex is outside the area and the order is not exchanged here.

    Args:
        city: the city, whose objects are not read yet. Without a reference
            system, the function does nothing.
        vertices: (N, 3) vertices of the file in its own coordinates, N > 0.
    """
    defined = city.system
    if not defined.name:
        return
    first, second, _ = vertices[len(vertices) // 2].tolist()
    is_there = defined.has_place(first, second)
    city.order_is_open = defined.has_place(second, first)
    if city.order_is_open and not is_there and defined.is_north_first:
        city.order_is_open = False
        _exchange_axes(city)
    elif not is_there:
        city.faults.add(_BEYOND, WHOLE_FILE)


def _exchange_axes(city: CityFile) -> None:
    """Exchanges the first two coordinates of the system and of all faces."""
    defined = city.system
    city.system = defined.exchanged()
    turn = product(city.system.matrix, np.linalg.inv(defined.matrix))
    for face in city.faces():
        face[:] = [rotated(turn, ring) for ring in face]
    order = [axis.partition(" ")[0] for axis in defined.axes[:2]]
    city.faults.add(
        f"reference system with {order[0]} first, but coordinates with"
        f" {order[1]} first; read as {order[1]} first",
        WHOLE_FILE,
    )


def _exchange_mirrored_axes(city: CityFile) -> None:
    """Exchanges the first two coordinates if the city is mirrored otherwise.

    The corners of a face are counter-clockwise as seen from outside; in a
    mirrored city, faces are inside out. Coordinates are exchanged only if
    `_settle_axes` has left their order open. Without a reference system, a
    mirrored city is counted as a fault. An order that is open is counted as
    well, if no face can be judged and north is first.
    """
    if city.system.name and not city.order_is_open:
        return
    outwards = list(itertools.islice(_look_outwards(city), _MOST_JUDGED))
    if not outwards:
        if city.system.is_north_first:
            kind = "order of axes that no face shows, taken as defined"
            city.faults.add(kind, WHOLE_FILE)
    elif sum(outwards) < _MIRRORED_SHARE * len(outwards):
        if city.order_is_open:
            _exchange_axes(city)
            if any(fault.kind == _BEYOND for fault in city.faults.rows()):
                city.faults.take_back(_BEYOND)
        elif len(outwards) > 1:
            city.faults.add(
                "all inside out: the city may be mirrored (north first?)",
                WHOLE_FILE,
            )


def _look_outwards(city: CityFile) -> Iterator[bool]:
    """Yields for each geometry whether its faces look outwards.

    A solid whose faces look outwards has a positive volume. Roofs and terrains
    must look upwards, and floors downwards. Geometries are left out if their
    volume or area is too small to judge.
    """
    for city_object in city.objects.values():
        is_terrain = city_object.object_type == "TINRelief"
        signs = _UP_OR_DOWN_IN_TERRAIN if is_terrain else _UP_OR_DOWN
        for geometry in city_object.geometries:
            if not geometry.faces:
                continue
            first = geometry.faces[0][0][0]
            size = 0.0
            for face, kind in zip(geometry.faces, geometry.kinds, strict=True):
                for ring in face:
                    p = ring - first
                    # Normal of the ring, as long as twice its area.
                    normal = np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)
                    if geometry.is_solid:
                        size += float(dot(p[0], normal))
                    else:
                        size += signs.get(kind, 0.0) * float(normal[2])
            if abs(size) > _LEAST_JUDGED:
                yield size > 0.0


def _read_vertices(document: dict, transform: object, where: str) -> np.ndarray:
    """Returns the vertices (N, 3) of a document, in coordinates of the file.

    Args:
        document: the document, a JSON object.
        transform: the transform of the document, a JSON object with scale and
            translation; None if the vertices are coordinates.
        where: place of the document, for error messages.
    """
    points = to_triples(document.get("vertices", []), f"{where}: vertices")
    if transform is not None and not isinstance(transform, dict):
        raise InputError(f"{where}: transform: not an object")
    for key in (transform or {}).keys() - {"scale", "translate"}:
        raise InputError(f"{where}: transform.{key} is not read")
    if transform:
        scale, move = (
            to_triples([transform.get(key)], f"{where}: transform.{key}")
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


def to_triples(values: Any, where: str) -> np.ndarray:
    """Returns a list of N triples of numbers as an array (N, 3).

    `where` is the place of the list in the file, for error messages.

    Raises:
        InputError: an item of the list is not a triple of numbers.
    """
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
