"""Structures: the named things a city is made of and a stage may lack."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.polygons import placed


@dataclass(frozen=True)
class MeshShape:
    """A reference to a mesh by its name, scaled about the mesh origin."""

    mesh: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class BoxShape:
    """A box centred on the part frame; `size` along x, y, z [m]."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class CylinderShape:
    """A cylinder centred on the part frame, its axis along z [m]."""

    radius: float
    length: float


@dataclass(frozen=True)
class SphereShape:
    """A sphere centred on the part frame [m]."""

    radius: float


Shape = MeshShape | BoxShape | CylinderShape | SphereShape


@dataclass(frozen=True)
class Part:
    """One visual of a structure.

    Attributes:
        name: unique within the structure, e.g. `storey_03`.
        shape: what it looks like.
        xyz: position in the structure frame S [m].
        rpy: roll, pitch, yaw in S [rad].
        rgb: diffuse colour, or None for the colour of the class.
    """

    name: str
    shape: Shape
    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rgb: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Model:
    """The result of a builder: parts, the meshes they use, a footprint.

    Attributes:
        parts: the visuals, in the structure frame S.
        meshes: mesh name -> mesh, for every mesh that a part refers to.
        footprint: the ground area that the model needs, in S [m].
    """

    parts: tuple[Part, ...]
    meshes: dict[str, Mesh]
    footprint: BaseGeometry


@dataclass(frozen=True)
class Structure:
    """A model with a name and a place in the world.

    Attributes:
        name: stable and unique in the city, e.g. `tower_017`.
        semantic_class: a key of `cns_drake.scene.semantics.CLASS_IDS`.
        model: its geometry, in the structure frame S.
        xyz: position of S in the world [m].
        yaw: heading of S in the world [rad].
        tags: free words for the layout and the stages, e.g. the block.
    """

    name: str
    semantic_class: str
    model: Model
    xyz: tuple[float, float, float]
    yaw: float = 0.0
    tags: tuple[str, ...] = field(default=())

    @property
    def footprint_W(self) -> BaseGeometry:
        """The ground area of the model, in the world [m]."""
        return placed(self.model.footprint, self.xyz[:2], self.yaw)

    def p_WP(
        self, p_SP: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        """Returns the position in the world of a point P given in S [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y, z = p_SP
        return (
            self.xyz[0] + c * x - s * y,
            self.xyz[1] + s * x + c * y,
            self.xyz[2] + z,
        )
