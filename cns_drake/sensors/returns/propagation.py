"""Light through leaves and panes.

Leaves are a medium: a ray passes a distance s with the probability exp(-G LAD
s). LAD is the leaf area in a volume, and G = 1/2 the part of it that faces a
ray, for leaves of all directions.

A pane reflects R of the light like a mirror and lets T through, by Fresnel's
equations for both of its faces. Light scattered by dust on it comes back
directly, and so does mirrored light if the beam meets the pane at right angles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cns_drake.ray_casting.ray_casting_scene import RayHits
from cns_drake.sensors.returns.footprint import Sides
from cns_drake.sensors.returns.light import (
    BeamHits,
    Light,
    join,
    reflect,
    select,
)
from cns_drake.sensors.returns.link_budget import LinkBudget
from cns_drake.sensors.returns.materials import GLASS, LEAVES, Materials
from cns_drake.sensors.returns.random_numbers import uniform

# Refractive index of window glass near 900 nm.
_GLASS_INDEX = 1.52
# G of leaves of all directions.
_LEAF_PROJECTION = 0.5
# Greatest number of continuations of a ray.
_MOST_STEPS = 6
# A continued ray begins this far behind the surface [m].
_SKIN = 1e-3
# Light is not followed if a white target right behind would give less than this
# SNR.
_FAINT_SNR = 3.0
# Panes are flat to this angle: within it and the beam's own they send the
# mirrored light back to the unit [rad].
_FLATNESS = 2e-3
# Numbers of a beam's draws for leaves, one for each of its rays.
_LEAF_DRAW = 8

# Casts rays of origins (N, 3), directions (N, 3) and times (N,), each no
# farther than its own reach (N,).
Cast = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], RayHits]


class Ways(NamedTuple):
    """N rays on their way.

    Attributes:
        beam: (N,) number of the beam of each.
        sub: (N,) number of the ray among those of its beam; 0 for its axis.
        p_Wset: (N, 3) present origins.
        d_Wset: (N, 3) directions.
        time: (N,) float32 part of the turn at which it was sent.
        length: (N,) distance of the light so far [m].
        energy: (N,) part of the beam that gets here and back.
        depth: (N,) leaf area that is still to pass; inf before the first
            leaves.
        inside: (N,) geometry in which it begins, -1 for none.
        reach: (N,) float32: greatest useful range of the ray [m].
    """

    beam: np.ndarray
    sub: np.ndarray
    p_Wset: np.ndarray
    d_Wset: np.ndarray
    time: np.ndarray
    length: np.ndarray
    energy: np.ndarray
    depth: np.ndarray
    inside: np.ndarray
    reach: np.ndarray


def start_ways(
    beam: np.ndarray,
    p_WSset: np.ndarray,
    times: np.ndarray,
    rest: np.ndarray,
    hits: BeamHits,
    sides: Sides,
    side_hits: BeamHits,
    materials: Materials,
) -> tuple[Light, Ways, BeamHits]:
    """Returns what opaque surfaces send back, and the rays that meet others.

    Args:
        beam: (N,) number of each beam.
        p_WSset: (K, 3) positions of S, taken in turn.
        times: (T,) float32 parts of the turn, taken in turn.
        rest: (N,) part of the light that its axis represents.
        hits: by the axes of the beams.
        sides: rays at the sides of beams.
        side_hits: by those; misses do not count.
        materials: materials of all geometries.

    Returns:
        The light, the rays that meet panes or leaves, and what they meet.
    """
    is_open = np.isin(materials.kind, (GLASS, LEAVES))
    axes = np.flatnonzero((hits.geometry >= 0) & (rest > 0.0))
    lit = np.flatnonzero(side_hits.geometry >= 0)
    onto_open = is_open[hits.geometry[axes]]
    side_onto_open = is_open[side_hits.geometry[lit]]
    k, n = axes[~onto_open], lit[~side_onto_open]
    share, distance, geometry, cosine = (
        np.concatenate([of_axes[k], of_sides[n]])
        for of_axes, of_sides in (
            (rest, sides.share),
            (hits.ranges, side_hits.ranges),
            (hits.geometry, side_hits.geometry),
            (hits.cosine, side_hits.cosine),
        )
    )
    light = reflect(
        beam[np.concatenate([k, sides.row[n]])],
        share,
        distance,
        geometry,
        cosine,
        materials,
    )
    k, n = axes[onto_open], lit[side_onto_open]
    row = np.concatenate([k, sides.row[n]])
    met = join([select(hits, k), select(side_hits, n)])
    ways = Ways(
        beam[row],
        np.concatenate([np.zeros_like(k), 1 + sides.number[n]]),
        p_WSset[row % len(p_WSset)],
        met.d_Wset,
        times[row % len(times)],
        np.zeros(len(row)),
        np.concatenate([rest[k], sides.share[n]]),
        np.full(len(row), np.inf),
        np.full(len(row), -1, np.int32),
        np.full(len(row), np.inf, np.float32),
    )
    return light, ways, met


def pane_shares(cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the reflected and the transmitted part of light at a pane.

    Args:
        cosine: cosines of angles of incidence.
    """
    n = _GLASS_INDEX
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / n
    inner = np.sqrt(1.0 - sine**2)
    across = ((cosine - n * inner) / (cosine + n * inner)) ** 2
    along = ((inner - n * cosine) / (inner + n * cosine)) ** 2
    # Light is reflected between the faces many times; mean of both
    # polarisations.
    reflected = across / (1.0 + across) + along / (1.0 + along)
    return reflected, 1.0 - reflected


