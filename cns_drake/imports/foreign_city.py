"""A city of somebody else's, whatever file it was read from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.structures import Structure
from cns_drake.imports.import_faults import ImportFaults


# By identity: a city has thousands, with meshes that take long to compare.
@dataclass(frozen=True, eq=False)
class Imported:
    """A structure of an imported city.

    Attributes:
        structure: in the world.
        kind: type of its object, such as Building.
        year: in which it was built, if it is told.
        triangles: (M, 3, 3) of what a car could hit or drive over, in the
            world [m].
    """

    structure: Structure
    kind: str
    year: int | None
    triangles: np.ndarray

    @property
    def is_ground(self) -> bool:
        """Whether one can drive over it, if it is flat."""
        return self.structure.semantic_class in (
            "road",
            "parking",
            "other-ground",
            "terrain",
        )


@dataclass(frozen=True)
class ForeignCity:
    """What a file holds.

    Attributes:
        structures: in the world of the map.
        origin: where that lies in the file's coordinates, x, y, z [m], or
            latitude and longitude [deg].
        reference_system: of the origin, as the file names it.
        faults: what was repaired or left out.
    """

    structures: list[Imported]
    origin: tuple[float, ...]
    reference_system: str
    faults: ImportFaults


def triangle_mesh(triangles: np.ndarray) -> Mesh:
    """Returns triangles (M, 3, 3) as a mesh."""
    corners = np.arange(3 * len(triangles)).reshape(-1, 3)
    return Mesh(triangles.reshape(-1, 3), tuple(map(tuple, corners.tolist())))
