"""Reads CityJSON 1.0 to 2.0 and CityJSONSeq files.

Specification: https://www.cityjson.org/specs/2.0.1/. A file of type CityJSON
holds all objects. In a sequence (.jsonl), the first line is of type CityJSON,
and each further line is a feature with its own vertices. pyproj defines the
order, direction and units of the axes of the file's reference system.
"""

from collections.abc import Iterator
from pathlib import Path
import re

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_regular, user_errors
from cns_drake.base.json_text import parse_json
from cns_drake.imports.cityjson.axes import exchange_mirrored_axes, settle_axes
from cns_drake.imports.cityjson.city_file import CityFile, CityObject
from cns_drake.imports.cityjson.geometries import (
    GeometrySource,
    Templates,
    read_geometry,
    read_templates,
)
from cns_drake.imports.cityjson.reference_systems import (
    ReferenceSystem,
    check_lengths,
    reference_system,
)
from cns_drake.imports.cityjson.vertices import read_vertices
from cns_drake.imports.faults import ImportFaults

# Every city is wider than 1 m, and narrower than 1 deg (about 100 km).
# Coordinates that extend over less than this are therefore degrees, if the
# city's height, which is in metres in both cases, is greater than this.
_DEGREES_BELOW = 1.0
# Members of objects that are read, or that do not place anything.
_KNOWN_MEMBERS = {
    "type", "geometry", "attributes", "parents", "children", "children_roles",
    "geographicalExtent", "address", "bbox", "extent", "members",
}  # fmt: skip


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
    exchange_mirrored_axes(city)
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
    """Returns the content of a file: the objects of all its documents.

    Raises:
        InputError: a document cannot be read, or is not CityJSON.
    """
    city = CityFile()
    # The last document of type CityJSON, and the name of its reference system.
    whole: dict = {}
    whole_system = ""
    templates = Templates()
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
            templates = read_templates(document, where)
        elif kind != "CityJSONFeature" or not whole:
            raise InputError(f"{where}: type {kind!r} is not CityJSON")
        _read_objects(document, whole, templates, where, city)
    return city


def _check_version(document: dict, where: str) -> None:
    version = str(document.get("version", ""))
    if not re.match(r"[12]\.", version):
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
    """Returns the JSON object in a text.

    Raises:
        InputError: there is no such object; the message begins with `where`.
    """
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
    """Returns the reference system that the metadata of a document names."""
    metadata = document.get("metadata")
    if not isinstance(metadata, dict):
        return ReferenceSystem()
    name = metadata.get("referenceSystem", metadata.get("crs", ""))
    if isinstance(name, dict):
        name = f"EPSG:{name.get('epsg', '')}"
    return reference_system(str(name), f"{where}: metadata.referenceSystem")


def _read_objects(
    document: dict,
    whole: dict,
    templates: Templates,
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

    Raises:
        InputError: the objects, the vertices or the transform cannot be used.
    """
    objects = document.get("CityObjects", {})
    if not isinstance(objects, dict):
        raise InputError(f"{where}: CityObjects: not an object")
    if not objects:
        return
    transform = document.get("transform", whole.get("transform"))
    if transform is None and not str(whole.get("version")).startswith("1.0"):
        city.faults.add("no transform; vertices taken as coordinates", where)
    vertices = read_vertices(document, transform, where)
    if not city.objects and len(vertices):
        _count_assumptions(city)
        settle_axes(city, vertices)
    vertices = city.system.to_metres(vertices)
    source = GeometrySource(vertices, templates, city.system)
    for name, value in objects.items():
        if not isinstance(value, dict) or not isinstance(
            value.get("type"), str
        ):
            city.faults.add("object without a type, left out", name)
            continue
        if name in city.objects:
            city.faults.add("object that is there twice, its last taken", name)
        city.objects[name] = _read_object(name, value, source, city.faults)
    _add_parents(objects, city)


def _count_assumptions(city: CityFile) -> None:
    """Adds assumptions about the reference system to the city's faults."""
    system = city.system
    if not system.name:
        city.faults.add(
            "no reference system; metres east, north and up assumed", "the file"
        )
    elif system.heights_assumed and not system.is_plain:
        city.faults.add(
            "reference system without heights; its horizontal unit taken for "
            "them",
            system.name,
        )


def _read_object(
    name: str, value: dict, source: GeometrySource, faults: ImportFaults
) -> CityObject:
    """Returns an object of the file; what is not read is counted in `faults`.

    `source` is what the object's geometries refer to.
    """
    for key in value.keys() - _KNOWN_MEMBERS:
        faults.add(f"{key} of an object, not read", name)
    listed = value.get("geometry") or []
    geometries = [
        read_geometry(geometry, source, name, faults)
        for geometry in (listed if isinstance(listed, list) else [listed])
    ]
    parents = value.get("parents") or []
    attributes = value.get("attributes")
    return CityObject(
        name,
        value["type"],
        attributes if isinstance(attributes, dict) else {},
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
