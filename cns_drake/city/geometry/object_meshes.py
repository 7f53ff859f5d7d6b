"""Meshes of small objects, which are data: `city/object_meshes/<name>.obj`."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from cns_drake.city.geometry.mesh import Mesh

FOLDER = Path(__file__).parents[1] / "object_meshes"


def object_mesh(name: str) -> Mesh:
    """Returns the mesh of this name.

    Raises:
        FileNotFoundError: there is none.
    """
    return read_mesh(FOLDER / f"{name}.obj")


@cache
def read_mesh(path: Path) -> Mesh:
    """Returns the mesh of an OBJ file of the city generator's own.

    Raises:
        FileNotFoundError: there is none.
    """
    vertices: list[list[float]] = []
    faces: list[tuple[int, ...]] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        kind, *values = line.split()
        if kind == "v":
            vertices.append([float(value) for value in values])
        elif kind == "f":
            faces.append(tuple(int(value) - 1 for value in values))
    return Mesh(np.array(vertices), tuple(faces))
