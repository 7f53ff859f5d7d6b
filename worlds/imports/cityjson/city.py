"""Imports a city from a CityJSON file."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
import itertools
from pathlib import Path
import re

import numpy as np
from scipy.spatial import cKDTree
import shapely
from shapely.geometry.base import BaseGeometry

from worlds.imports import colours
from worlds.imports.building_years import construction_year, demolition_year
from worlds.imports.cityjson.city_file import CityFile, CityGeometry, CityObject
from worlds.imports.cityjson.reading import read_cityjson
from worlds.imports.faces import face_triangles, joined_triangles, valid_area
from worlds.imports.faults import ImportFaults
from worlds.imports.foreign_city import ForeignCity
from worlds.imports.imported_objects import Base, ImportedObject, make_object
from worlds.shapes import GROUND_CLASSES, Finish, UpperSides, turned_up

# A geometry of a lower level of detail is left out if a higher one covers more
# than this share of it.
_COVERED = 0.5
# From this level of detail on, a geometry is more than a footprint.
_LEAST_BODY_LOD = 1.0
# A solid is turned inside out if its volume is less than this [m^3]. Flat
# solids, whose volume is 0 except for rounding errors, are not.
_INSIDE_OUT_BELOW = -1e-3
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
# Beginning of a type -> where its objects are.
_BASES = {"Bridge": Base.DECK, "Tunnel": Base.UNDERGROUND}
# An object stands above the ground if its lowest corner is this far above it,
# as a canopy is; structures with a room are higher [m].
_LEAST_ROOM = 2.0
# A surface that is at most this far above or below a roof lies on it [m].
_ON_ROOF = 0.3
# Number of neighbours with which what may be raised is compared.
_NEIGHBOURS = 8
# The corners of a level face differ in height by at most this [m].
_LEVEL = 0.05
# Type of a group of objects, which has no shape of its own.
_GROUP = "CityObjectGroup"
# Names are cut to this length.
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
        len(_families(city)),
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
    families = _families(city)
    names = _unique_names(families)
    made = []
    for root, members in families.items():
        chosen = _chosen_geometries(members, lod, city.faults)
        surfaces = _triangles_by_part(chosen, root, city.faults, origin)
        if not any(map(len, surfaces.values())):
            kind = "object without a surface"
            ruins = city.objects[root].object_type != _GROUP
            if not chosen and any(member.geometries for member in members):
                kind = f"object without level of detail {lod:g}"
                ruins = False
            city.faults.add(f"{kind}, left out", root, ruins=ruins)
            continue
        object_type = city.objects[root].object_type
        semantic_class, finish = _class_of(object_type)
        where = (names[root], city.faults)
        attributes = [member.attributes for member in members]
        built = [
            construction_year(one, year_attribute, *where) for one in attributes
        ]
        demolished = [demolition_year(one, *where) for one in attributes]
        made.append(
            make_object(
                names[root],
                semantic_class,
                object_type,
                surfaces,
                {"body": finish, "roof": colours.RED_ROOF},
                _first_year(built, *where),
                _first_year(demolished, *where),
                tags=_tags_of_family(members),
                lod=max(geometry.lod for geometry in chosen),
                base=_base_of(object_type, semantic_class, chosen),
            )
        )
    return list(_on_terrain(made))


def _base_of(
    object_type: str, semantic_class: str, geometries: Sequence[CityGeometry]
) -> Base:
    """Returns where an object stands, by its type and its semantic surfaces.

    A structure whose lowest face is level and known to be no ground, such as
    an OuterCeilingSurface, is open below. Without semantics, the ground around
    it decides.
    """
    for beginning, base in _BASES.items():
        if object_type.startswith(beginning):
            return base
    kinds = {kind for geometry in geometries for kind in geometry.kinds}
    if semantic_class in GROUND_CLASSES or "GroundSurface" in kinds:
        return Base.GROUND
    faces = [
        (face[0][:, 2], kind)
        for geometry in geometries
        for face, kind in zip(geometry.faces, geometry.kinds, strict=True)
    ]
    low = min(z.min() for z, _ in faces)
    is_open = any(kind and z.max() < low + _LEVEL for z, kind in faces)
    return Base.RAISED if is_open else Base.GROUND


def _on_terrain(objects: Sequence[ImportedObject]) -> Iterator[ImportedObject]:
    """Yields objects, with the base that the ground around them shows.

    The ground is the file's terrain. Without terrain, what may be a canopy or
    a roof terrace is compared with the feet of its neighbours.
    """
    is_terrain = [one.object_type == "TINRelief" for one in objects]
    terrain = _upper_sides(itertools.compress(objects, is_terrain))
    may_be_raised = [False] * len(objects)
    if not any(is_terrain):
        rooms = [
            one for one in objects if not _is_flat(one) and not _is_surface(one)
        ]
        roofs = _upper_sides(rooms)
        may_be_raised = [_is_flat(one) or _is_on(roofs, one) for one in objects]
    feet = [
        one.foot
        for one, may_be in zip(objects, may_be_raised, strict=True)
        if one.base is Base.GROUND and not may_be
    ]
    tree = cKDTree(np.reshape(feet, (-1, 3))[:, :2])
    for one, is_it, may_be in zip(
        objects, is_terrain, may_be_raised, strict=True
    ):
        if one.base is Base.GROUND and not is_it:
            corners = one.triangles.reshape(-1, 3)
            above = corners[:, 2] - terrain.heights(corners[:, :2])
            # Where there is no terrain, nothing is known.
            above = above[np.isfinite(above)]
            if may_be and feet:
                count = min(_NEIGHBOURS, len(feet))
                _, near = tree.query(one.foot[:2], range(1, count + 1))
                low = np.median([feet[k][2] for k in near])
                above = one.foot[2:] - low
            if len(above) and above.min() > _LEAST_ROOM:
                one = replace(one, base=Base.RAISED)
            elif len(above) and above.max() < -_LEAST_ROOM:
                one = replace(one, base=Base.UNDERGROUND)
        yield one


def _upper_sides(objects: Iterable[ImportedObject]) -> UpperSides:
    """Returns the upper sides of objects."""
    triangles = joined_triangles(one.triangles for one in objects)
    return UpperSides(turned_up(triangles))


def _is_surface(one: ImportedObject) -> bool:
    """Returns whether an object is a surface, such as a road."""
    return one.structure.semantic_class in GROUND_CLASSES


def _is_flat(one: ImportedObject) -> bool:
    """Returns whether a structure is too flat to contain a room."""
    height = np.ptp(one.triangles[..., 2])
    return not _is_surface(one) and bool(height < _LEAST_ROOM)


def _is_on(roofs: UpperSides, one: ImportedObject) -> bool:
    """Returns whether an object is a surface that lies on roofs."""
    middles = one.triangles.mean(axis=1)
    away = np.abs(roofs.heights(middles[:, :2]) - middles[:, 2])
    return _is_surface(one) and bool((away < _ON_ROOF).all())


def _first_year(
    years: Iterable[int | None], name: str, faults: ImportFaults
) -> int | None:
    """Returns the first year that is known; counts the object if others are."""
    known = [year for year in years if year is not None]
    if len(set(known)) > 1:
        faults.add("dates of parts differ, the first taken", name)
    return known[0] if known else None


def _tags_of_family(members: Sequence[CityObject]) -> dict[str, str]:
    """Returns the attributes of an object and its parts as tags.

    If several of them have an attribute, the value of the first counts.
    """
    return {
        key: str(value)
        for member in reversed(members)
        for key, value in member.attributes.items()
        if isinstance(value, str | int | float)
    }


def _families(city: CityFile) -> dict[str, list[CityObject]]:
    """Returns each object that has no parent, together with its parts.

    The key of such a group is the id of the object without a parent.
    """
    groups: dict[str, list[CityObject]] = {}
    for name, member in city.objects.items():
        root = name
        seen = {name}
        while True:
            parents = [
                parent
                for parent in city.objects[root].parents
                if parent in city.objects
                # A group is not one structure: it may contain half a city.
                and city.objects[parent].object_type != _GROUP
            ]
            if not parents or parents[0] in seen:
                break
            root = parents[0]
            seen.add(root)
        groups.setdefault(root, []).append(member)
    return groups


def _unique_names(ids: Iterable[str]) -> dict[str, str]:
    """Returns a unique name for each id.

    Names consist of letters, digits, dots, dashes and underscores. Where ids
    lead to the same name, all of them get a number.
    """
    plain = {
        own_id: re.sub(r"[^\w.-]+", "_", own_id, flags=re.ASCII)[:_LONGEST_NAME]
        or "object"
        for own_id in ids
    }
    counts = Counter(plain.values())
    names: dict[str, str] = {}
    taken: set[str] = set()
    for own_id, name in plain.items():
        number = 1
        while name in taken or (number == 1 and counts[plain[own_id]] > 1):
            name = f"{plain[own_id]}_{number}"
            number += 1
        taken.add(name)
        names[own_id] = name
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
    for member in members:
        usable = [g for g in member.geometries if lod is None or g.lod == lod]
        if usable:
            highest = max(g.lod for g in usable)
            chosen += [(member, g) for g in usable if g.lod == highest]
    # A footprint is dropped if there is any better geometry.
    bodies = [pair for pair in chosen if pair[1].lod >= _LEAST_BODY_LOD]
    chosen = bodies or chosen
    kept = []
    for member, geometry in chosen:
        is_whole = not member.parents
        # Levels with the same integer part, such as 2 and 2.2, may be used
        # together.
        better = [
            other
            for owner, other in chosen
            if _is_building_body(member)
            and _is_building_body(owner)
            and other.lod > geometry.lod
            and (is_whole or int(other.lod) > int(geometry.lod))
        ]
        if better and _is_covered(geometry, better):
            kind = "geometry with a better one inside, left out"
            faults.add(kind, member.name)
        else:
            kept.append(geometry)
    return kept


def _is_building_body(member: CityObject) -> bool:
    """Returns whether an object is a building or a `BuildingPart`.

    The other children of a building are installations such as balconies.
    """
    return not member.parents or member.object_type.endswith("Part")


def _is_covered(geometry: CityGeometry, others: Sequence[CityGeometry]) -> bool:
    """Returns whether others cover most of a geometry, seen from above."""
    own = _footprint([geometry])
    shared = own.intersection(_footprint(others)).area
    return bool(shared > _COVERED * own.area)


def _footprint(geometries: Iterable[CityGeometry]) -> BaseGeometry:
    """Returns the area of geometries seen from above, in whole millimetres."""
    polygons = [
        valid_area(shapely.Polygon(np.round(face[0][:, :2], 3)))
        for geometry in geometries
        for face in geometry.faces
        if len(face[0]) > 2
    ]
    return shapely.union_all([area for area in polygons if area.area > 0.0])


def _triangles_by_part(
    geometries: Iterable[CityGeometry],
    name: str,
    faults: ImportFaults,
    origin: np.ndarray,
) -> dict[str, np.ndarray]:
    """Returns the triangles (M, 3, 3) of `body` and of `roof` in W [m].

    Surfaces without triangles are left out.

    Args:
        geometries: geometries of an object and its parts.
        name: id of the object, as an example in `faults`.
        faults: counts solids and faces that are changed or left out.
        origin: (3,) origin of W in the file's coordinates [m].
    """
    triangles_of: dict[str, list[np.ndarray]] = {}
    for geometry in geometries:
        faces = [
            face_triangles([ring - origin for ring in face], name, faults)
            for face in geometry.faces
        ]
        if geometry.is_solid and _enclosed_volume(faces) < _INSIDE_OUT_BELOW:
            faults.add("solid turned inside out, reversed", name)
            faces = [triangles[:, ::-1] for triangles in faces]
        for triangles, kind in zip(faces, geometry.kinds, strict=True):
            if kind == "ClosureSurface":
                faults.add("face that only closes a solid, left out", name)
                continue
            part = "roof" if kind == "RoofSurface" else "body"
            triangles_of.setdefault(part, []).append(triangles)
    return {
        part: np.concatenate(triangles_of[part])
        for part in sorted(triangles_of)
    }


def _enclosed_volume(faces: list[np.ndarray]) -> float:
    """Returns the volume that triangles (M, 3, 3) enclose [m^3]."""
    triangles = joined_triangles(faces)
    if len(triangles) == 0:
        return 0.0
    a, b, c = np.moveaxis(triangles - triangles[0, 0], 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def _class_of(kind: str) -> tuple[str, Finish | None]:
    """Returns class and finish of a type, as in `_CLASSES`."""
    for beginning, class_and_finish in _CLASSES.items():
        if kind.startswith(beginning):
            return class_and_finish
    return "other-object", None
