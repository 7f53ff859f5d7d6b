"""Makes shapes for Drake from triangles and models, and by scaling shapes."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike
from pydrake import geometry
from pydrake.common import MemoryFile

from cns_drake.city.geometry import (
    OBJECT_MESHES,
    BoxShape,
    CylinderShape,
    Mesh,
    Shape,
    SphereShape,
)


def memory_mesh(
    vertices: np.ndarray,
    triangles: np.ndarray,
    scale: ArrayLike = (1.0, 1.0, 1.0),
) -> geometry.Mesh:
    """Returns a mesh in memory; equal meshes give the same text.

    Readers thus recognise equal meshes as the same mesh. The mesh has vertices
    (N, 3), given before scaling [m], and triangles (M, 3).
    """
    used, corners = np.unique(triangles, return_inverse=True)
    # Python's numbers are formatted several times faster than NumPy's.
    lines = [
        f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in vertices[used].tolist()
    ]
    lines += [
        f"f {a} {b} {c}" for a, b, c in (corners.reshape(-1, 3) + 1).tolist()
    ]
    text = "\n".join(lines) + "\n"
    file = MemoryFile(text.encode(), ".obj", "mesh")
    return geometry.Mesh(geometry.InMemoryMesh(mesh_file=file), scale)


def model_shape(shape: Shape, meshes: Mapping[str, Mesh]) -> geometry.Shape:
    """Returns a Drake shape that equals a shape of the city generator.

    `meshes` maps names to the meshes of the model to which the shape belongs.
    """
    if isinstance(shape, BoxShape):
        return geometry.Box(*shape.size)
    if isinstance(shape, CylinderShape):
        return geometry.Cylinder(shape.radius, shape.length)
    if isinstance(shape, SphereShape):
        return geometry.Sphere(shape.radius)
    shared = OBJECT_MESHES / f"{shape.mesh}.obj"
    if shared.is_file():
        return geometry.Mesh(str(shared), shape.scale)
    mesh = meshes[shape.mesh]
    return memory_mesh(mesh.vertices, mesh.triangles(), shape.scale)


def scaled_shape(shape: geometry.Shape, share: float) -> geometry.Shape:
    """Returns a shape scaled about its origin by the factor `share`.

    A half space is returned as it is.
    """
    if isinstance(shape, geometry.Mesh | geometry.Convex):
        scale = share * np.array(shape.scale3())
        return type(shape)(shape.source(), scale)
    if isinstance(shape, geometry.Box):
        return geometry.Box(*(share * np.array(shape.size())))
    if isinstance(shape, geometry.Sphere):
        return geometry.Sphere(share * shape.radius())
    if isinstance(shape, geometry.Ellipsoid):
        axes = (shape.a(), shape.b(), shape.c())
        return geometry.Ellipsoid(*(share * length for length in axes))
    if isinstance(shape, geometry.Cylinder | geometry.Capsule):
        return type(shape)(share * shape.radius(), share * shape.length())
    if isinstance(shape, geometry.MeshcatCone):
        sizes = (shape.height(), shape.a(), shape.b())
        return geometry.MeshcatCone(*(share * length for length in sizes))
    return shape
