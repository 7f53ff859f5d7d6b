"""Objects that fill areas on the ground, and how they look."""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from worlds.imports import faces
from worlds.imports.colours import Rgb
from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import Base, ImportedObject, make_object
from worlds.imports.solids import extruded
from worlds.shapes import Finish


class AreaLook(NamedTuple):
    """How an area on the ground is built and looks.

    Attributes:
        object_type: type of the area, such as Sidewalk.
        semantic_class: a key of `worlds.shapes.semantics.CLASS_IDS`.
        rgb: colour; None for the colour of the class.
        z: height of the upper side [m].
        kind: what the area is, if its tags say more than the type, such as
            `park`.
    """

    object_type: str
    semantic_class: str
    rgb: Rgb | None
    z: float
    kind: str = ""


def flat_object(
    name: str, look: AreaLook, areas: Iterable[Polygon], faults: ImportFaults
) -> Iterator[ImportedObject]:
    """Yields one level surface that fills areas; nothing for empty areas.

    Args:
        name: name of the surface: a word, an underscore, and the id of the
            element in the file.
        look: type, class, colour and height of the surface.
        areas: the areas in W [m].
        faults: counts parts that were repaired or left out.
    """
    source = name.partition("_")[2]
    surface = [
        faces.flat_surface(polygon, look.z, source, faults)
        for area in areas
        for polygon in faces.valid_parts(area, source, faults)
    ]
    if surface:
        yield _object_with_look(name, look, "surface", surface, Base.GROUND)


def raised_object(
    name: str,
    look: AreaLook,
    areas: Iterable[BaseGeometry],
    source: tuple[str, ImportFaults],
    low: float = 0.0,
    base: Base = Base.GROUND,
) -> Iterator[ImportedObject]:
    """Yields one solid that fills areas, if there are any.

    Args:
        name: name of the solid.
        look: type, class, colour and height of the solid.
        areas: the areas in W [m].
        source: pair of the element's id in the file, for messages, and the
            fault counter that counts invalid areas.
        low: height of the solid's lower side [m].
        base: where the solid stands.
    """
    solids = [
        np.concatenate(
            extruded(
                polygon,
                low,
                look.z,
                *source,
                is_raised=base is not Base.GROUND,
            )
        )
        for area in areas
        for part in faces.parts_of(area)
        for polygon in faces.valid_parts(part, *source)
    ]
    if solids:
        yield _object_with_look(name, look, "body", solids, base)


def _object_with_look(
    name: str,
    look: AreaLook,
    part: str,
    triangles: Sequence[np.ndarray],
    base: Base,
) -> ImportedObject:
    surfaces = {part: np.concatenate(triangles)}
    material = "water" if look.object_type == "WaterBody" else None
    finish = look.rgb and Finish(look.rgb, material)
    return make_object(
        name,
        look.semantic_class,
        look.object_type,
        surfaces,
        {part: finish},
        kind=look.kind,
        base=base,
    )
