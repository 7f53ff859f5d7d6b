"""The width of a beam: where it matters, and the rays that stand for it.

A beam's irradiance falls as exp(-2 r^2 / w^2) with the distance r from its
axis; w is its radius at 1 / e^2. Several rays stand for a beam that meets
more than one surface, each for the same part of its light.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.counter_random import uniform

# Rays that stand for a beam.
NUM_SUB_RAYS = 3
# Draws of a beam that they take.
_RADIUS_DRAW, _ANGLE_DRAW = 0, 1
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
# Surfaces are apart where ranges differ from those on one's own plane by this
# much [m], and by this part of the range.
_JUMP, _JUMP_PART = 0.1, 0.01
# Beams are neighbours if they are this many times the divergence apart at
# most. Between beams that are farther apart, hardly any edge lies in either.
_NEIGHBOURS = 10.0
# Where a probe lies between neighbours, in radii of the beam at 1 / e^2. An
# edge that is farther away takes less than 2.3 % of the light.
_PROBE = 1.0


class Probes(NamedTuple):
    """Rays that tell whether an edge between neighbours lies in a beam.

    Attributes:
        ray: (P,) row of the ray at whose side each lies.
        d_Wset: (P, 3) directions.
    """

    ray: np.ndarray
    d_Wset: np.ndarray


def find_jumps(
    orders: Sequence[np.ndarray],
    d_Sset: np.ndarray,
    R_WSset: np.ndarray,
    ranges: np.ndarray,
    normals_W: np.ndarray,
    divergence: float,
    is_edge: np.ndarray,
) -> Probes:
    """Returns rays to cast where neighbours meet different surfaces.

    Two neighbours meet one surface, or two that touch, where one lies on the
    plane of the other, or both planes meet in between. Otherwise an edge
    lies between them: within one of their beams, or in the gap, which a probe
    at the side of each decides.

    Args:
        orders: of the rays in which neighbours follow, (N,) each.
        d_Sset: (N, 3) directions of the rays.
        R_WSset: (L, 3, 3) orientations of S, taken in turn.
        ranges: (N,) inf for a miss.
        normals_W: (N, 3) of the surfaces.
        divergence: half angle of a beam [rad].
        is_edge: (N,) bool; rays are marked whose neighbour is as near as a
            probe would be.
    """
    ray = np.empty(2 * len(orders) * len(d_Sset), np.int64)
    d_Wset = np.empty((len(ray), 3))
    count = 0
    for order in orders:
        count = _find_jumps(
            order,
            d_Sset,
            R_WSset,
            ranges,
            normals_W,
            divergence,
            is_edge,
            ray,
            d_Wset,
            count,
        )
    return Probes(ray[:count], d_Wset[:count])


@compiled
def _find_jumps(
    order: np.ndarray,
    d_Sset: np.ndarray,
    R_WSset: np.ndarray,
    ranges: np.ndarray,
    normals_W: np.ndarray,
    divergence: float,
    is_edge: np.ndarray,
    ray: np.ndarray,
    d_Wset: np.ndarray,
    count: int,
) -> int:
    """Adds the probes of one order; returns how many there are then."""
    # Chord and angle are the same at this size.
    farthest = (_NEIGHBOURS * divergence) ** 2
    step = _PROBE * divergence
    d_i, d_j = np.empty(3), np.empty(3)
    for k in range(len(order) - 1):
        i, j = order[k], order[k + 1]
        hit_i, hit_j = np.isfinite(ranges[i]), np.isfinite(ranges[j])
        if not hit_i and not hit_j:
            continue
        apart = 0.0
        for axis in range(3):
            apart += (d_Sset[i, axis] - d_Sset[j, axis]) ** 2
        if apart > farthest:
            continue
        R = R_WSset[i % len(R_WSset)]
        for row in range(3):
            d_i[row] = d_j[row] = 0.0
            for axis in range(3):
                d_i[row] += R[row, axis] * d_Sset[i, axis]
                d_j[row] += R[row, axis] * d_Sset[j, axis]
        if (
            hit_i
            and hit_j
            and _touch(
                d_i, ranges[i], normals_W, i, d_j, ranges[j], normals_W, j
            )
        ):
            continue
        if apart <= step * step:
            is_edge[i] = is_edge[j] = True
            continue
        part = step / np.sqrt(apart)
        for axis in range(3):
            way = part * (d_j[axis] - d_i[axis])
            d_Wset[count, axis] = d_i[axis] + way
            d_Wset[count + 1, axis] = d_j[axis] - way
        for probe in range(count, count + 2):
            square = 0.0
            for axis in range(3):
                square += d_Wset[probe, axis] ** 2
            for axis in range(3):
                d_Wset[probe, axis] /= np.sqrt(square)
        ray[count], ray[count + 1] = i, j
        count += 2
    return count


@compiled
def mark_edges(
    probe_rays: np.ndarray,
    probe_d_Wset: np.ndarray,
    probe_ranges: np.ndarray,
    probe_normals_W: np.ndarray,
    d_Sset: np.ndarray,
    R_WSset: np.ndarray,
    ranges: np.ndarray,
    normals_W: np.ndarray,
    is_edge: np.ndarray,
) -> None:
    """Marks the rays whose probes meet another surface than they do.

    Args:
        probe_rays, probe_d_Wset: see `Probes`.
        probe_ranges: (P,) what they met.
        probe_normals_W: (P, 3)
        d_Sset, R_WSset, ranges, normals_W: see `find_jumps`.
        is_edge: (N,) bool to mark.
    """
    d_i = np.empty(3)
    for probe in range(len(probe_rays)):
        i = probe_rays[probe]
        if is_edge[i]:
            continue
        is_hit = np.isfinite(ranges[i])
        if is_hit != np.isfinite(probe_ranges[probe]):
            is_edge[i] = True
        elif is_hit:
            R = R_WSset[i % len(R_WSset)]
            for row in range(3):
                d_i[row] = 0.0
                for axis in range(3):
                    d_i[row] += R[row, axis] * d_Sset[i, axis]
            is_edge[i] = not _touch(
                d_i,
                ranges[i],
                normals_W,
                i,
                probe_d_Wset[probe],
                probe_ranges[probe],
                probe_normals_W,
                probe,
            )


@compiled
def _touch(
    d_i: np.ndarray,
    range_i: float,
    normals_i: np.ndarray,
    i: int,
    d_j: np.ndarray,
    range_j: float,
    normals_j: np.ndarray,
    j: int,
) -> bool:
    """Tells whether the planes of two places are one, or meet in between.

    Args:
        d_i, range_i: direction and distance of a place.
        normals_i, i: the i-th of these is the normal of its plane.
        d_j, range_j, normals_j, j: of the other place.
    """
    # n . d for the plane of each and the direction of each.
    ii = ij = ji = jj = 0.0
    for axis in range(3):
        ii += normals_i[i, axis] * d_i[axis]
        ij += normals_i[i, axis] * d_j[axis]
        ji += normals_j[j, axis] * d_i[axis]
        jj += normals_j[j, axis] * d_j[axis]
    limit = _JUMP + _JUMP_PART * min(range_i, range_j)
    off_i = abs(ij * range_j - ii * range_i)
    off_j = abs(ji * range_i - jj * range_j)
    if min(off_i, off_j) <= limit:
        return True
    # The inverse of the distance to a plane is linear from d_i to d_j. Which
    # plane is nearer changes in between if there is a corner.
    before = jj * range_j - ji * range_i
    after = ij * range_j - ii * range_i
    if jj * ii == 0.0:
        return False
    return before / jj * (after / ii) <= 0.0


@compiled
def sub_directions(
    key: np.uint64,
    beam: int,
    d_W: np.ndarray,
    divergence: float,
    result: np.ndarray,
) -> None:
    """Fills in the directions of the rays that stand for a beam.

    The distances from the axis are stratified: one ray in each of the parts
    into which circles cut the beam's light evenly. A beam has a turn and a
    place within the parts of its own, so that the mean over beams is that of
    the whole profile.

    Args:
        key: of the frame; see `frame_key`.
        beam: number of the beam.
        d_W: (3,) its axis.
        divergence: half angle at 1 / e^2 [rad].
        result: (`NUM_SUB_RAYS`, 3) to fill with unit vectors.
    """
    # Two unit vectors across the axis.
    a = np.zeros(3)
    a[0 if abs(d_W[0]) < 0.6 else 1] = 1.0
    u = np.cross(d_W, a)
    u /= np.sqrt(np.sum(u * u))
    v = np.cross(d_W, u)
    place = uniform(key, beam, _RADIUS_DRAW)
    turn = 2.0 * np.pi * uniform(key, beam, _ANGLE_DRAW)
    for k in range(NUM_SUB_RAYS):
        share = (k + place) / NUM_SUB_RAYS
        radius = divergence * np.sqrt(-0.5 * np.log(1.0 - share))
        angle = turn + k * _GOLDEN_ANGLE
        along_u, along_v = radius * np.cos(angle), radius * np.sin(angle)
        result[k] = d_W + along_u * u + along_v * v
        result[k] /= np.sqrt(np.sum(result[k] ** 2))
