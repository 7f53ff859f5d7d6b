"""Meshes of small objects, which are data: `city/object_meshes/<name>.obj`."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from cns_drake.city.geometry.mesh import Mesh

FOLDER = Path(__file__).parents[1] / "object_meshes"


@cache
def object_mesh(name: str) -> Mesh:
    """Returns the mesh of this name.

    Raises:
        FileNotFoundError: there is none.
    """
    vertices: list[list[float]] = []
    faces: list[tuple[int, ...]] = []
    text = (FOLDER / f"{name}.obj").read_text(encoding="utf-8")
    for line in text.splitlines():
        kind, *values = line.split()
        if kind == "v":
            vertices.append([float(value) for value in values])
        elif kind == "f":
            faces.append(tuple(int(value) - 1 for value in values))
    return Mesh(np.array(vertices), tuple(faces))
