"""The width of a beam: rays in its parts beside an edge.

A beam's irradiance falls as exp(-2 r^2 / w^2) with the distance r from its
axis; w is its radius at 1 / e^2. If the neighbour of a beam meets another
surface, a ray at a random place of the beam's half on that side represents the
half. The surface that it meets gets that part of the light. The mean over beams
is then that of the whole profile.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.counter_random import uniform
from cns_drake.sensors.returns.met import Met

# Numbers of a beam's draws for the rays at its sides, two each.
_SIDE_DRAW = 0
# Surfaces are apart if ranges differ from those on the own plane by this much
# [m], and by this part of the range.
_JUMP, _JUMP_PART = 0.1, 0.01
# Beams are neighbours if their angle is at most this many divergences. An edge
# between beams farther apart is hardly ever within either.
_NEIGHBOURS = 10.0


class Sides(NamedTuple):
    """P rays in those parts of beams that are next to an edge.

    Attributes:
        ray: (P,) row of the beam.
        neighbour: (P,) row of the beam beyond the edge.
        number: (P,) number of the side of the beam: 0 and 1 in the first order
            of beams, 2 and 3 in the second one.
        share: (P,) part of the beam's light.
        d_Wset: (P, 3) directions.
        reach: (P,) float32: beyond the nearer of both surfaces [m].
    """

    ray: np.ndarray
    neighbour: np.ndarray
    number: np.ndarray
    share: np.ndarray
    d_Wset: np.ndarray
    reach: np.ndarray


def find_sides(
    key: np.uint64,
    beam: np.ndarray,
    orders: np.ndarray,
    met: Met,
    divergence: float,
    max_range: float,
) -> Sides:
    """Returns rays to cast where neighbours meet different surfaces.

    Two neighbours meet one surface, or two that touch, if one place is on the
    plane of the other, or both planes meet in between. Otherwise an edge is
    between them: within one of their beams, or in the gap.

    Args:
        key: of the frame; see `frame_key`.
        beam: (N,) number of each beam.
        orders: (2, N) orders of the rays in which neighbours follow.
        met: by the axes of the beams.
        divergence: half angle of a beam [rad].
        max_range: of the rays [m].
    """
    ray = np.empty(2 * orders.size, np.int64)
    neighbour, number = np.empty_like(ray), np.empty_like(ray)
    side_of = np.full((len(beam), 2 * len(orders)), -1, np.int32)
    count = _find_jumps(
        orders, met, divergence, side_of, ray, neighbour, number
    )
    sides = Sides(
        ray[:count],
        neighbour[:count],
        number[:count],
        np.empty(count),
        np.empty((count, 3)),
        np.empty(count, np.float32),
    )
    _face_neighbours(met, sides)
    _share(side_of, sides)
    is_twin = sides.share == 0.0
    if is_twin.any():
        sides = Sides(*(values[~is_twin] for values in sides))
    _aim(key, beam, met, divergence, max_range, sides)
    return sides


@compiled
def _find_jumps(
    orders: np.ndarray,
    met: Met,
    divergence: float,
    side_of: np.ndarray,
    ray: np.ndarray,
    neighbour: np.ndarray,
    number: np.ndarray,
) -> int:
    """Fills in the first fields of `Sides`; returns the number of sides."""
    # Chord and angle are the same at this size.
    farthest = (_NEIGHBOURS * divergence) ** 2
    count = 0
    for way in range(len(orders)):
        for k in range(orders.shape[1] - 1):
            i, j = orders[way, k], orders[way, k + 1]
            if met.geometry[i] < 0 and met.geometry[j] < 0:
                continue
            apart = 0.0
            for axis in range(3):
                apart += (met.d_Wset[i, axis] - met.d_Wset[j, axis]) ** 2
            if apart > farthest or apart == 0.0 or _touch(met, i, met, j):
                continue
            side_of[i, 2 * way], side_of[j, 2 * way + 1] = count, count + 1
            ray[count], neighbour[count], number[count] = i, j, 2 * way
            count += 1
            ray[count], neighbour[count], number[count] = j, i, 2 * way + 1
            count += 1
    return count


@compiled
def _face_neighbours(met: Met, sides: Sides) -> None:
    """Sets directions to unit vectors across the beams, to the neighbours."""
    for side in range(len(sides.ray)):
        d = met.d_Wset[sides.ray[side]]
        d_j = met.d_Wset[sides.neighbour[side]]
        along = d[0] * d_j[0] + d[1] * d_j[1] + d[2] * d_j[2]
        square = 0.0
        for axis in range(3):
            sides.d_Wset[side, axis] = d_j[axis] - along * d[axis]
            square += sides.d_Wset[side, axis] ** 2
        length = np.sqrt(square)
        for axis in range(3):
            sides.d_Wset[side, axis] /= length


@compiled
def _share(side_of: np.ndarray, sides: Sides) -> None:
    """Fills in the parts of the light, after `_face_neighbours`.

    A side has half of the beam, or a quarter if there are edges at other sides,
    too. A second neighbour on the same side has no part.
    """
    for side in range(len(sides.ray)):
        share = 0.5
        for other in side_of[sides.ray[side]]:
            if other < 0 or other == side:
                continue
            along = 0.0
            for axis in range(3):
                along += sides.d_Wset[side, axis] * sides.d_Wset[other, axis]
            if abs(along) < 0.5:
                share = min(share, 0.25)
            elif along > 0.0 and other < side:
                share = 0.0
        sides.share[side] = share


@compiled
def _aim(
    key: np.uint64,
    beam: np.ndarray,
    met: Met,
    divergence: float,
    max_range: float,
    sides: Sides,
) -> None:
    """Turns directions to random places of the sides; fills in the reach."""
    u = np.empty(3)
    for side in range(len(sides.ray)):
        i, j = sides.ray[side], sides.neighbour[side]
        d, d_W = met.d_Wset[i], sides.d_Wset[side]
        for axis in range(3):
            u[axis] = d_W[axis]
        draw = _SIDE_DRAW + 2 * sides.number[side]
        rest = 1.0 - uniform(key, beam[i], draw)
        radius = divergence * np.sqrt(-0.5 * np.log(rest))
        turn = uniform(key, beam[i], draw + 1) - 0.5
        angle = 2.0 * np.pi * sides.share[side] * turn
        toward, across = radius * np.cos(angle), radius * np.sin(angle)
        d_W[0] = d[0] + toward * u[0] + across * (d[1] * u[2] - d[2] * u[1])
        d_W[1] = d[1] + toward * u[1] + across * (d[2] * u[0] - d[0] * u[2])
        d_W[2] = d[2] + toward * u[2] + across * (d[0] * u[1] - d[1] * u[0])
        length = np.sqrt(d_W[0] ** 2 + d_W[1] ** 2 + d_W[2] ** 2)
        for axis in range(3):
            d_W[axis] /= length
        near, far = (i, j) if met.ranges[i] <= met.ranges[j] else (j, i)
        reach = _range_on(met, near, d_W)
        reach = min(max(reach, met.ranges[near]), met.ranges[far])
        sides.reach[side] = min(reach + _limit(met.ranges[near]), max_range)


@compiled
def meet_sides(sides: Sides, side_met: Met, met: Met, rest: np.ndarray) -> None:
    """Subtracts from beams the light of other surfaces at their sides.

    A ray that passes the nearer of two surfaces has met the farther one, on its
    plane.

    Args:
        sides: see `find_sides`.
        side_met: by their rays within their reach. Rays that meet the surface
            of their beam become misses, those that pass the nearer surface
            become hits.
        met: by the axes of the beams.
        rest: (N,) part of each beam's light, to lessen.
    """
    for side in range(len(sides.ray)):
        i, j = sides.ray[side], sides.neighbour[side]
        if side_met.geometry[side] < 0:
            if met.ranges[i] > met.ranges[j]:
                continue
            rest[i] -= sides.share[side]
            if met.geometry[j] < 0:
                continue
            distance = _range_on(met, j, sides.d_Wset[side])
            if not sides.reach[side] < distance < 2.0 * met.ranges[j]:
                distance = met.ranges[j]
            side_met.ranges[side] = distance
            side_met.geometry[side] = met.geometry[j]
            side_met.is_outside[side] = met.is_outside[j]
            side_met.cosine[side] = met.cosine[j]
            for axis in range(3):
                side_met.normals_W[side, axis] = met.normals_W[j, axis]
        elif met.geometry[i] >= 0 and _touch(met, i, side_met, side):
            side_met.geometry[side] = -1
        else:
            rest[i] -= sides.share[side]


@compiled
def _limit(distance: float) -> float:
    """Returns the greatest difference of ranges on one surface [m]."""
    return _JUMP + _JUMP_PART * distance


@compiled
def _range_on(met: Met, i: int, d_W: np.ndarray) -> float:
    """Returns a ray's range at the plane of the i-th ray's hit [m].

    It is inf if the ray does not meet the plane, or the i-th ray is a miss.
    """
    along = 0.0
    for axis in range(3):
        along -= met.normals_W[i, axis] * d_W[axis]
    if met.geometry[i] < 0 or along <= 0.0:
        return np.inf
    return met.cosine[i] * met.ranges[i] / along


@compiled
def _touch(a: Met, i: int, b: Met, j: int) -> bool:
    """Returns whether the planes of two places are one, or meet in between.

    Args:
        a, i: a place: the hit of the i-th of these rays.
        b, j: another place.
    """
    if a.geometry[i] < 0 or b.geometry[j] < 0:
        return False
    # -n . d for the plane of each and the direction of the other.
    ij = ji = 0.0
    for axis in range(3):
        ij -= a.normals_W[i, axis] * b.d_Wset[j, axis]
        ji -= b.normals_W[j, axis] * a.d_Wset[i, axis]
    ii, jj = a.cosine[i], b.cosine[j]
    range_i, range_j = a.ranges[i], b.ranges[j]
    after = ij * range_j - ii * range_i
    before = jj * range_j - ji * range_i
    if min(abs(after), abs(before)) <= _limit(min(range_i, range_j)):
        return True
    # The inverse of the distance to a plane is linear from i to j. At a corner,
    # the nearer plane changes in between.
    return ii * jj > 0.0 and before * after <= 0.0
