"""Hits of rays, for compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.ray_casting_scene import RayHits


class Met(NamedTuple):
    """The hits of N rays.

    Attributes:
        d_Wset: (N, 3) float64 directions.
        ranges: (N,) float32 [m], inf for a miss.
        geometry: (N,) int32, -1 for a miss.
        normals_W: (N, 3) float32 towards the origin, zero for a miss.
        is_outside: (N,) bool, whether the outside of a surface was met.
        cosine: (N,) float64 of the angle of incidence.
    """

    d_Wset: np.ndarray
    ranges: np.ndarray
    geometry: np.ndarray
    normals_W: np.ndarray
    is_outside: np.ndarray
    cosine: np.ndarray

    @classmethod
    def of(cls, d_Wset: np.ndarray, hits: RayHits) -> Met:
        """Returns the hits of rays, which have normals."""
        met = cls(
            d_Wset,
            hits.ranges,
            hits.geometry,
            hits.normals_W,
            hits.is_outside,
            np.empty(len(d_Wset)),
        )
        _fill_cosines(met)
        return met

    @classmethod
    def room_for(cls, count: int) -> Met:
        """Returns rays to fill in."""
        return cls(
            np.empty((count, 3)),
            np.empty(count, np.float32),
            np.empty(count, np.int32),
            np.empty((count, 3), np.float32),
            np.empty(count, np.bool_),
            np.empty(count),
        )

    def first(self, count: int) -> Met:
        """Returns the first rays."""
        return Met(*(values[:count] for values in self))


def rotate(R_WSset: np.ndarray, d_Sset: np.ndarray) -> np.ndarray:
    """Returns the directions of rays in the world, (N, 3).

    Args:
        R_WSset: (L, 3, 3) orientations of S, taken in turn.
        d_Sset: (N, 3)
    """
    d_Wset = np.empty((len(d_Sset), 3))
    _rotate(R_WSset, d_Sset, d_Wset)
    return d_Wset


@compiled
def _rotate(
    R_WSset: np.ndarray, d_Sset: np.ndarray, d_Wset: np.ndarray
) -> None:
    turn = 0
    for ray in range(len(d_Sset)):
        R = R_WSset[turn]
        turn = turn + 1 if turn + 1 < len(R_WSset) else 0
        for i in range(3):
            d_Wset[ray, i] = (
                R[i, 0] * d_Sset[ray, 0]
                + R[i, 1] * d_Sset[ray, 1]
                + R[i, 2] * d_Sset[ray, 2]
            )


@compiled
def _fill_cosines(met: Met) -> None:
    for ray in range(len(met.ranges)):
        cosine = 0.0
        for axis in range(3):
            cosine -= met.normals_W[ray, axis] * met.d_Wset[ray, axis]
        met.cosine[ray] = min(max(cosine, 0.0), 1.0)


@compiled
def copy_hit(source: Met, row: int, target: Met, to: int) -> None:
    """Copies the hit of one ray."""
    target.ranges[to] = source.ranges[row]
    target.geometry[to] = source.geometry[row]
    target.is_outside[to] = source.is_outside[row]
    target.cosine[to] = source.cosine[row]
    for axis in range(3):
        target.d_Wset[to, axis] = source.d_Wset[row, axis]
        target.normals_W[to, axis] = source.normals_W[row, axis]
