"""The width of a beam: rays in its parts beside an edge.

A beam's irradiance falls as exp(-2 r^2 / w^2) with the distance r from its
axis; w is its radius at 1 / e^2. If the neighbour of a beam meets another
surface, a ray at a random place of the beam's half on that side represents the
half. The surface that it meets gets that part of the light. The mean over beams
is then that of the whole profile.
"""

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.base.elementary import cos, log, sin
from cns_drake.sensors.returns.light import BeamHits, dot, select
from cns_drake.sensors.returns.random_numbers import uniform

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
        row: (P,) row of the beam.
        neighbour: (P,) row of the beam beyond the edge.
        number: (P,) number of the side of the beam: 0 and 1 in the first order
            of beams, 2 and 3 in the second one.
        share: (P,) part of the beam's light.
        d_Wset: (P, 3) directions.
        reach: (P,) float32: beyond the nearer of both surfaces [m].
    """

    row: np.ndarray
    neighbour: np.ndarray
    number: np.ndarray
    share: np.ndarray
    d_Wset: np.ndarray
    reach: np.ndarray


def find_sides(
    key: np.uint64,
    beam: np.ndarray,
    orders: np.ndarray,
    hits: BeamHits,
    divergence: float,
    max_range: float,
) -> Sides:
    """Returns rays to cast where neighbours meet different surfaces.

    Two neighbours meet one surface, or two that touch, if one place is on the
    plane of the other, or both planes meet in between. Otherwise an edge is
    between them: within one of their beams, or in the gap.

    Args:
        key: the frame's; see `frame_key`.
        beam: (N,) number of each beam.
        orders: (2, N) orders of the rays in which neighbours follow.
        hits: by the axes of the beams.
        divergence: half angle of a beam [rad].
        max_range: range of the rays [m].
    """
    farthest = _NEIGHBOURS * divergence
    edges = [_find_edges(order, hits, farthest) for order in orders]
    row = np.concatenate([pairs.ravel() for pairs in edges])
    neighbour = np.concatenate([pairs[:, ::-1].ravel() for pairs in edges])
    number = np.concatenate(
        [np.tile([2 * k, 2 * k + 1], len(edges[k])) for k in range(len(edges))]
    )
    # Unit vectors across the beams, to the neighbours.
    d, d_j = hits.d_Wset[row], hits.d_Wset[neighbour]
    toward = d_j - dot(d, d_j)[:, None] * d
    toward /= np.sqrt(dot(toward, toward))[:, None]
    share = _share(len(beam), row, number, toward)
    kept = share > 0.0
    row, neighbour, number = row[kept], neighbour[kept], number[kept]
    d, toward, share = d[kept], toward[kept], share[kept]

    # Random places of the sides.
    draw = _SIDE_DRAW + 2 * number
    rest = 1.0 - uniform(key, beam[row], draw)
    radius = divergence * np.sqrt(-0.5 * log(rest))
    turn = uniform(key, beam[row], draw + 1) - 0.5
    angle = 2.0 * np.pi * share * turn
    d_Wset = (
        d
        + (radius * cos(angle))[:, None] * toward
        + (radius * sin(angle))[:, None] * np.cross(d, toward)
    )
    d_Wset /= np.sqrt(dot(d_Wset, d_Wset))[:, None]
    is_nearer = hits.ranges[row] <= hits.ranges[neighbour]
    near = select(hits, np.where(is_nearer, row, neighbour))
    far_range = hits.ranges[np.where(is_nearer, neighbour, row)]
    reach = np.maximum(_range_on(near, d_Wset), near.ranges)
    reach = np.minimum(reach, far_range) + (_JUMP + _JUMP_PART * near.ranges)
    reach = np.minimum(reach, max_range).astype(np.float32)
    return Sides(row, neighbour, number, share, d_Wset, reach)


@compiled
def _share(
    num_beams: int, row: np.ndarray, number: np.ndarray, toward: np.ndarray
) -> np.ndarray:
    """Returns the (P,) part of the light at each side.

    A side has half of the beam, or a quarter if there are edges at other sides,
    too. A second neighbour on the same side has no part.

    Args:
        num_beams: the number of beams.
        row, number: see `Sides`.
        toward: (P, 3) directions to the neighbours.
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


