"""Polygon meshes of the city and their deterministic OBJ text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import itertools

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.city.geometry.obj_text import obj_text

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
        return sum(map(len, self.faces)) - 2 * len(self.faces)

    def triangles(self) -> np.ndarray:
        """Returns the (M, 3) int32 vertex indices after fan triangulation."""
        corners = self._corners
        is_there = np.ones((len(corners), 2), dtype=bool)
        is_there[:, 1] = corners[:, 2] != corners[:, 3]
        halves = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 2, 3)
        return halves[is_there].astype(np.int32)

    @cached_property
    def _corners(self) -> np.ndarray:
        """The faces as (F, 4) vertex indices.

        Triangles have their last one twice.
        """
        # Arrays are made of iterators several times faster than of tuples.
        numbers = np.fromiter(map(len, self.faces), np.int64, len(self.faces))
        corners = np.fromiter(
            itertools.chain.from_iterable(self.faces), np.int64, numbers.sum()
        )
        last = numbers[:, None] - 1
        begin = np.cumsum(numbers)[:, None] - numbers[:, None]
        return corners[begin + np.minimum(np.arange(4), last)]

    def with_vertices(self, vertices: np.ndarray) -> Mesh:
        """Returns the same faces between other vertices (N, 3) [m]."""
        mesh = Mesh(vertices, self.faces)
        mesh.__dict__["_corners"] = self._corners
        return mesh

    def moved(
        self, translation: ArrayLike = (0.0, 0.0, 0.0), yaw: float = 0.0
    ) -> Mesh:
        """Returns the mesh rotated about z by `yaw`, then translated."""
        c, s = np.cos(yaw), np.sin(yaw)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return self.with_vertices(self.vertices @ R.T + np.asarray(translation))

    def to_obj(self) -> str:
        """Returns the mesh as OBJ text with coordinates in millimetres.

        Vertices that coincide after rounding are merged, faces that
        collapse are dropped; the same mesh always gives the same text.
        """
        thousandths = np.rint(self.vertices * 10**_DECIMALS).astype(np.int64)
        unique, inverse = _unique_rows(thousandths)
        return obj_text(unique, inverse[self._corners] + 1).decode("ascii")


def _unique_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns distinct rows of (N, 3), sorted, and each row's number in them.

    As `np.unique` along an axis, which takes several times as long.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    is_first = np.ones(len(rows), dtype=bool)
    is_first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    inverse = np.empty(len(rows), dtype=np.int64)
    inverse[order] = np.cumsum(is_first) - 1
    return ordered[is_first], inverse


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
