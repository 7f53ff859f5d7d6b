"""The width of a beam: additional rays next to edges.

A beam's irradiance falls as exp(-2 r^2 / w^2) with the distance r from the
beam's axis; w is the radius at 1 / e^2. If a neighbouring beam hits another
surface, an additional ray is cast at a random place in the half of the beam
towards this neighbour. The additional ray represents this half of the beam, so
half of the light goes to the surface that the additional ray hits. On average
over many beams, this reproduces the full profile of irradiance.
"""

from typing import NamedTuple

import numpy as np

from cns_drake.sensors.returns.light import BeamHits, Shots
from cns_drake.sensors.returns.random_numbers import uniform
from evaluation.base import compiled

# Numbers of a beam's random draws for the rays at its sides, two per ray.
_SIDE_DRAW = 0
# Two surfaces are apart if a range differs from the range at the neighbour's
# plane by more than this distance [m] plus a part of the range.
_JUMP = 0.1
# This part, as a fraction of the range.
_JUMP_PART = 0.01
# Beams are neighbours if the angle between them is at most this many
# divergences. If beams are farther apart, an edge between them is hardly ever
# within either beam.
_NEIGHBOURS = 10.0


class Sides(NamedTuple):
    """P additional rays, cast where an edge lies between neighbouring beams.

    Each ray represents the part of a beam that is towards the neighbour.

    Attributes:
        row: (P,) index of the beam among the beams of the revolution.
        neighbour: (P,) index of the neighbouring beam beyond the edge.
        share: (P,) fraction of the beam's light that the ray represents.
        d_Wset: (P, 3) unit directions in the world.
        reach: (P,) float32 length to cast, just beyond the nearer of the two
            surfaces [m].
    """

    row: np.ndarray
    neighbour: np.ndarray
    share: np.ndarray
    d_Wset: np.ndarray
    reach: np.ndarray


def find_sides(shots: Shots, orders: np.ndarray, hits: BeamHits) -> Sides:
    """Returns extra rays to cast where neighbouring beams hit an edge.

    There is no edge between two neighbours if the point that one beam hits lies
    in the plane that the other beam hits, or if the two planes intersect
    between the beams. Otherwise there is an edge, either within one of the two
    beams or in the gap between them.

    Args:
        shots: the N beams.
        orders: (2, N) two orders of the beams. Beams that are consecutive in
            one of the two orders are neighbours.
        hits: hits of the N beams' axes.
    """
    farthest = _NEIGHBOURS * shots.divergence
    edges = [_find_edges(order, hits, farthest) for order in orders]
    row = np.concatenate([pairs.ravel() for pairs in edges])
    neighbour = np.concatenate([pairs[:, ::-1].ravel() for pairs in edges])
    # Sides of a beam are 0 and 1 in the first order, 2 and 3 in the second one.
    number = np.concatenate(
        [np.tile([2 * k, 2 * k + 1], len(edges[k])) for k in range(len(edges))]
    )
    toward = _directions_to_neighbours(hits.d_Wset, row, neighbour)
    share = _side_shares(len(shots.beam), row, number, toward)
    kept = share > 0.0
    row, neighbour, number = row[kept], neighbour[kept], number[kept]
    toward, share = toward[kept], share[kept]

    # Random places of the sides.
    draw = _SIDE_DRAW + 2 * number
    rest = 1.0 - uniform(shots.key, shots.beam[row], draw)
    turn = uniform(shots.key, shots.beam[row], draw + 1) - 0.5
    angle = 2.0 * np.pi * share * turn
    d_Wset = np.empty_like(toward)
    reach = np.empty(len(row), np.float32)
    sides = Sides(row, neighbour, share, d_Wset, reach)
    _aim_rays(
        sides, toward, rest, angle, hits, shots.divergence, shots.max_range
    )
    return sides


def _directions_to_neighbours(
    d_Wset: np.ndarray, row: np.ndarray, neighbour: np.ndarray
) -> np.ndarray:
    """Returns unit vectors across beams, (P, 3), to their neighbours."""
    d, d_j = d_Wset[row], d_Wset[neighbour]
    toward = d_j - (d * d_j).sum(axis=1, keepdims=True) * d
    return toward / np.sqrt((toward * toward).sum(axis=1, keepdims=True))


@compiled
def _aim_rays(
    sides: Sides,
    toward: np.ndarray,
    rest: np.ndarray,
    angle: np.ndarray,
    hits: BeamHits,
    divergence: float,
    max_range: float,
) -> None:
    """Fills in directions and reach of P additional rays.

    Args:
        toward: (P, 3) unit vectors across the beams, to the neighbours.
        rest: (P,) part of a beam's light that is farther from the beam's axis
            than the ray.
        angle: (P,) angle between `toward` and the direction from the axis to
            the ray [rad].
        hits: hits of the beams' axes.
    """
    for side in range(len(rest)):
        i, j = sides.row[side], sides.neighbour[side]
        d = hits.d_Wset[i]
        u = toward[side]
        d_W = sides.d_Wset[side]
        radius = divergence * np.sqrt(-0.5 * np.log(rest[side]))
        along = radius * np.cos(angle[side])
        across = radius * np.sin(angle[side])
        d_W[0] = d[0] + along * u[0] + across * (d[1] * u[2] - d[2] * u[1])
        d_W[1] = d[1] + along * u[1] + across * (d[2] * u[0] - d[0] * u[2])
        d_W[2] = d[2] + along * u[2] + across * (d[0] * u[1] - d[1] * u[0])
        d_W /= np.sqrt(d_W[0] * d_W[0] + d_W[1] * d_W[1] + d_W[2] * d_W[2])
        if hits.ranges[i] > hits.ranges[j]:
            i, j = j, i
        reach = max(_range_on(hits, i, d_W), hits.ranges[i])
        reach = min(reach, hits.ranges[j])
        reach += _JUMP + _JUMP_PART * hits.ranges[i]
        sides.reach[side] = min(reach, max_range)


