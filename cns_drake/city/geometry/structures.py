"""Structures: the named objects of which a city consists, and their parts."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import inspect
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from shapely.affinity import translate
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.mesh import Mesh, box_mesh
from cns_drake.city.geometry.object_meshes import object_mesh
from cns_drake.city.geometry.polygons import hull_of, placed
from cns_drake.scene.materials import MATERIALS, USUAL_MATERIALS
from cns_drake.scene.structure_names import kind_in_name


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
    def given(cls, value: Any) -> "Finish":
        """Reads a finish from a file: a colour, or a material with its colour.

        For example `[0.8, 0.7, 0.6]`, or `{brick: [0.5, 0.3, 0.2]}`.

        Raises:
            ValueError: the value is neither, or there is no such material.
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
        rgb: colour; by default that of the structure's semantic class.
        material: name of the material, a key of
            `cns_drake.scene.materials.MATERIALS`; by default the usual one of
            the structure's semantic class.
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
        """Number of triangles of all parts; 12 for a part without a mesh."""
        return sum(
            self.meshes[part.shape.mesh].num_triangles
            if isinstance(part.shape, MeshShape)
            else 12
            for part in self.parts
        )


@dataclass(frozen=True)
class Structure:
    """A named object of a city: a model, and its pose in the world W.

    Attributes:
        name: unique and stable name, e.g. `tower_017`.
        semantic_class: a key of `cns_drake.scene.semantics.CLASS_IDS`.
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
    def kind_cell(self) -> str:
        """The cell `kind` in a structure table; "" if the name states it."""
        return "" if self.kind == kind_in_name(self.name) else self.kind

    @property
    def materials(self) -> dict[str, str]:
        """Name of each part -> name of its material."""
        usual = USUAL_MATERIALS[self.semantic_class]
        return {part.name: part.material or usual for part in self.model.parts}

    @property
    def footprint_W(self) -> BaseGeometry:
        """Ground area of the model, seen from above, in W [m]."""
        return placed(self.model.footprint, self.xyz[:2], self.yaw)

    def with_origin(self, xyz: tuple[float, float, float]) -> "Structure":
        """Returns the same structure with the origin of S elsewhere in W.

        `xyz` is the new origin [m]. Only poses in S and the pose of S change:
        the structure stays where it is.
        """
        p_WW = np.subtract(xyz, self.xyz)
        p_SS = rotation((0.0, 0.0, -self.yaw)) @ p_WW
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

        They are all vertices at most 0.05 m above the lowest one.
        """
        model = self.model
        meshes = [part_mesh(part, model.meshes) for part in model.parts]
        p_SPs = np.concatenate([mesh.vertices for mesh in meshes])
        is_low = p_SPs[:, 2] < p_SPs[:, 2].min() + _FEET
        return p_SPs[is_low] @ rotation((0.0, 0.0, self.yaw)).T + self.xyz

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


# Posts and trunks reach this far into the ground, so that no gap shows where
# the ground falls a little [m].
ROOT_DEPTH = 0.3
# Only parts below this height take ground. Crowns, signs and mast arms above it
# leave the ground free [m].
HEADROOM = 2.4
# The points of a model up to this far above its lowest one are its feet [m].
_FEET = 0.05
_FOOTPRINT_MARGIN = 0.02
_ROUND_SIDES = 12


@dataclass(frozen=True)
class Builder:
    """A kind of object, and the function that makes objects of this kind.

    `make(rng, **parameters)` returns a `Model`. Every parameter has a default;
    most defaults are sampled from `rng`. The same state of `rng` gives the same
    model. `semantic_class` is a key of `cns_drake.scene.semantics.CLASS_IDS`.
    """

    semantic_class: str
    make: Callable[..., Model]

    def build(self, rng: np.random.Generator, **parameters: Any) -> Model:
        """Returns an object; parameters that are not given come from `rng`.

        Raises:
            TypeError: there is no such parameter, or its type is wrong.
            ValueError: there is no object with such a parameter.
        """
        known = inspect.signature(self.make).parameters
        for name in parameters:
            if name not in known:
                raise TypeError(f"there is no parameter {name}")
        return self.make(rng, **parameters)