def meet_sides(
    sides: Sides, side_hits: BeamHits, hits: BeamHits
) -> tuple[np.ndarray, BeamHits]:
    """Divides the light of beams among their axes and their sides.

    A ray that passes the nearer of two surfaces has met the farther one, on its
    plane.

    Args:
        sides: see `find_sides`.
        side_hits: by their rays within their reach.
        hits: by the axes of N beams.

    Returns:
        The (N,) part of each beam's light that its axis stands for; and the
        hits by the rays of sides. Those that meet the surface of their beam
        become misses, those that pass the nearer surface become hits.
    """
    beyond = select(hits, sides.neighbour)
    is_miss = side_hits.geometry < 0
    passes = is_miss & (hits.ranges[sides.row] <= beyond.ranges)
    is_own = _find_touching(sides.row, hits, side_hits)
    is_lit = np.where(is_miss, passes, ~is_own)
    rest = np.ones(len(hits.ranges))
    np.subtract.at(rest, sides.row[is_lit], sides.share[is_lit])

    distance = _range_on(beyond, sides.d_Wset)
    is_far = (sides.reach < distance) & (distance < 2.0 * beyond.ranges)
    distance = np.where(is_far, distance, beyond.ranges)
    met = beyond._replace(
        d_Wset=sides.d_Wset, ranges=distance.astype(np.float32)
    )
    passes &= beyond.geometry >= 0
    shown = BeamHits(
        *(
            np.where(passes if new.ndim == 1 else passes[:, None], new, old)
            for new, old in zip(met, side_hits, strict=True)
        )
    )
    shown.geometry[is_own] = -1
    return rest, shown


def _range_on(hits: BeamHits, d_Wset: np.ndarray) -> np.ndarray:
    """Returns the (N,) ranges of rays at the planes of hits [m].

    It is inf where a ray does not meet the plane, or there is no hit.

    Args:
        hits: N of them.
        d_Wset: (N, 3) directions of the rays.
    """
    along = -dot(hits.normals_W, d_Wset)
    result = np.full(len(along), np.inf)
    k = np.flatnonzero((hits.geometry >= 0) & (along > 0.0))
    result[k] = hits.cosine[k] * hits.ranges[k] / along[k]
    return result


@compiled
def _find_edges(
    order: np.ndarray, hits: BeamHits, farthest: float
) -> np.ndarray:
    """Returns the (E, 2) rows of neighbours with an edge between them.

    NumPy takes five times as long, a tenth of a frame.

    Args:
        order: (N,) rows of the beams, neighbours beside each other.
        hits: by the axes of the beams.
        farthest: greatest angle between neighbours [rad].
    """
    edges, count = np.empty((len(order), 2), np.int64), 0
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
        if 0.0 < square <= farthest**2 and not _touch(hits, i, hits, j):
            edges[count, 0], edges[count, 1] = i, j
            count += 1
    return edges[:count]


@compiled
def _find_touching(
    rows: np.ndarray, hits: BeamHits, side_hits: BeamHits
) -> np.ndarray:
    """Returns the (P,) bool whether each side meets its beam's surface."""
    touch = np.empty(len(rows), np.bool_)
    for side in range(len(rows)):
        touch[side] = _touch(hits, rows[side], side_hits, side)
    return touch


@compiled
def _touch(a: BeamHits, i: int, b: BeamHits, j: int) -> bool:
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
    after = ij * b.ranges[j] - ii * a.ranges[i]
    before = jj * b.ranges[j] - ji * a.ranges[i]
    limit = _JUMP + _JUMP_PART * min(a.ranges[i], b.ranges[j])
    if min(abs(after), abs(before)) <= limit:
        return True
    # The inverse of the distance to a plane is linear from i to j. At a corner,
    # the nearer plane changes in between.
    return ii * jj > 0.0 and before * after <= 0.0
