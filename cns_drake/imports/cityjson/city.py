"""Imports a city from a CityJSON file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
import re

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry import Finish
from cns_drake.imports import colours
from cns_drake.imports.building_years import construction_year
from cns_drake.imports.cityjson.city_file import (
    CityFile,
    CityGeometry,
    CityObject,
)
from cns_drake.imports.cityjson.reading import read_cityjson
from cns_drake.imports.faces import face_triangles, joined_triangles
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.foreign_city import ForeignCity
from cns_drake.imports.imported_objects import ImportedObject, make_object

# A geometry of a lower level of detail is left out if a higher one covers more
# than this share of it.
_COVERED = 0.5
_WATER = Finish(colours.WATER, "water")
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
    "PlantCover": ("terrain", Finish(colours.LAWN)),
    "SolitaryVegetationObject": ("vegetation", None),
    "TINRelief": ("terrain", None),
    "CityFurniture": ("other-object", None),
    "GenericCityObject": ("other-structure", None),
}
_LONGEST_NAME = 80


def import_cityjson(
    path: Path, lod: float | None, year_attribute: str | None
) -> ForeignCity:
    """Imports a city from a CityJSON file.

    The origin of the map is the centre of the city.

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
        import_objects(city, origin, lod, year_attribute),
        tuple(origin.tolist()),
        city.system.name,
        city.faults,
        axes=() if city.system.is_plain else city.system.axes,
    )


def import_objects(
    city: CityFile,
    origin: np.ndarray,
    lod: float | None,
    year_attribute: str | None,
) -> list[ImportedObject]:
    """Returns the objects of a file that have a surface.

    A building and its parts become one object.

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
        chosen = _chosen_geometries(members, lod, city.faults)
        surfaces = _triangles_by_part(chosen, root, city.faults, origin)
        if not any(map(len, surfaces.values())):
            kind = "object without a surface"
            if not chosen and any(one.geometries for one in members):
                kind = f"object without level of detail {lod:g}"
            city.faults.add(f"{kind}, left out", root)
            continue
        name = names[root]
        semantic_class, finish = _class_of(first.object_type)
        years = [
            construction_year(one.attributes, year_attribute, name, city.faults)
            for one in members
        ]
        found.append(
            make_object(
                name,
                semantic_class,
                first.object_type,
                surfaces,
                {"body": finish, "roof": colours.RED_ROOF},
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
    """Returns each object that has no parent, together with its parts.

    The key of such a group is the id of the object without a parent.
    """
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
                and city.objects[p].object_type != "CityObjectGroup"
            ]
            if not parents or parents[0] in seen:
                break
            root = parents[0]
            seen.add(root)
        groups.setdefault(root, []).append(one)
    return groups


def _unique_names(ids: Iterable[str]) -> dict[str, str]:
    """Returns a unique name for each id: letters, digits, dots and dashes."""
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


def _chosen_geometries(
    members: list[CityObject], lod: float | None, faults: ImportFaults
) -> list[CityGeometry]:
    """Chooses which geometries of an object and its parts are used.

    A geometry of a part is left out if a more detailed geometry of the whole
    covers it. In the same way, a geometry of the whole is left out if more
    detailed geometries of parts cover it.
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
            if _is_building_body(one)
            and _is_building_body(owner)
            and other.lod > geometry.lod
            and (is_whole or int(other.lod) > int(geometry.lod))
        ]
        if better and _is_covered(geometry, better):
            faults.add("geometry with a better one inside, left out", one.name)
        else:
            kept.append(geometry)
    return kept


def _is_building_body(one: CityObject) -> bool:
    """Returns whether an object is a building or a `BuildingPart`.

    The other children of a building are installations such as balconies.
    """
    return not one.parents or one.object_type.endswith("Part")


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


def _triangles_by_part(
    geometries: Iterable[CityGeometry],
    name: str,
    faults: ImportFaults,
    origin: np.ndarray,
) -> dict[str, np.ndarray]:
    """Returns the triangles (M, 3, 3) of `body` and of `roof` in W [m].

    Surfaces without triangles are left out.
    """
    found: dict[str, list[np.ndarray]] = {}
    for geometry in geometries:
        faces = [
            face_triangles([ring - origin for ring in face], name, faults)
            for face in geometry.faces
        ]
        if geometry.is_solid and _enclosed_volume(faces) < -1e-3:
            faults.add("solid turned inside out, reversed", name)
            faces = [triangles[:, ::-1] for triangles in faces]
        for triangles, kind in zip(faces, geometry.kinds, strict=True):
            if kind == "ClosureSurface":
                faults.add("face that only closes a solid, left out", name)
                continue
            part = "roof" if kind == "RoofSurface" else "body"
            found.setdefault(part, []).append(triangles)
    return {part: np.concatenate(found[part]) for part in sorted(found)}


def _enclosed_volume(faces: list[np.ndarray]) -> float:
    """Returns the volume that triangles (M, 3, 3) enclose [m^3]."""
    triangles = joined_triangles(faces)
    if len(triangles) == 0:
        return 0.0
    a, b, c = np.moveaxis(triangles - triangles[0, 0], 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def _class_of(kind: str) -> tuple[str, Finish | None]:
    for beginning, look in _CLASSES.items():
        if kind.startswith(beginning):
            return look
    return "other-object", None