def follow(
    key: np.uint64,
    ways: Ways,
    met: BeamHits,
    materials: Materials,
    budget: LinkBudget,
    divergence: float,
    max_range: float,
    cast: Cast,
) -> list[Light]:
    """Returns the light that comes back.

    Args:
        key: the frame's; see `frame_key`.
        ways: the rays of the beams.
        met: their hits.
        materials: materials of all geometries.
        budget: the unit's.
        divergence: half angle of a beam [rad].
        max_range: greatest distance of followed light [m].
        cast: casts the continued rays.
    """
    found: list[Light] = []
    for _ in range(_MOST_STEPS - 1):
        light, ways = _step(
            key, ways, met, materials, budget.scale, divergence, max_range
        )
        found.append(light)
        if not len(ways.beam):
            return found
        hits = cast(ways.p_Wset, ways.d_Wset, ways.time, ways.reach)
        met = BeamHits.of(ways.d_Wset, hits)
    light, _ = _step(
        key, ways, met, materials, budget.scale, divergence, max_range
    )
    return [*found, light]


def _step(
    key: np.uint64,
    ways: Ways,
    met: BeamHits,
    materials: Materials,
    scale: float,
    divergence: float,
    max_range: float,
) -> tuple[Light, Ways]:
    """Takes each ray to its hit.

    Args:
        key, ways, met, materials, divergence, max_range: see `follow`.
        scale: see `LinkBudget`.

    Returns:
        The returning light, and the continued rays.
    """
    # Beyond the reach of a ray in leaves there is a leaf in any case.
    is_in = np.flatnonzero(ways.inside >= 0)
    per_metre = _LEAF_PROJECTION * materials.leaf_area_density
    passed = per_metre[ways.inside[is_in]]
    left = ways.depth[is_in] - passed * met.ranges[is_in]
    is_caught = left < 0.0
    caught = is_in[is_caught]
    leaf = ways.inside[caught]
    depth = ways.depth.copy()
    in_leaves = Light(
        ways.beam[caught],
        ways.length[caught] + depth[caught] / passed[is_caught],
        ways.energy[caught] * materials.reflectivity[leaf],
        leaf,
    )
    depth[is_in] = left

    is_hit = met.geometry >= 0
    is_hit[caught] = False
    length = ways.length + met.ranges
    kind = materials.kind[met.geometry]

    # Into leaves, or out of them.
    into = np.flatnonzero(is_hit & (kind == LEAVES))
    inside = np.where(met.is_outside[into], met.geometry[into], -1)
    entered = np.flatnonzero(inside >= 0)
    first = into[entered][np.isinf(depth[into[entered]])]
    drawn = uniform(key, ways.beam[first], _LEAF_DRAW + ways.sub[first])
    # The leaf area before the first leaf is exponential with a mean of 1.
    depth[first] = -np.log(1.0 - drawn)

    solid = np.flatnonzero(is_hit & (kind != LEAVES))
    light = reflect(
        ways.beam[solid],
        ways.energy[solid],
        length[solid],
        met.geometry[solid],
        met.cosine[solid],
        materials,
    )
    is_pane = kind[solid] == GLASS
    panes = solid[is_pane]
    d_W, cosine, energy = (
        met.d_Wset[panes],
        met.cosine[panes],
        ways.energy[panes],
    )
    reflected, through = pane_shares(cosine)
    # The mirrored light fills a cone of the beam's width; a Lambertian target
    # spreads its own over pi.
    flat = _FLATNESS + divergence
    blinding = np.where(cosine > np.cos(flat), energy * reflected / flat**2, 0)
    light.energy[is_pane] += blinding
    mirrored = d_W + (2.0 * cosine)[:, None] * met.normals_W[panes]

    rows = np.concatenate([into, panes, panes])
    d_Wset = np.concatenate([met.d_Wset[into], d_W, mirrored])
    inside = np.concatenate([inside, ways.inside[panes], ways.inside[panes]])
    # Light passes the pane there and back.
    share = np.concatenate([np.ones(len(into)), through**2, reflected**2])
    seen = np.sqrt(scale * share * ways.energy[rows] / _FAINT_SNR)
    seen[: len(into)] = np.inf
    reach = np.minimum(seen, max_range) - length[rows]
    reach[entered] = np.minimum(
        depth[into[entered]] / per_metre[inside[entered]], reach[entered]
    )
    goes_on = reach > 0.0
    goes_on[: len(into)] = True
    # Rays of a beam stay together, which makes casting them cheap.
    kept = np.flatnonzero(goes_on)
    kept = kept[np.argsort(rows[kept], kind="stable")]
    rows, d_Wset = rows[kept], d_Wset[kept]
    begin = ways.p_Wset[rows] + met.ranges[rows, None] * ways.d_Wset[rows]
    next_ways = Ways(
        ways.beam[rows],
        ways.sub[rows],
        begin + _SKIN * d_Wset,
        d_Wset,
        ways.time[rows],
        length[rows],
        share[kept] * ways.energy[rows],
        depth[rows],
        inside[kept],
        reach[kept].astype(np.float32),
    )
    return join([in_leaves, light]), next_ways