def post(
    name: str,
    radius: float,
    height: float,
    xy: tuple[float, float] = (0.0, 0.0),
    rgb: tuple[float, float, float] | None = None,
) -> Part:
    """Returns an upright cylinder that stands on the ground.

    It begins slightly below the ground.

    Args:
        name: name of the part.
        radius: radius of the cylinder [m].
        height: height of its top above the ground [m].
        xy: position of its axis in the structure's frame [m].
        rgb: colour; by default that of the structure's semantic class.
    """
    return Part(
        name,
        CylinderShape(radius, height + ROOT_DEPTH),
        xyz=(xy[0], xy[1], (height - ROOT_DEPTH) / 2),
        rgb=rgb,
    )


def bar(
    name: str,
    start: ArrayLike,
    end: ArrayLike,
    radius: float,
    rgb: tuple[float, float, float] | None = None,
) -> Part:
    """Returns a cylinder between two points, as a part of a structure.

    Args:
        name: name of the part.
        start: (3,) centre of one end in the structure's frame [m].
        end: (3,) centre of the other end in the structure's frame [m].
        radius: radius of the cylinder [m].
        rgb: colour; by default that of the structure's semantic class.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    along = end - start
    length = float(np.linalg.norm(along))
    pitch = float(np.arccos(np.clip(along[2] / length, -1, 1)))
    yaw = float(np.arctan2(along[1], along[0]))
    return Part(
        name,
        CylinderShape(radius, length),
        xyz=triple((start + end) / 2),
        rpy=(0.0, pitch, yaw),
        rgb=rgb,
    )


def block(
    name: str,
    size: Iterable[float],
    center: Iterable[float],
    yaw: float = 0.0,
    rgb: tuple[float, float, float] | None = None,
    material: str | None = None,
) -> Part:
    """Returns a box as a part of a structure.

    Args:
        name: name of the part.
        size: lengths along the box's own x, y and z [m].
        center: (3,) centre of the box in the structure's frame [m].
        yaw: heading of the box in the structure's frame [rad].
        rgb: colour; by default that of the structure's semantic class.
        material: name of the material; by default the usual one of the
            structure's semantic class.
    """
    return Part(
        name,
        BoxShape(triple(size)),
        xyz=triple(center),
        rpy=(0.0, 0.0, float(yaw)),
        rgb=rgb,
        material=material,
    )


def pillar(
    name: str,
    x: float,
    y: float,
    height: float,
    xy: tuple[float, float] = (0.0, 0.0),
    yaw: float = 0.0,
    rgb: tuple[float, float, float] | None = None,
) -> Part:
    """Returns an upright box that stands on the ground.

    It begins slightly below the ground.

    Args:
        name: name of the part.
        x: length along the box's own x [m].
        y: length along the box's own y [m].
        height: height of its top above the ground [m].
        xy: position of its middle in the structure's frame [m].
        yaw: heading of the box in the structure's frame [rad].
        rgb: colour; by default that of the structure's semantic class.
    """
    center = (*xy, (height - ROOT_DEPTH) / 2)
    return block(name, (x, y, height + ROOT_DEPTH), center, yaw, rgb)


def mesh_part(
    name: str,
    mesh: str,
    at: Iterable[float] = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
    rgb: tuple[float, float, float] | None = None,
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
    material: str | None = None,
) -> Part:
    """Returns an upright mesh of the folder `object_meshes` as a part.

    Args:
        name: name of the part.
        mesh: name of its file without `.obj`.
        at: (3,) position of the mesh's origin in the structure's frame [m].
        yaw: heading of the mesh in the structure's frame [rad].
        rgb: colour; by default that of the structure's semantic class.
        scale: factors along the mesh's own x, y and z.
        material: name of the material; by default the usual one of the
            structure's semantic class.
    """
    rpy = (0.0, 0.0, float(yaw))
    return Part(name, MeshShape(mesh, scale), triple(at), rpy, rgb, material)


def in_a_row(k: int, distance: float, count: int) -> float:
    """Returns the place of one of `count` things in a row centred on 0 [m].

    Args:
        k: number of the thing, from 0.
        distance: distance from one thing to the next [m].
        count: number of things in the row.
    """
    return distance * (k - (count - 1) / 2)


def triple(values: Iterable[float]) -> tuple[float, float, float]:
    """Converts three values, such as those of an array, to a float tuple."""
    x, y, z = values
    return float(x), float(y), float(z)


def assemble(*parts: Part) -> Model:
    """Returns a model of the given parts.

    The meshes of the parts are read from the folder `object_meshes`. The
    footprint is the convex hull of everything below 2.4 m (`HEADROOM`), so that
    crowns and signs above this height leave the ground free.
    """
    shapes = [part.shape for part in parts]
    names = [shape.mesh for shape in shapes if isinstance(shape, MeshShape)]
    meshes = {name: object_mesh(name) for name in names}
    return Model(parts, meshes, ground_footprint(parts, meshes))


def ground_footprint(
    parts: Sequence[Part], meshes: Mapping[str, Mesh]
) -> Polygon:
    """Returns the convex hull of all parts below `HEADROOM`, seen from above.

    The hull is a polygon in the structure's frame S [m], slightly enlarged.
    `HEADROOM` is 2.4 m.
    """
    corners: list[np.ndarray] = [np.zeros((0, 2))]
    for part in parts:
        mesh = part_mesh(part, meshes)
        p = mesh.vertices
        is_low = p[:, 2] <= HEADROOM
        corners.append(p[is_low, :2])
        if is_low.all():
            continue
        triangles = mesh.triangles()
        for i, j in ((0, 1), (1, 2), (2, 0)):
            a, b = p[triangles[:, i]], p[triangles[:, j]]
            cut = (a[:, 2] - HEADROOM) * (b[:, 2] - HEADROOM) < 0
            a, b = a[cut], b[cut]
            t = (HEADROOM - a[:, 2]) / (b[:, 2] - a[:, 2])
            corners.append(a[:, :2] + t[:, None] * (b - a)[:, :2])
    # Rounded to millimetres, because the last bits of a sine differ between
    # machines.
    hull = hull_of(np.round(np.concatenate(corners), 3))
    return hull.buffer(_FOOTPRINT_MARGIN, join_style="mitre")


def ground_triangles(structures: Iterable[Structure]) -> np.ndarray:
    """Returns the triangles (M, 3, 3) of structures, in W [m].

    The meshes of the structures must be given in W, as the meshes of the ground
    are.
    """
    meshes = [m for one in structures for m in one.model.meshes.values()]
    found = [mesh.vertices[mesh.triangles()] for mesh in meshes]
    return np.concatenate([np.zeros((0, 3, 3)), *found])


def part_triangles(
    part: Part, meshes: Mapping[str, Mesh]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the vertices (N, 3) [m] and the triangles (M, 3) of a part.

    The vertices are in the structure's frame S; triangles contain indices of
    vertices. Cylinders and spheres become slightly larger prisms.
    """
    mesh = part_mesh(part, meshes)
    return mesh.vertices, mesh.triangles()


