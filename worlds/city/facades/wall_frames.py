"""Wall coordinates, in which the details of a wall are described."""

import math

import numpy as np
from numpy.typing import ArrayLike

from worlds.city.facades import solids
from worlds.shapes import Mesh


class WallFrame:
    """Converts geometry from wall coordinates to the building's frame [m].

    In wall coordinates, x runs along the wall, y outwards and z up. The origin
    is on the ground at the start of the wall: at the left, as seen from
    outside. The wall is the edge number `edge` of `outline` (N, 2), which
    contains the corners of all walls, counter-clockwise [m].

    Attributes:
        length: length of the wall [m].
    """

    def __init__(self, outline: ArrayLike, edge: int):
        outline = np.asarray(outline, dtype=float)
        edge %= len(outline)
        start, end = outline[edge], outline[(edge + 1) % len(outline)]
        self.length = float(np.hypot(*(end - start)))
        self._start = start
        self._along = (end - start) / self.length
        self._outward = np.array([self._along[1], -self._along[0]])

    def place(self, mesh: Mesh, z: float = 0.0) -> Mesh:
        """Converts a mesh from wall coordinates to the building's frame [m].

        The mesh is also raised by `z` [m]. As wall coordinates are left-handed,
        the order of the corners of each face is reversed.
        """
        x, y, height = mesh.vertices.T
        xy = self._start + np.outer(x, self._along) + np.outer(y, self._outward)
        vertices = np.column_stack([xy, height + z])
        return Mesh(vertices, mesh.faces).inside_out()

    def box(
        self,
        x: solids.Range,
        y: solids.Range,
        z: solids.Range,
        *,
        bottom: bool = True,
    ) -> Mesh:
        """Returns an upright box, in the building's frame.

        Args:
            x: where the box begins and ends along the wall [m].
            y: distances of the box's back and front out of the wall [m].
            z: heights of the bottom and the top [m].
            bottom: whether the box has a lower side.
        """
        return self.place(solids.box(x, y, z, bottom=bottom))

    def standing(
        self,
        x: solids.Range,
        y: solids.Range,
        z1: float,
        *,
        bottom: bool = False,
    ) -> Mesh:
        """Returns a box that stands on the ground, in the building's frame.

        The box reaches below the ground.

        Args:
            x: where the box begins and ends along the wall [m].
            y: distances of the box's back and front out of the wall [m].
            z1: height of the top [m].
            bottom: whether the box has a lower side.
        """
        return self.place(solids.standing(x, y, z1, bottom=bottom))

    @property
    def heading(self) -> float:
        """Direction of the wall in the building's frame, left to right [rad].

        Left and right are as seen from outside.
        """
        return math.atan2(self._along[1], self._along[0])

    def point(self, x: float, y: float) -> np.ndarray:
        """Returns a place in the building's frame as x and y [m].

        The place is given in wall coordinates: `x` along the wall, and `y`
        outwards.
        """
        return self._start + x * self._along + y * self._outward
