"""Light through leaves and panes.

Leaves are a medium: a ray passes a distance s with the probability exp(-G LAD
s). LAD is the leaf area per volume. G is the fraction of that area that faces a
ray: 1/2 for leaves of all directions. All rays that enter a crown at the same
twig or clump of leaves pass the same leaf area before they hit a leaf, in every
scan of every drive.

A glass pane reflects the fraction R of the light like a mirror and transmits
the fraction T, by Fresnel's equations for both faces of the pane. Light returns
directly from a pane in two ways: scattered by dust on the pane, and mirrored if
the beam hits the pane at right angles.
"""

from typing import NamedTuple

import numpy as np

from cns_drake.sensors.returns.footprint import Sides
from cns_drake.sensors.returns.light import (
    BeamHits,
    Light,
    Shots,
    reflected_energy,
    reflected_light,
)
from cns_drake.sensors.returns.materials import GLASS, LEAVES, SPRAYS, Materials
from cns_drake.sensors.returns.random_numbers import cell_number
from cns_drake.sensors.returns.tables import join, select
from evaluation.base import compiled

# Refractive index of window glass near 900 nm.
_GLASS_INDEX = 1.52
# G of leaves of all directions.
_LEAF_PROJECTION = 0.5
# Leaf area of a spray: one ray in four passes it.
_SPRAY = 1.4
# How often a ray is continued at most.
_MOST_STEPS = 6
# A continued ray begins this far behind the surface [m].
_SKIN = 1e-3
# A ray is not continued if a white target right behind would return less than
# this SNR.
_FAINT_SNR = 3.0
# Panes are flat to within this angle [rad]. If the angle of incidence is below
# the sum of this angle and the beam's divergence, a pane mirrors light back to
# the unit.
_FLATNESS = 2e-3
# Cell size of clumps of leaves [m].
_CLUMP_SIZE = 0.5
# Cell size of twigs [m].
_TWIG_SIZE = 0.1
# Fraction of the space that clumps take.
_CLUMP_SHARE = 0.6


class Ways(NamedTuple):
    """N rays that continue beyond a hit, through leaves or from a pane.

    Attributes:
        beam: (N,) number of each ray's beam.
        p_Wset: (N, 3) current origins in the world [m].
        d_Wset: (N, 3) unit directions in the world.
        time: (N,) float32 firing time as a fraction of the revolution.
        length: (N,) length of the path so far [m].
        energy: (N,) fraction of the beam's light that reaches the origin and
            returns.
        depth: (N,) optical depth of foliage that each ray still passes before
            the ray hits a leaf.
        inside: (N,) index of the geometry inside which each ray begins; -1 for
            none.
        reach: (N,) float32, the range beyond which a ray need not be followed
            [m].
    """

    beam: np.ndarray
    p_Wset: np.ndarray
    d_Wset: np.ndarray
    time: np.ndarray
    length: np.ndarray
    energy: np.ndarray
    depth: np.ndarray
    inside: np.ndarray
    reach: np.ndarray


def start_ways(
    shots: Shots,
    rest: np.ndarray,
    hits: BeamHits,
    sides: Sides,
    side_hits: BeamHits,
) -> tuple[list[Light], Ways, BeamHits]:
    """Returns the light from the surfaces that beams hit first.

    A beam is represented by a ray along its axis and, near edges, by additional
    rays; each ray carries a fraction of the beam's light. Opaque surfaces
    return the light. Rays that hit panes or leaves can be followed further.

    Args:
        shots: the beams.
        rest: (N,) fraction of each beam's light that the ray along the axis
            carries.
        hits: hits of the rays along the axes.
        sides: the additional rays.
        side_hits: hits of the additional rays; rays without a hit are ignored.

    Returns:
        The light from opaque surfaces, the rays that hit panes or leaves, and
        the hits of these rays.
    """
    beam, materials = shots.beam, shots.materials
    is_open = np.isin(materials.kind, (GLASS, LEAVES, SPRAYS))
    axes = np.flatnonzero((hits.geometry >= 0) & (rest > 0.0))
    lit = np.flatnonzero(side_hits.geometry >= 0)
    onto_open = is_open[hits.geometry[axes]]
    side_onto_open = is_open[side_hits.geometry[lit]]
    k, n = axes[~onto_open], lit[~side_onto_open]
    lights = [
        reflected_light(
            beam[row],
            share[among],
            met.ranges[among],
            met.geometry[among],
            met.cosine[among],
            materials,
        )
        for row, share, met, among in (
            (k, rest, hits, k),
            (sides.row[n], sides.share, side_hits, n),
        )
    ]
    k, n = axes[onto_open], lit[side_onto_open]
    row = np.concatenate([k, sides.row[n]])
    met = join([select(hits, k), select(side_hits, n)])
    p_WSset = shots.p_WSset[row % len(shots.p_WSset)]
    ways = Ways(
        beam[row],
        p_WSset,
        met.d_Wset,
        shots.times[row % len(shots.times)],
        np.zeros(len(row)),
        np.concatenate([rest[k], sides.share[n]]),
        _leaf_areas(p_WSset + met.ranges[:, None] * met.d_Wset),
        np.full(len(row), -1, np.int32),
        np.full(len(row), np.inf, np.float32),
    )
    return lights, ways, met


