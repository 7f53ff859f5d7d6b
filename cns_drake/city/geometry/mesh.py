"""Polygon meshes of the city and their deterministic OBJ text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import itertools

import numpy as np
from numpy.typing import ArrayLike

# Coordinates are stored in whole millimetres: far below LiDAR precision, and
# it keeps the files small and equal from machine to machine.
_DECIMALS = 3


@dataclass(frozen=True)
class Mesh:
    """A polygon mesh.

    Attributes:
        vertices: (N, 3) float64 positions in the mesh frame [m].
        faces: vertex indices (0-based) of each face, counter-clockwise seen
            from outside; 3 or 4 per face, quadrilaterals plane and convex.
    """

    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]

    @property
    def num_triangles(self) -> int:
        return sum(len(face) - 2 for face in self.faces)

    def triangles(self) -> np.ndarray:
        """Returns the (M, 3) int32 vertex indices after fan triangulation."""
        return np.array(
            [
                (face[0], face[k], face[k + 1])
                for face in self.faces
                for k in range(1, len(face) - 1)
            ],
            dtype=np.int32,
        ).reshape(-1, 3)

    def moved(
        self, translation: ArrayLike = (0.0, 0.0, 0.0), yaw: float = 0.0
    ) -> Mesh:
        """Returns the mesh rotated about z by `yaw`, then translated."""
        c, s = np.cos(yaw), np.sin(yaw)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return Mesh(self.vertices @ R.T + np.asarray(translation), self.faces)

    def to_obj(self) -> str:
        """Returns the mesh as OBJ text with coordinates in millimetres.

        Vertices that coincide after rounding are merged, faces that
        collapse are dropped; the same mesh always gives the same text.
        """
        rounded = np.round(self.vertices, _DECIMALS) + 0.0  # No minus zero.
        unique, inverse = np.unique(rounded, axis=0, return_inverse=True)
        inverse = inverse.reshape(-1)
        lines = ["v " + " ".join(map(_number, v)) for v in unique]
        for face in self.faces:
            corners = [int(inverse[i]) + 1 for i in face]
            corners = [c for k, c in enumerate(corners) if c != corners[k - 1]]
            if len(corners) >= 3:
                lines.append("f " + " ".join(map(str, corners)))
        return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    return f"{value:.{_DECIMALS}f}".rstrip("0").rstrip(".")


def merge_meshes(*meshes: Mesh) -> Mesh:
    """Returns one mesh that holds the given ones."""
    vertices, offset = [np.zeros((0, 3))], 0
    faces: list[tuple[int, ...]] = []
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.extend(tuple(i + offset for i in face) for face in mesh.faces)
        offset += len(mesh.vertices)
    return Mesh(np.concatenate(vertices), tuple(faces))


def box_mesh(size: ArrayLike, center: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """Returns an axis-aligned box of the given size [m]."""
    half = np.asarray(size, dtype=float) / 2
    corners = np.array(
        [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    )
    faces = (
        (0, 2, 3, 1),
        (4, 5, 7, 6),
        (0, 1, 5, 4),
        (2, 6, 7, 3),
        (0, 4, 6, 2),
        (1, 3, 7, 5),
    )
    return Mesh(corners * half + np.asarray(center), faces)


def boxes(
    size: ArrayLike,
    xs: Sequence[float],
    ys: Sequence[float],
    zs: Sequence[float],
) -> list[Mesh]:
    """Returns equal boxes about all points of a grid [m]."""
    return [box_mesh(size, point) for point in itertools.product(xs, ys, zs)]
