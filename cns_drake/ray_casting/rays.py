"""Many rays, and their hits, as arrays.

O is the frame of a ray-casting scene: world axes, a nearby origin.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evaluation.base import compiled


class Rays(NamedTuple):
    """N rays, cast from one or several poses of a sensor S.

    O is the frame of the scene: its axes are the world's axes, and its origin
    is near enough to the sensor for float32 to be precise. Ray i has direction
    i. In all other arrays, entry i mod n belongs to ray i, where n is the
    length of the array.

    Attributes:
        p_OSset: (K, 3) float64 origins [m].
        R_OSset: (L, 3, 3) float64 orientations of S in O.
        max_ranges: (M,) float32 greatest ranges [m].
        d_Sset: (N, 3) float64 unit directions, expressed in S.
        times: (T,) float32 times at which rays are cast, as fractions of the
            LiDAR's revolution, from 0 to 1.
    """

    p_OSset: np.ndarray
    R_OSset: np.ndarray
    max_ranges: np.ndarray
    d_Sset: np.ndarray
    times: np.ndarray

    def d_Oset(self) -> np.ndarray:
        """Returns the (N, 3) float64 direction of each ray in O."""
        return rotate(self.R_OSset, self.d_Sset)


@compiled
def rotate(R_FSset: np.ndarray, d_Sset: np.ndarray) -> np.ndarray:
    """Returns directions of a frame S, expressed in a frame F.

    Direction i is rotated by orientation i mod L. Products are added in a fixed
    order, because the results of a matrix library depend on the processor.

    Args:
        R_FSset: (L, 3, 3) orientations of S in F.
        d_Sset: (N, 3) directions in S.
    """
    d_Fset = np.empty((len(d_Sset), 3))
    turn = -1
    for ray in range(len(d_Sset)):
        turn = turn + 1 if turn + 1 < len(R_FSset) else 0
        R, d = R_FSset[turn], d_Sset[ray]
        for i in range(3):
            d_Fset[ray, i] = R[i, 0] * d[0] + R[i, 1] * d[1] + R[i, 2] * d[2]
    return d_Fset


class Hits(NamedTuple):
    """The first hits of N rays.

    Attributes:
        ranges: (N,) float32 ranges [m], inf for a miss.
        owner: (N,) int32 index of the geometry, -1 for a miss.
        group: (N,) int32 number of the geometry's group, -1 for a miss. All
            geometries of a group are fixed to the same frame L.
        normals: (N, 3) float32 normal of the surface, expressed in L, of any
            length; zero for a miss. (N, 0) unless normals were requested.
    """

    ranges: np.ndarray
    owner: np.ndarray
    group: np.ndarray
    normals: np.ndarray

    @classmethod
    def misses(cls, num_rays: int, with_normals: bool) -> Hits:
        """Returns the hits of rays none of which hits anything.

        Args:
            num_rays: number of rays.
            with_normals: whether the result has normals, which are zero.
        """
        return cls(
            np.full(num_rays, np.inf, np.float32),
            np.full(num_rays, -1, np.int32),
            np.full(num_rays, -1, np.int32),
            np.zeros((num_rays, 3 if with_normals else 0), np.float32),
        )