@compiled
def _leaf_areas(p_Wset: np.ndarray) -> np.ndarray:
    """Returns the leaf areas (N,) that rays pass before they hit a leaf.

    The leaf areas are distributed exponentially with a mean of 1. They depend
    only on the places (N, 3) at which the rays enter the leaves.
    """
    result = np.empty(len(p_Wset))
    for k, (x, y, z) in enumerate(p_Wset):
        size = _CLUMP_SIZE
        # A second number from -1 to 1, independent of `share` below.
        if cell_number(z / size, x / size, y / size) > 2 * _CLUMP_SHARE - 1:
            size = _TWIG_SIZE
        share = cell_number(x / size, y / size, z / size)
        result[k] = -np.log(0.5 - 0.5 * share)
    return result


@compiled
def pane_shares(cosine: float) -> tuple[float, float]:
    """Returns the fractions of light that a pane reflects and transmits.

    `cosine` is the cosine of the angle of incidence.
    """
    n = _GLASS_INDEX
    sine = np.sqrt(max(1.0 - cosine**2, 0.0)) / n
    inner = np.sqrt(1.0 - sine**2)
    across = ((cosine - n * inner) / (cosine + n * inner)) ** 2
    along = ((inner - n * cosine) / (inner + n * cosine)) ** 2
    # Light is reflected between the faces many times; mean of both
    # polarisations.
    reflected = across / (1.0 + across) + along / (1.0 + along)
    return reflected, 1.0 - reflected


def follow(
    shots: Shots, ways: Ways, met: BeamHits, scale: float
) -> list[Light]:
    """Follows rays through panes and leaves; returns the light that comes back.

    Args:
        shots: the beams.
        ways: the rays.
        met: hits of these rays on panes and leaves.
        scale: `scale` of the `LinkBudget`, which determines what light is too
            faint to be followed.

    Returns:
        The light that comes back, as one `Light` for each step. In a step,
        every ray goes on to the next surface.
    """
    found: list[Light] = []
    for step in range(_MOST_STEPS):
        light, ways = _advance_to_hits(
            ways, met, shots.materials, scale, shots.divergence, shots.max_range
        )
        found.append(light)
        if not len(ways.beam) or step + 1 == _MOST_STEPS:
            break
        hits = shots.cast(ways.p_Wset, ways.d_Wset, ways.time, ways.reach)
        met = BeamHits.of(ways.d_Wset, hits)
    return found


