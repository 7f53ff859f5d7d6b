"""Meshes of small objects and plants, in the folder `object_meshes`."""

from pathlib import Path

from cns_drake.city.geometry.mesh import Mesh, read_mesh

OBJECT_MESHES = Path(__file__).parents[1] / "object_meshes"


def object_mesh(name: str) -> Mesh:
    """Returns a mesh of the folder `object_meshes`, by its name.

    Raises:
        FileNotFoundError: there is no such mesh.
    """
    return read_mesh(OBJECT_MESHES / f"{name}.obj")
