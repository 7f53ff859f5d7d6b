"""Models: the shapes, finishes, parts and meshes of a structure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
from typing import Any, NamedTuple

import numpy as np
from shapely.geometry.base import BaseGeometry

from cns_drake.base import cos, rotated, sin
from cns_drake.city.geometry.mesh import Mesh, box_mesh
from cns_drake.scene import MATERIALS

# Number of sides of the prisms that stand for round shapes.
_ROUND_SIDES = 12


@dataclass(frozen=True)
class MeshShape:
    """A mesh, scaled about its origin by factors along x, y and z.

    `mesh` is the name of the mesh in `Model.meshes`.
    """

    mesh: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class BoxShape:
    """A box centred on the origin of its part; `size` is along x, y, z [m]."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class CylinderShape:
    """A cylinder centred on the origin of its part, its axis along z [m]."""

    radius: float
    length: float


@dataclass(frozen=True)
class SphereShape:
    """A sphere centred on the origin of its part [m]."""

    radius: float


Shape = MeshShape | BoxShape | CylinderShape | SphereShape


class Finish(NamedTuple):
    """The finish of a surface: its colour and its material.

    Attributes:
        rgb: colour; None for the colour of the structure's semantic class.
        material: name of the material, a key of
            `cns_drake.scene.materials.MATERIALS`; None for the usual material
            of the structure's semantic class.
    """

    rgb: tuple[float, float, float] | None
    material: str | None = None

    @classmethod
    def given(cls, value: Any) -> Finish:
        """Reads a finish from a file: a colour, or a material with its colour.

        For example `[0.8, 0.7, 0.6]`, or `{brick: [0.5, 0.3, 0.2]}`.

        Raises:
            ValueError: the value is neither a colour nor a material with a
                colour, or there is no such material.
        """
        rgb, material = value, None
        if isinstance(value, dict) and len(value) == 1:
            ((material, rgb),) = value.items()
            if material not in MATERIALS:
                raise ValueError(f"{material!r} is no material")
        if not isinstance(rgb, list) or len(rgb) != 3:
            raise ValueError(f"{value!r} is neither a colour nor a finish")
        return cls(triple(rgb), material)


@dataclass(frozen=True)
class Part:
    """One visual of a structure: a shape at a pose in the structure's frame S.

    Attributes:
        name: name of the part, unique within the structure, e.g. `storey_03`.
        shape: the shape.
        xyz: position of the shape's origin in S [m].
        rpy: roll, pitch and yaw of the shape in S, as in SDF [rad].
        rgb: colour; by default the colour of the structure's semantic class.
        material: name of the material, a key of
            `cns_drake.scene.materials.MATERIALS`; by default the usual
            material of the structure's semantic class.
    """

    name: str
    shape: Shape
    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rgb: tuple[float, float, float] | None = None
    material: str | None = None


@dataclass(frozen=True)
class Model:
    """The shape of a structure, in the structure's frame S.

    Attributes:
        parts: the parts.
        meshes: name -> mesh of all meshes that the parts use.
        footprint: ground area that the model needs [m].
    """

    parts: tuple[Part, ...]
    meshes: dict[str, Mesh]
    footprint: BaseGeometry

    @property
    def num_triangles(self) -> int:
        """Number of triangles of all parts.

        A part without a mesh counts as a box of 12 triangles: programs that
        draw a cylinder or a sphere choose its triangles themselves.
        """
        return sum(
            self.meshes[part.shape.mesh].num_triangles
            if isinstance(part.shape, MeshShape)
            else 12
            for part in self.parts
        )


def triple(values: Iterable[float]) -> tuple[float, float, float]:
    """Converts three values, such as an array of three, to a float tuple."""
    x, y, z = values
    return float(x), float(y), float(z)


def part_mesh(part: Part, meshes: Mapping[str, Mesh]) -> Mesh:
    """Returns the mesh of a part, in the structure's frame S [m].

    Cylinders and spheres become slightly larger prisms, which have sides but no
    ends. `meshes` maps names to meshes. If the part refers to a mesh, `meshes`
    contains this mesh.
    """
    shape = part.shape
    scale = np.ones(3)
    if isinstance(shape, MeshShape):
        mesh = meshes[shape.mesh]
        scale = np.asarray(shape.scale)
    elif isinstance(shape, BoxShape):
        mesh = box_mesh(shape.size)
    elif isinstance(shape, CylinderShape):
        mesh = _round_mesh(shape.radius, shape.length)
    else:
        mesh = _round_mesh(shape.radius, 2 * shape.radius)
    vertices = rotated(rotation(part.rpy), mesh.vertices * scale) + part.xyz
    return mesh.with_vertices(vertices)


def rotation(rpy: tuple[float, float, float]) -> np.ndarray:
    """Returns the rotation matrix Rz(yaw) Ry(pitch) Rx(roll), as in SDF.

    `rpy` contains roll, pitch and yaw [rad].
    """
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _round_mesh(radius: float, length: float) -> Mesh:
    """Returns the sides of a prism that just contains an upright cylinder."""
    angle = 2 * np.pi * np.arange(_ROUND_SIDES) / _ROUND_SIDES
    ring = radius / math.cos(np.pi / _ROUND_SIDES)
    x, y = ring * cos(angle), ring * sin(angle)
    low = np.column_stack([x, y, np.full(_ROUND_SIDES, -length / 2)])
    n = _ROUND_SIDES
    sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    high = low + np.array([0.0, 0.0, length])
    return Mesh(np.concatenate([low, high]), tuple(sides))
