"""The objects of an imported city, and the structures made from them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
import re

import numpy as np
from shapely.geometry.base import BaseGeometry

from worlds.shapes import (
    GROUND_CLASSES,
    Finish,
    Mesh,
    MeshShape,
    Model,
    Part,
    Structure,
    hull_of,
)

# Greatest distance of a structure from the middle of a city along x, y and z
# [m]. Some files have -9999 in place of an unknown height.
FARTHEST = np.array([10_000.0, 10_000.0, 3_000.0])
# Classes of the ground on which cars may drive.
_GROUND_OF_CARS = GROUND_CLASSES - {"sidewalk"}


class Base(Enum):
    """Where an object stands, as the reader of its file knows.

    Only objects on the ground say how high the ground is, and only on their
    surfaces do cars drive and park.
    """

    GROUND = "on the ground"
    RAISED = "above the ground, with room below"
    DECK = "a bridge"
    UNDERGROUND = "below the ground"


# Compared by identity, because there are thousands and comparing meshes takes
# long.
@dataclass(frozen=True, eq=False)
class ImportedObject:
    """An object of an imported city, with the structure made from it.

    The object comes from the city's file, or is a detail that was added to the
    city. The structure is what is written to the map.

    Attributes:
        structure: the structure.
        object_type: type of the object, in the words of its file, such as
            Building or WaterBody. The structure's kind may be more specific.
        year: year in which the object was built; None if unknown.
        triangles: (M, 3, 3) all surfaces that a car could hit or drive over, in
            W [m].
        base: where the object stands.
        until: year in which the object was demolished; None if unknown.
        tags: tags of the object in its file.
        lod: level of detail; 0 if unknown.
        original: name of the structure of which this structure is a variant; ""
            if this structure is not a variant.
        is_gone: whether the object was demolished at an unknown date.
    """

    structure: Structure
    object_type: str
    year: int | None
    triangles: np.ndarray
    base: Base = Base.GROUND
    until: int | None = None
    tags: Mapping[str, str] = field(default_factory=dict)
    lod: float = 0.0
    original: str = ""
    is_gone: bool = False

    @property
    def draw_name(self) -> str:
        """Name on which the random numbers for the object depend.

        A variant of a structure has the draw name of the original.
        """
        return self.original or self.structure.name

    @property
    def is_building(self) -> bool:
        """Whether the object is a building or a part of one."""
        return self.object_type.startswith("Building")

    @property
    def num_own_triangles(self) -> int:
        """Number of triangles that only this object has.

        A building has its own meshes, and their triangles are counted, with all
        details. Any other object may share its meshes, as trees do.
        Therefore, the triangles in its attribute `triangles` are counted.
        """
        if self.is_building:
            return self.structure.model.num_triangles
        return len(self.triangles)

    @property
    def is_ground(self) -> bool:
        """Whether the object is ground for cars, such as a road on the ground.

        The structure may still be too steep to drive on.
        """
        return (
            self.base is Base.GROUND
            and self.structure.semantic_class in _GROUND_OF_CARS
        )

    @property
    def is_paving(self) -> bool:
        """Whether the object is ground for cars or people."""
        return self.is_ground or (
            self.base is Base.GROUND and self.object_type == "Sidewalk"
        )

    @property
    def foot(self) -> np.ndarray:
        """The lowest corner (3,) of the surfaces in W [m]."""
        corners = self.triangles.reshape(-1, 3)
        return np.asarray(corners[corners[:, 2].argmin()])


def make_object(
    name: str,
    semantic_class: str,
    object_type: str,
    surfaces: Mapping[str, np.ndarray],
    finishes: Mapping[str, Finish | None],
    year: int | None = None,
    until: int | None = None,
    tags: Mapping[str, str] | None = None,
    lod: float = 0.0,
    kind: str = "",
    base: Base = Base.GROUND,
    footprint: BaseGeometry | None = None,
) -> ImportedObject:
    """Returns an object whose structure is made of triangles in the world.

    Args:
        name: name of the structure, unique in the city.
        semantic_class: a key of `worlds.shapes.semantics.CLASS_IDS`.
        object_type: type of the object.
        surfaces: part of the surface -> triangles (M, 3, 3) [m]. Empty parts
            are left out; at least one part must not be empty.
        finishes: part of the surface -> its colour and material. Parts without
            an entry have the colour and material of the class.
        year: year in which the object was built; None if unknown.
        until: year in which the object was demolished; None if unknown.
        tags: tags of the object in its file.
        lod: level of detail of the object; 0 if unknown.
        kind: what the structure is, such as `church` for a Building; by default
            the object's type.
        base: where the object stands.
        footprint: area of the structure in W [m]; by default the convex hull.
    """
    filled = {part: some for part, some in surfaces.items() if len(some)}
    triangles = np.concatenate(list(filled.values()))
    parts = []
    for part in filled:
        rgb, material = finishes.get(part) or (None, None)
        shape = MeshShape(f"{name}_{part}")
        parts.append(Part(part, shape, rgb=rgb, material=material))
    model = Model(
        tuple(parts),
        {f"{name}_{part}": to_mesh(some) for part, some in filled.items()},
        hull_of(triangles.reshape(-1, 3)[:, :2])
        if footprint is None
        else footprint,
    )
    structure = Structure(
        name,
        semantic_class,
        model,
        (0.0, 0.0, 0.0),
        kind=kind_word(kind or object_type),
    )
    return ImportedObject(
        structure, object_type, year, triangles, base, until, tags or {}, lod
    )


def kind_word(text: str) -> str:
    """Returns a type in a file as a kind, such as `water_body` for WaterBody.

    The kind consists of lower-case letters, digits and underscores.
    """
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", text).lower()
    return re.sub(r"[^a-z0-9]+", "_", words).strip("_")


def boxes_of(objects: Sequence[ImportedObject]) -> np.ndarray:
    """Returns the bounding boxes (N, 2, 3) of objects in W [m].

    Each box is given by its least and its greatest coordinates.
    """
    return np.array(
        [
            (one.triangles.min(axis=(0, 1)), one.triangles.max(axis=(0, 1)))
            for one in objects
        ]
    )


def to_mesh(triangles: np.ndarray) -> Mesh:
    """Converts triangles (M, 3, 3) [m] to a mesh."""
    corners = np.arange(3 * len(triangles)).reshape(-1, 3)
    return Mesh(triangles.reshape(-1, 3), tuple(map(tuple, corners.tolist())))
