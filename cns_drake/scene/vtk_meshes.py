"""Boundaries of the tetrahedral meshes that Drake reads from VTK files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydrake.geometry import MeshSource, RefineVolumeMeshIntoVtkFileContents

# The faces of a tetrahedron, counter-clockwise seen from outside, if the first
# three vertices are counter-clockwise seen from the fourth.
_FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def read_vtk(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Reads the boundary of a volume mesh.

    Returns:
        (N, 3) float64 vertices [m], also those inside; (M, 3) int32
        triangles.

    Raises:
        RuntimeError: Drake cannot read the file.
    """
    # Drake's reader converts all dialects of VTK to the one that it writes.
    text = RefineVolumeMeshIntoVtkFileContents(MeshSource(path))
    words = text.split()
    vertices = _block(words, "POINTS", 3, 3).astype(float)
    cells = _block(words, "CELLS", 3, 5).astype(np.int32)[:, 1:]
    faces = cells[:, _FACES].reshape(-1, 3)
    # A face between two tetrahedra is there twice.
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    return vertices, faces[np.sort(first[count == 1])]


def _block(
    words: Sequence[str], keyword: str, header: int, columns: int
) -> np.ndarray:
    """Returns the rows of numbers that follow a keyword and its header."""
    at = words.index(keyword)
    rows, begin = int(words[at + 1]), at + header
    block = np.array(words[begin : begin + rows * columns])
    return block.reshape(rows, columns)
