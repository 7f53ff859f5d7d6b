"""Structures of the objects of a CityJSON file."""

from collections import Counter
from pathlib import Path
import re

import numpy as np

from cns_drake.imports.building_years import construction_year
from cns_drake.imports.cityjson.reader import (
    CityFile,
    CityGeometry,
    CityObject,
    read_cityjson,
)
from cns_drake.imports.faces import face_triangles
from cns_drake.imports.foreign_city import (
    LAWN,
    RED_ROOF,
    WATER,
    ForeignCity,
    Imported,
    Rgb,
    make_imported,
)
from cns_drake.imports.options import ImportFaults

# Beginning of a type -> class, and a colour if the class's would mislead.
_CLASSES: tuple[tuple[str, str, Rgb | None], ...] = (
    ("Building", "building", None),
    ("Bridge", "other-structure", None),
    ("Tunnel", "other-structure", None),
    ("OtherConstruction", "other-structure", None),
    ("Road", "road", None),
    ("Railway", "other-ground", None),
    ("TransportSquare", "road", None),
    ("Square", "road", None),
    ("Track", "road", None),
    ("Waterway", "other-ground", WATER),
    ("WaterBody", "other-ground", WATER),
    ("LandUse", "other-ground", None),
    ("PlantCover", "terrain", LAWN),
    ("SolitaryVegetationObject", "vegetation", None),
    ("TINRelief", "terrain", None),
    ("CityFurniture", "other-object", None),
    ("GenericCityObject", "other-structure", None),
)
_LONGEST_NAME = 80


def import_cityjson(
    path: Path, lod: float | None, year_attribute: str | None
) -> ForeignCity:
    """Reads a CityJSON file; its origin is the middle of its city.

    Raises:
        InputError: if it cannot be used.
    """
    city = read_cityjson(path)
    low, high = city.bounds()
    origin = np.array([*np.round((low + high)[:2] / 2.0), np.floor(low[2])])
    return ForeignCity(
        import_structures(city, origin, lod, year_attribute),
        tuple(float(value) for value in origin),
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

    A building with its parts is one.

    Args:
        city: the content of the file; its faults are extended.
        origin: (3,) the world's origin in the file's coordinates [m].
        lod: level of detail to take; the highest of each object if None.
        year_attribute: see `construction_year`.
    """
    groups = _families(city)
    names = _unique_names(list(groups))
    found = [
        _make(
            names[root],
            city.objects[root],
            members,
            city.faults,
            origin,
            lod,
            year_attribute,
        )
        for root, members in groups.items()
    ]
    return [one for one in found if one is not None]


def _families(city: CityFile) -> dict[str, list[CityObject]]:
    """Returns id of each topmost object -> the object and its parts."""
    groups: dict[str, list[CityObject]] = {}
    for name, one in city.objects.items():
        root, seen = name, {name}
        while True:
            parents = [
                p
                for p in city.objects[root].parents
                if p in city.objects
                # A group is not one structure: it may hold half a city.
                and city.objects[p].kind != "CityObjectGroup"
            ]
            if not parents or parents[0] in seen:
                break
            root = parents[0]
            seen.add(root)
        groups.setdefault(root, []).append(one)
    return groups


def _unique_names(ids: list[str]) -> dict[str, str]:
    """Returns id -> name of letters, digits, dots and dashes."""
    plain = {
        one: re.sub(r"[^\w.-]+", "_", one, flags=re.ASCII)[:_LONGEST_NAME]
        or "object"
        for one in ids
    }
    counts = Counter(plain.values())
    taken: set[str] = set()
    names = {}
    for one in ids:
        name = plain[one]
        number = 1
        while name in taken or (number == 1 and counts[plain[one]] > 1):
            name = f"{plain[one]}_{number}"
            number += 1
        taken.add(name)
        names[one] = name
    return names


def _make(
    name: str,
    first: CityObject,
    members: list[CityObject],
    faults: ImportFaults,
    origin: np.ndarray,
    lod: float | None,
    year_attribute: str | None,
) -> Imported | None:
    chosen = _geometries(members, lod)
    if not chosen:
        kind = "object without a surface"
        if any(one.geometries for one in members):
            kind = f"object without level of detail {lod:g}"
        faults.add(f"{kind}, left out", first.name)
        return None
    surfaces: dict[str, list[np.ndarray]] = {}
    for geometry in chosen:
        for kind, triangles in _triangles(geometry, first.name, faults, origin):
            surfaces.setdefault(kind, []).append(triangles)
    whole = {kind: np.concatenate(surfaces[kind]) for kind in sorted(surfaces)}
    if not any(len(triangles) for triangles in whole.values()):
        faults.add("object without a surface, left out", first.name)
        return None
    semantic_class, rgb = _class_of(first.kind)
    years = [
        construction_year(one.attributes, year_attribute, name, faults)
        for one in members
    ]
    known = [year for year in years if year is not None]
    return make_imported(
        name,
        semantic_class,
        first.kind,
        whole,
        {"body": rgb, "roof": RED_ROOF},
        known[0] if known else None,
        tags={
            key: str(value)
            for one in reversed(members)
            for key, value in one.attributes.items()
            if isinstance(value, str | int | float)
        },
        lod=max(geometry.lod for geometry in chosen),
    )


def _geometries(
    members: list[CityObject], lod: float | None
) -> list[CityGeometry]:
    """Returns the geometry to use of an object and its parts."""
    chosen = []
    for one in members:
        usable = [g for g in one.geometries if lod is None or g.lod == lod]
        if usable:
            highest = max(g.lod for g in usable)
            chosen += [g for g in usable if g.lod == highest]
    # A footprint is dropped if there is any better geometry.
    if any(g.lod >= 1.0 for g in chosen):
        chosen = [g for g in chosen if g.lod >= 1.0]
    return chosen


def _triangles(
    geometry: CityGeometry,
    name: str,
    faults: ImportFaults,
    origin: np.ndarray,
) -> list[tuple[str, np.ndarray]]:
    """Returns type of surface -> its triangles in the world."""
    found = []
    for face, kind in zip(geometry.faces, geometry.kinds, strict=True):
        rings = [ring - origin for ring in face]
        triangles = face_triangles(rings, name, faults)
        found.append(("roof" if kind == "RoofSurface" else "body", triangles))
    if geometry.is_solid and _volume([t for _, t in found]) < -1e-3:
        faults.add("solid turned inside out, reversed", name)
        found = [(kind, triangles[:, ::-1]) for kind, triangles in found]
    return found


def _volume(faces: list[np.ndarray]) -> float:
    """Returns the volume that triangles (M, 3, 3) enclose [m^3]."""
    triangles = np.concatenate([np.zeros((0, 3, 3)), *faces])
    if len(triangles) == 0:
        return 0.0
    a, b, c = np.moveaxis(triangles - triangles[0, 0], 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def _class_of(kind: str) -> tuple[str, Rgb | None]:
    for beginning, semantic_class, rgb in _CLASSES:
        if kind.startswith(beginning):
            return semantic_class, rgb
    return "other-object", None