@compiled
def _advance_to_hits(
    ways: Ways,
    met: BeamHits,
    materials: Materials,
    scale: float,
    divergence: float,
    max_range: float,
) -> tuple[Light, Ways]:
    """Advances each ray to its hit.

    Args:
        met: hits of the rays.
        materials: materials of all geometries.
        scale: `scale` of the `LinkBudget`.
        divergence: half angle of a beam [rad].
        max_range: greatest length of a path [m].

    Returns:
        The light that returns from the hits, and the rays that go on.
    """
    count = len(ways.beam)
    beam, distance = np.empty(count, np.int64), np.empty(count)
    energy, reflecting = np.empty(count), np.empty(count, np.int32)
    part = 0
    # The continued rays, at most two from each hit.
    before, d_Wset = np.empty(2 * count, np.int64), np.empty((2 * count, 3))
    share, depth = np.empty(2 * count), np.empty(2 * count)
    inside, reach = np.empty(2 * count, np.int32), np.empty(2 * count)
    way = 0
    flat = _FLATNESS + divergence
    for ray in range(count):
        medium, geometry = ways.inside[ray], met.geometry[ray]
        left, sent = ways.depth[ray], ways.energy[ray]
        length = ways.length[ray] + met.ranges[ray]
        if medium >= 0:
            density = materials.leaf_area_density[medium]
            left -= _optical_depth(density, met.ranges[ray])
            if left < 0.0:
                # Beyond the reach of the ray there is a leaf in any case.
                to_leaf = _path_length(density, ways.depth[ray])
                beam[part] = ways.beam[ray]
                distance[part] = ways.length[ray] + to_leaf
                energy[part] = sent * materials.reflectivity[medium]
                reflecting[part] = medium
                part += 1
                continue
        if geometry < 0:
            continue
        kind, cosine = materials.kind[geometry], met.cosine[ray]
        if kind == LEAVES or (kind == SPRAYS and left > _SPRAY):
            depth[way], inside[way], reach[way] = _beyond_leaves(
                kind,
                left,
                medium,
                geometry,
                materials.leaf_area_density[geometry],
                met.is_outside[ray],
            )
            before[way], share[way] = ray, 1.0
            reach[way] = min(reach[way], max_range - length)
            for axis in range(3):
                d_Wset[way, axis] = met.d_Wset[ray, axis]
            way += 1
            continue
        beam[part], distance[part] = ways.beam[ray], length
        energy[part] = reflected_energy(sent, geometry, cosine, materials)
        reflecting[part] = geometry
        if kind == GLASS:
            mirrored, through = pane_shares(cosine)
            if cosine > np.cos(flat):
                # The mirrored light fills a cone of the beam's width; a
                # Lambertian target spreads its light over the solid angle pi.
                energy[part] += sent * mirrored / flat**2
            for passing, turn in ((through, 0.0), (mirrored, 2.0 * cosine)):
                # Light passes the pane there and back.
                seen = np.sqrt(scale * passing**2 * sent / _FAINT_SNR)
                reach[way] = min(seen, max_range) - length
                if reach[way] > 0.0:
                    before[way], share[way] = ray, passing**2
                    depth[way], inside[way] = left, medium
                    for axis in range(3):
                        to_pane = turn * met.normals_W[ray, axis]
                        d_Wset[way, axis] = met.d_Wset[ray, axis] + to_pane
                    way += 1
        part += 1
    light = Light(
        beam[:part], distance[:part], energy[:part], reflecting[:part]
    )
    before, d_Wset = before[:way], d_Wset[:way]
    return light, Ways(
        ways.beam[before],
        _behind_hits(ways, met, before, d_Wset),
        d_Wset,
        ways.time[before],
        ways.length[before] + met.ranges[before],
        share[:way] * ways.energy[before],
        depth[:way],
        inside[:way],
        reach[:way].astype(np.float32),
    )


@compiled
def _optical_depth(density: float, length: float) -> float:
    """Returns the optical depth of a path [m] through leaves [1/m]."""
    return _LEAF_PROJECTION * density * length


@compiled
def _path_length(density: float, depth: float) -> float:
    """Returns the length of a path [m] of an optical depth in leaves [1/m]."""
    return depth / (_LEAF_PROJECTION * density)


@compiled
def _beyond_leaves(
    kind: int,
    left: float,
    medium: int,
    geometry: int,
    density: float,
    is_outside: bool,
) -> tuple[float, int, float]:
    """Returns how a ray goes on beyond the surface of a crown or a spray.

    Args:
        kind: `LEAVES` or `SPRAYS`.
        left: optical depth that the ray still passes at its hit.
        medium: index of the geometry inside which the ray is before; -1 for
            none.
        geometry: index of the geometry that the ray hits.
        density: leaf area density of that geometry [1/m].
        is_outside: whether the ray hits the outside of its surface.

    Returns:
        `depth`, `inside` and `reach` of `Ways`. `reach` is inf where nothing
        but the LiDAR's range limits it.
    """
    if kind == SPRAYS:
        return left - _SPRAY, medium, np.inf
    if is_outside:
        return left, geometry, _path_length(density, left)
    return left, -1, np.inf


@compiled
def _behind_hits(
    ways: Ways, met: BeamHits, before: np.ndarray, d_Wset: np.ndarray
) -> np.ndarray:
    """Returns points (M, 3) a little behind the hits of rays [m].

    Args:
        met: hits of the rays.
        before: (M,) rows of the rays.
        d_Wset: (M, 3) unit directions behind the hits.
    """
    result = np.empty((len(before), 3))
    for k, ray in enumerate(before):
        for axis in range(3):
            result[k, axis] = (
                ways.p_Wset[ray, axis]
                + met.ranges[ray] * ways.d_Wset[ray, axis]
                + _SKIN * d_Wset[k, axis]
            )
    return result
