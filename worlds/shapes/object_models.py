"""Models of small objects, put together from simple parts."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
import inspect
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry import Polygon

from worlds.shapes.mesh import Mesh, read_mesh
from worlds.shapes.models import (
    BoxShape,
    CylinderShape,
    MeshShape,
    Model,
    Part,
    part_mesh,
    triple,
)
from worlds.shapes.polygons import hull_of

# Posts and trunks reach this far into the ground, so that no gap shows where
# the ground falls a little [m].
ROOT_DEPTH = 0.3
# Only parts below this height take ground. Crowns, signs and mast arms above it
# leave the ground free [m].
HEADROOM = 2.4
# The footprint of an object is enlarged by this distance [m].
_FOOTPRINT_MARGIN = 0.02


@dataclass(frozen=True)
class Builder:
    """A kind of object, and the function that makes objects of this kind.

    `make(rng, **parameters)` returns a `Model`. Every parameter has a default;
    most defaults are sampled from `rng`. The same state of `rng` gives the same
    model. `semantic_class` is a key of `worlds.shapes.semantics.CLASS_IDS`.
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
        rgb: colour; by default the colour of the structure's semantic class.
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
        name, radius, rgb: see `post`.
        start: (3,) centre of one end in the structure's frame [m].
        end: (3,) centre of the other end in the structure's frame [m].
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    along = end - start
    length = float(np.linalg.norm(along, axis=0))
    pitch = math.acos(np.clip(along[2] / length, -1, 1))
    yaw = math.atan2(along[1], along[0])
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
        rgb: colour; by default the colour of the structure's semantic class.
        material: name of the material; by default the usual material of the
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
        name, height, rgb: see `post`.
        x: length along the box's own x [m].
        y: length along the box's own y [m].
        xy: position of its middle in the structure's frame [m].
        yaw: heading of the box in the structure's frame [rad].
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
        name, rgb, material: see `block`.
        mesh: name of its file without `.obj`.
        at: (3,) position of the mesh's origin in the structure's frame [m].
        yaw: heading of the mesh in the structure's frame [rad].
        scale: factors along the mesh's own x, y and z.
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


OBJECT_MESHES = Path(__file__).with_name("object_meshes")


def object_mesh(name: str) -> Mesh:
    """Returns a mesh of the folder `object_meshes`, by its name.

    Raises:
        FileNotFoundError: there is no such mesh.
    """
    return read_mesh(OBJECT_MESHES / f"{name}.obj")
