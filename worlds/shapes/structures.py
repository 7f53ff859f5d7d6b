"""Structures: the named objects of which a city consists."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
import math

import numpy as np
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from evaluation.base import rotated
from worlds.shapes.materials import USUAL_MATERIALS
from worlds.shapes.models import Model, part_mesh, rotation, triple
from worlds.shapes.polygons import placed
from worlds.shapes.structure_table import (
    StructureEntry,
    kind_in_name,
    shortened,
)


@dataclass(frozen=True)
class Structure:
    """A named object of a city: a model, and its pose in the world W.

    The generator, imports and ageing make structures in this form, and write
    them to worlds. The method `entry` returns the structure's entry in the
    structure table.

    Attributes:
        name: unique and stable name, e.g. `tower_017`.
        semantic_class: a key of `worlds.shapes.semantics.CLASS_IDS`.
        model: the shape, in the structure's frame S.
        xyz: position of S in W [m].
        yaw: heading of S in W [rad].
        tags: words that describe the structure, such as the name of its
            district.
        kind: what the structure is, such as `row_house` or `bench`; by default
            the kind with which the name begins.
    """

    name: str
    semantic_class: str
    model: Model
    xyz: tuple[float, float, float]
    yaw: float = 0.0
    tags: tuple[str, ...] = field(default=())
    kind: str = ""

    def __post_init__(self) -> None:
        kind = self.kind or kind_in_name(self.name)
        object.__setattr__(self, "kind", kind)

    @property
    def materials(self) -> dict[str, str]:
        """Name of each part -> name of its material."""
        usual = USUAL_MATERIALS[self.semantic_class]
        return {part.name: part.material or usual for part in self.model.parts}

    def entry(
        self,
        instance: int = 0,
        other_parts: Mapping[str, str] | None = None,
    ) -> StructureEntry:
        """Returns the structure's entry in a structure table.

        Args:
            instance: instance id of the structure; 0 for none.
            other_parts: name -> name of the material, for parts that the
                structure has in other stages only.
        """
        return StructureEntry(
            instance,
            self.name,
            self.semantic_class,
            materials=shortened({**(other_parts or {}), **self.materials}),
            kind=self.kind,
            tags=self.tags,
        )

    def row(
        self, instance: int, other_parts: Mapping[str, str]
    ) -> dict[str, str]:
        """Returns the structure's row in `structures.csv`, by column.

        These are the cells of its entry, and those of its pose: `x`, `y` and
        `z` [m], and `yaw` [rad]. The arguments are those of `entry`.
        """
        x, y, z = (f"{value:.3f}" for value in self.xyz)
        pose = {"x": x, "y": y, "z": z, "yaw": f"{self.yaw:.5f}"}
        return self.entry(instance, other_parts).cells() | pose

    @property
    def footprint_W(self) -> BaseGeometry:
        """Ground area of the model, seen from above, in W [m]."""
        return placed(self.model.footprint, self.xyz[:2], self.yaw)

    def with_origin(self, xyz: tuple[float, float, float]) -> Structure:
        """Returns the same structure with the origin of S elsewhere in W.

        `xyz` is the new origin [m]. Only poses in S and the pose of S change:
        the structure stays where it is.
        """
        p_WW = np.subtract(xyz, self.xyz)
        p_SS = rotated(rotation((0.0, 0.0, -self.yaw)), p_WW)
        parts = tuple(
            replace(part, xyz=triple(np.subtract(part.xyz, p_SS).round(4)))
            for part in self.model.parts
        )
        footprint = translate(self.model.footprint, *(-p_SS[:2]))
        model = replace(self.model, parts=parts, footprint=footprint)
        return replace(self, model=model, xyz=xyz)

    @property
    def p_WFs(self) -> np.ndarray:
        """Lowest points (N, 3) of the model, its feet, in W [m].

        The feet are all vertices at most 0.05 m above the lowest vertex.
        """
        model = self.model
        meshes = [part_mesh(part, model.meshes) for part in model.parts]
        p_SPs = np.concatenate([mesh.vertices for mesh in meshes])
        is_low = p_SPs[:, 2] < p_SPs[:, 2].min() + _FEET
        R_WS = rotation((0.0, 0.0, self.yaw))
        return rotated(R_WS, p_SPs[is_low]) + self.xyz

    def p_WP(
        self, p_SP: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        """Converts the position of a point P from S to W [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y, z = p_SP
        return (
            self.xyz[0] + c * x - s * y,
            self.xyz[1] + s * x + c * y,
            self.xyz[2] + z,
        )


# The points of a model up to this far above its lowest one are its feet [m].
_FEET = 0.05


def ground_triangles(structures: Iterable[Structure]) -> np.ndarray:
    """Returns the triangles (M, 3, 3) of structures, in W [m].

    The meshes of the structures must be given in W, as the meshes of the ground
    are.
    """
    meshes = [m for one in structures for m in one.model.meshes.values()]
    found = [mesh.vertices[mesh.triangles()] for mesh in meshes]
    return np.concatenate([np.zeros((0, 3, 3)), *found])