@compiled
def _side_shares(
    num_beams: int, row: np.ndarray, number: np.ndarray, toward: np.ndarray
) -> np.ndarray:
    """Returns the fraction (P,) of a beam's light that each side gets.

    A side gets half of the light, or a quarter if other sides have edges, too.
    A second neighbour on the same side gets nothing. `toward` has the (P, 3)
    directions to the neighbours.
    """
    side_of = np.full((num_beams, 4), -1)
    for side in range(len(row)):
        side_of[row[side], number[side]] = side
    share = np.full(len(row), 0.5)
    for side in range(len(row)):
        for other in side_of[row[side]]:
            if other < 0 or other == side:
                continue
            along = 0.0
            for axis in range(3):
                along += toward[side, axis] * toward[other, axis]
            if abs(along) < 0.5:
                share[side] = min(share[side], 0.25)
            elif along > 0.0 and other < side:
                share[side] = 0.0
    return share


@compiled
def correct_side_hits(
    sides: Sides, side_hits: BeamHits, hits: BeamHits
) -> np.ndarray:
    """Corrects the hits of additional rays; returns the axes' shares of light.

    At an edge, the axis of a beam hits one surface, and the axis of a
    neighbouring beam hits another surface. The beam then has an additional ray
    (see `find_sides`), which is cast only to just beyond the nearer of these
    two surfaces. The hit of the additional ray is corrected in two cases:

    - If the ray hits the same surface as the axis of its own beam, the hit is
      removed.
    - If the ray hits nothing, and the axis of its own beam hits the nearer
      surface, the ray gets a hit on the plane of the farther surface.

    Args:
        sides: the additional rays.
        side_hits: hits of the additional rays; corrected in place.
        hits: hits of the N beams' axes.

    Returns:
        (N,) fraction of each beam's light that its axis represents; the
        additional rays of the beam represent the other light.
    """
    axis_shares = np.ones(len(hits.ranges))
    for side in range(len(sides.row)):
        i, j = sides.row[side], sides.neighbour[side]
        if side_hits.geometry[side] >= 0:
            if _planes_meet(hits, i, side_hits, side):
                side_hits.geometry[side] = -1
            else:
                axis_shares[i] -= sides.share[side]
        elif hits.ranges[i] <= hits.ranges[j]:
            axis_shares[i] -= sides.share[side]
            if hits.geometry[j] < 0:
                continue
            distance = _range_on(hits, j, sides.d_Wset[side])
            if not sides.reach[side] < distance < 2.0 * hits.ranges[j]:
                distance = hits.ranges[j]
            side_hits.ranges[side] = np.float32(distance)
            side_hits.geometry[side] = hits.geometry[j]
            side_hits.is_outside[side] = hits.is_outside[j]
            side_hits.cosine[side] = hits.cosine[j]
            for axis in range(3):
                side_hits.normals_W[side, axis] = hits.normals_W[j, axis]
    return axis_shares


@compiled
def _range_on(hits: BeamHits, i: int, d_W: np.ndarray) -> float:
    """Returns a ray's range at the plane of the i-th hit [m].

    The range is inf if the ray does not meet the plane, or there is no hit.
    """
    along = 0.0
    for axis in range(3):
        along -= hits.normals_W[i, axis] * d_W[axis]
    if hits.geometry[i] < 0 or along <= 0.0:
        return np.inf
    return hits.cosine[i] * hits.ranges[i] / along


@compiled
def _find_edges(
    order: np.ndarray, hits: BeamHits, farthest: float
) -> np.ndarray:
    """Returns the (E, 2) rows of neighbours with an edge between them.

    Neighbours are consecutive in `order`, and at most `farthest` [rad] apart.
    """
    edges = np.empty((len(order), 2), np.int64)
    count = 0
    # As names of their own, fields are fast.
    d_Wset, geometry = hits.d_Wset, hits.geometry
    for k in range(len(order) - 1):
        i, j = order[k], order[k + 1]
        if geometry[i] < 0 and geometry[j] < 0:
            continue
        # Chord and angle are the same at this size.
        x = d_Wset[i, 0] - d_Wset[j, 0]
        y = d_Wset[i, 1] - d_Wset[j, 1]
        z = d_Wset[i, 2] - d_Wset[j, 2]
        square = x * x + y * y + z * z
        if 0.0 < square <= farthest**2 and not _planes_meet(hits, i, hits, j):
            edges[count, 0], edges[count, 1] = i, j
            count += 1
    return edges[:count]


@compiled
def _planes_meet(a: BeamHits, i: int, b: BeamHits, j: int) -> bool:
    """Returns whether the planes at two hits coincide or meet between them."""
    if a.geometry[i] < 0 or b.geometry[j] < 0:
        return False
    # -n . d for the plane of each and the direction of the other.
    ij = ji = 0.0
    for axis in range(3):
        ij -= a.normals_W[i, axis] * b.d_Wset[j, axis]
        ji -= b.normals_W[j, axis] * a.d_Wset[i, axis]
    ii, jj = a.cosine[i], b.cosine[j]
    after = ij * b.ranges[j] - ii * a.ranges[i]
    before = jj * b.ranges[j] - ji * a.ranges[i]
    limit = _JUMP + _JUMP_PART * min(a.ranges[i], b.ranges[j])
    if min(abs(after), abs(before)) <= limit:
        return True
    # The inverse of the distance to a plane is linear from i to j. At a corner,
    # the nearer plane changes in between.
    return ii * jj > 0.0 and before * after <= 0.0
