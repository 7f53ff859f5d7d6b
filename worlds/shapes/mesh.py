"""Polygon meshes of the city, and their deterministic OBJ text."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
import itertools
import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from evaluation.base import rotated

# Coordinates are stored in whole millimetres. This is far below LiDAR
# precision, and makes the files small and the same on every machine.
_MM = 1000


@dataclass(frozen=True)
class Mesh:
    """A polygon mesh.

    Attributes:
        vertices: (N, 3) float64 positions in the mesh frame [m].
        faces: 3 or 4 vertex indices (0-based) of each face, counter-clockwise
            as seen from outside. Quadrilaterals are plane and convex.
    """

    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]

    @property
    def num_triangles(self) -> int:
        return sum(map(len, self.faces)) - 2 * len(self.faces)

    def triangles(self) -> np.ndarray:
        """Returns the faces as triangles: (M, 3) int32 vertex indices.

        Quadrilaterals are divided into two triangles.
        """
        corners = self._corners
        is_there = np.ones((len(corners), 2), dtype=bool)
        is_there[:, 1] = corners[:, 2] != corners[:, 3]
        halves = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 2, 3)
        return halves[is_there].astype(np.int32)

    @cached_property
    def _corners(self) -> np.ndarray:
        """The faces as (F, 4) vertex indices.

        The fourth index of a triangle repeats the third index.
        """
        # NumPy makes arrays from iterators several times faster than from
        # tuples.
        numbers = np.fromiter(map(len, self.faces), np.int64, len(self.faces))
        corners = np.fromiter(
            itertools.chain.from_iterable(self.faces), np.int64, numbers.sum()
        )
        last = numbers[:, None] - 1
        begin = np.cumsum(numbers)[:, None] - numbers[:, None]
        return corners[begin + np.minimum(np.arange(4), last)]

    def with_vertices(self, vertices: np.ndarray) -> Mesh:
        """Returns a mesh with the same faces and new vertices (N, 3) [m]."""
        return Mesh(vertices, self.faces)

    def moved(
        self, translation: ArrayLike = (0.0, 0.0, 0.0), yaw: float = 0.0
    ) -> Mesh:
        """Returns the mesh rotated about the z axis, and then moved.

        `yaw` is the angle of the rotation [rad], and `translation` (3,) the
        shift [m].
        """
        c, s = math.cos(yaw), math.sin(yaw)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return self.with_vertices(
            rotated(R, self.vertices) + np.asarray(translation)
        )

    def inside_out(self) -> Mesh:
        """Returns the mesh with its faces reversed: inside and outside swap."""
        return Mesh(self.vertices, tuple(face[::-1] for face in self.faces))

    def to_obj(self) -> str:
        """Returns the mesh as OBJ text, with coordinates rounded to 1 mm.

        Vertices that coincide after rounding are merged, and faces that
        collapse are dropped. The same mesh always gives the same text.
        """
        thousandths = np.rint(self.vertices * _MM).astype(np.int64)
        unique, inverse = np.unique(thousandths, axis=0, return_inverse=True)
        corners = inverse.reshape(-1)[self._corners] + 1
        is_new = corners != np.roll(corners, 1, axis=1)
        number = is_new.sum(axis=1)
        is_new[number < 3] = False
        # 15 digits are exact here, and leave out zeros at the end.
        vertices = "v %.15g %.15g %.15g\n" * len(unique)
        faces = ["", "", "", "f %d %d %d\n", "f %d %d %d %d\n"]
        return vertices % tuple((unique / _MM).ravel().tolist()) + (
            "".join(faces[k] for k in number) % tuple(corners[is_new].tolist())
        )


def merge_meshes(*meshes: Mesh) -> Mesh:
    """Returns one mesh that contains the faces of all given meshes."""
    vertices = [np.zeros((0, 3))]
    offset = 0
    faces: list[tuple[int, ...]] = []
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.extend(tuple(i + offset for i in face) for face in mesh.faces)
        offset += len(mesh.vertices)
    return Mesh(np.concatenate(vertices), tuple(faces))


def box_mesh(size: ArrayLike, center: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """Returns an axis-aligned box, given by its size and centre [m].

    `size` contains the lengths along x, y and z, and `center` (3,) the
    position.
    """
    half = np.asarray(size, dtype=float) / 2
    corners = np.array(
        [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    )
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4),
             (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))  # fmt: skip
    return Mesh(corners * half + np.asarray(center), faces)


@cache
def read_mesh(path: Path) -> Mesh:
    """Reads a mesh from an OBJ file that the city generator wrote.

    Raises:
        FileNotFoundError: there is no such file.
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
