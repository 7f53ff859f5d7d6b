"""The width of a beam: where it matters, and the rays that stand for it.

A beam's irradiance falls as exp(-2 r^2 / w^2) with the distance r from its
axis; w is its radius at 1 / e^2. Several rays stand for a beam that meets
more than one surface, each for the same part of its light.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.counter_random import uniform

# Rays that stand for a beam.
NUM_SUB_RAYS = 5
# Draws of a beam that they take.
_RADIUS_DRAW, _ANGLE_DRAW = 0, 1
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
# Surfaces are apart where ranges differ from those on one's own plane by this
# much [m], and by this part of the range.
_JUMP, _JUMP_PART = 0.1, 0.01
# Beams are neighbours if they are this many times the divergence apart at
# most. Between beams that are farther apart, hardly any edge lies in either.
_NEIGHBOURS = 10.0


@compiled
def find_edges(
    order: np.ndarray,
    d_Sset: np.ndarray,
    R_WSset: np.ndarray,
    ranges: np.ndarray,
    normals_W: np.ndarray,
    divergence: float,
    is_edge: np.ndarray,
) -> None:
    """Marks beams next to which surfaces lie one behind the other.

    Two neighbours meet one surface, or two that touch, where one lies on the
    plane of the other.

    Args:
        order: (N,) an order of the rays in which neighbours follow.
        d_Sset: (N, 3) directions of the rays.
        R_WSset: (L, 3, 3) orientations of S, taken in turn.
        ranges: (N,) inf for a miss.
        normals_W: (N, 3) of the surfaces.
        divergence: half angle of a beam [rad].
        is_edge: (N,) bool to mark.
    """
    # Chord and angle are the same at this size.
    farthest = (_NEIGHBOURS * divergence) ** 2
    for k in range(len(order) - 1):
        i, j = order[k], order[k + 1]
        apart = 0.0
        for axis in range(3):
            apart += (d_Sset[i, axis] - d_Sset[j, axis]) ** 2
        if apart > farthest:
            continue
        hit_i, hit_j = np.isfinite(ranges[i]), np.isfinite(ranges[j])
        if not hit_i and not hit_j:
            continue
        if hit_i and hit_j:
            R = R_WSset[i % len(R_WSset)]
            along_ii = along_ij = along_ji = along_jj = 0.0
            for row in range(3):
                d_i = d_j = 0.0
                for axis in range(3):
                    d_i += R[row, axis] * d_Sset[i, axis]
                    d_j += R[row, axis] * d_Sset[j, axis]
                along_ii += normals_W[i, row] * d_i
                along_ij += normals_W[i, row] * d_j
                along_ji += normals_W[j, row] * d_i
                along_jj += normals_W[j, row] * d_j
            limit = _JUMP + _JUMP_PART * min(ranges[i], ranges[j])
            # n . (r_i d_i) = n . (r d_j) on the plane of i.
            off_i = abs(along_ij * ranges[j] - along_ii * ranges[i])
            off_j = abs(along_ji * ranges[i] - along_jj * ranges[j])
            if min(off_i, off_j) <= limit:
                continue
        is_edge[i] = True
        is_edge[j] = True


@compiled
def sub_directions(
    key: np.uint64,
    beams: np.ndarray,
    d_Wset: np.ndarray,
    divergence: float,
    result: np.ndarray,
) -> None:
    """Fills in the directions of the rays that stand for beams.

    The distances from the axis are stratified: one ray in each of the parts
    into which circles cut the beam's light evenly. A beam has a turn and a
    place within the parts of its own, so that the mean over beams is that of
    the whole profile.

    Args:
        key: of the frame; see `frame_key`.
        beams: (M,) numbers of the beams.
        d_Wset: (M, 3) their axes.
        divergence: half angle at 1 / e^2 [rad].
        result: (M, `NUM_SUB_RAYS`, 3) to fill with unit vectors.
    """
    for m in range(len(beams)):
        d = d_Wset[m]
        # Two unit vectors across the axis.
        a = np.zeros(3)
        a[0 if abs(d[0]) < 0.6 else 1] = 1.0
        u = np.cross(d, a)
        u /= np.sqrt(np.sum(u * u))
        v = np.cross(d, u)
        place = uniform(key, beams[m], _RADIUS_DRAW)
        turn = 2.0 * np.pi * uniform(key, beams[m], _ANGLE_DRAW)
        for k in range(NUM_SUB_RAYS):
            share = (k + place) / NUM_SUB_RAYS
            radius = divergence * np.sqrt(-0.5 * np.log(1.0 - share))
            angle = turn + k * _GOLDEN_ANGLE
            for axis in range(3):
                result[m, k, axis] = (
                    d[axis]
                    + radius * np.cos(angle) * u[axis]
                    + radius * np.sin(angle) * v[axis]
                )
            norm = np.sqrt(np.sum(result[m, k] ** 2))
            result[m, k] /= norm
