"""Hits of rays on half spaces, in closed form."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.rays import Hits, Rays


@compiled
def cast_on_plane(
    X_OLs: np.ndarray,
    rays: Rays,
    row: int,
    limits: np.ndarray,
    met: np.ndarray,
) -> None:
    """Casts rays on a half space: the plane z = 0 of its group's frame L.

    The function is compiled, because NumPy would take as long as all other
    geometry.

    Args:
        X_OLs: (K, 3, 4) poses of L; ray i takes pose i mod K.
        rays: the N rays.
        row: row of the group.
        limits: (N,) greatest ranges; set to the range of each hit [m].
        met: (N,) row of the group that each ray hit; set to `row` for each hit.
    """
    counts = len(rays.p_OSset), len(rays.R_OSset), len(X_OLs)
    origin = turn = pose = -1
    height = 0.0
    normal_S = np.empty(3)
    for ray in range(len(rays.d_Sset)):
        if ray == 0 or max(counts) > 1:
            # Indices are incremented, because remainders take long.
            origin = origin + 1 if origin + 1 < counts[0] else 0
            turn = turn + 1 if turn + 1 < counts[1] else 0
            pose = pose + 1 if pose + 1 < counts[2] else 0
            R = rays.R_OSset[turn]
            X = X_OLs[pose]
            height = 0.0
            for i in range(3):
                height += X[i, 2] * (X[i, 3] - rays.p_OSset[origin, i])
                normal_S[i] = (
                    R[0, i] * X[0, 2] + R[1, i] * X[1, 2] + R[2, i] * X[2, 2]
                )
        along = 0.0
        for i in range(3):
            along += normal_S[i] * rays.d_Sset[ray, i]
        # Rays parallel to the plane, or away from it, do not hit it.
        if along == 0.0 or height * along < 0.0:
            continue
        distance = height / along
        is_first = met[ray] < 0 and distance == limits[ray]
        if distance < limits[ray] or is_first:
            limits[ray], met[ray] = distance, row


@compiled
def take_plane_hits(
    met: np.ndarray, limits: np.ndarray, owners: np.ndarray, hits: Hits
) -> None:
    """Sets the hits of rays that hit a plane and nothing nearer.

    Args:
        met: (N,) row of the half space's group that each ray hit; -1 for none.
        limits: (N,) ranges of these hits [m].
        owners: (G,) index of the first geometry of each group.
        hits: hits of the rays on all other geometry, changed in place.
    """
    for ray in range(len(met)):
        row = np.int64(met[ray])
        if row >= 0 and hits.owner[ray] == -1:
            hits.ranges[ray] = limits[ray]
            hits.owner[ray], hits.group[ray] = owners[row], row
            for axis in range(hits.normals.shape[1]):
                hits.normals[ray, axis] = axis == 2