def part_mesh(part: Part, meshes: Mapping[str, Mesh]) -> Mesh:
    """Returns the mesh of a part, in the structure's frame S [m].

    Cylinders and spheres become slightly larger prisms. `meshes` maps names to
    meshes. If the part refers to a mesh, `meshes` contains this mesh.
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
    vertices = mesh.vertices * scale @ rotation(part.rpy).T + part.xyz
    return mesh.with_vertices(vertices)


def rotation(rpy: tuple[float, float, float]) -> np.ndarray:
    """Returns the rotation matrix Rz(yaw) Ry(pitch) Rx(roll), as in SDF.

    `rpy` contains roll, pitch and yaw [rad].
    """
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _round_mesh(radius: float, length: float) -> Mesh:
    """Returns a prism that just contains an upright cylinder."""
    angle = 2 * np.pi * np.arange(_ROUND_SIDES) / _ROUND_SIDES
    ring = radius / np.cos(np.pi / _ROUND_SIDES)
    x, y = ring * np.cos(angle), ring * np.sin(angle)
    low = np.column_stack([x, y, np.full(_ROUND_SIDES, -length / 2)])
    n = _ROUND_SIDES
    sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    high = low + np.array([0.0, 0.0, length])
    return Mesh(np.concatenate([low, high]), tuple(sides))
