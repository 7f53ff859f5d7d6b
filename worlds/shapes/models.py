"""Models: the shapes, finishes, parts and meshes of a structure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
from typing import Any, NamedTuple

import numpy as np
from shapely.geometry.base import BaseGeometry

from evaluation.base import cos, rotated, sin
from worlds.shapes.materials import MATERIALS
from worlds.shapes.mesh import Mesh, box_mesh

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
            `worlds.shapes.materials.MATERIALS`; None for the usual material
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
            `worlds.shapes.materials.MATERIALS`; by default the usual
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


def roll_pitch_yaw(R: np.ndarray) -> tuple[float, float, float]:
    """Returns roll, pitch and yaw of a rotation matrix (3, 3), as in SDF [rad].

    This is the inverse of `rotation`. Roll and yaw are from -pi to pi, and the
    pitch is from -pi/2 to pi/2. The formulas are those of Drake's class
    `RollPitchYaw`, which are accurate near a pitch of +-pi/2, too.
    """
    squares = R[[2, 2, 1, 0], [2, 1, 0, 0]] ** 2
    size = math.sqrt(sum(squares.tolist()) / 2)
    w, x, y, z = _quaternion(R)
    sum_angle = _angle(x + z, w - y)
    difference = _angle(z - x, w + y)
    roll, yaw = sum_angle - difference, sum_angle + difference
    return _wrapped(roll), math.atan2(-R[2, 0], size), _wrapped(yaw)


def _angle(y: float, x: float) -> float:
    """Returns the direction of a vector [rad]; 0 for a vector of no length."""
    is_zero = max(abs(x), abs(y)) <= np.finfo(float).eps
    return 0.0 if is_zero else math.atan2(y, x)


def _wrapped(angle: float) -> float:
    """Returns an angle from -2 pi to 2 pi as one from -pi to pi [rad]."""
    if abs(angle) <= math.pi:
        return angle
    return angle - math.copysign(2 * math.pi, angle)


def _quaternion(R: np.ndarray) -> tuple[float, float, float, float]:
    """Returns the unit quaternion w, x, y, z, with w >= 0, of a rotation."""
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    # Sums are in the order in which Drake adds, for the same last bits: these
    # choose between -pi and pi.
    trace = a + (e + i)
    if trace >= max(a, e, i):
        q = (1 + trace, h - f, c - g, d - b)
    elif a >= max(e, i):
        q = (h - f, 1 - (trace - 2 * a), b + d, c + g)
    elif e >= i:
        q = (c - g, b + d, 1 - (trace - 2 * e), f + h)
    else:
        q = (d - b, c + g, f + h, 1 - (trace - 2 * i))
    w, x, y, z = q
    size = math.sqrt((x * x + z * z) + (y * y + w * w))
    scale = (-1.0 if w < 0.0 else 1.0) / size
    return scale * w, scale * x, scale * y, scale * z


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
