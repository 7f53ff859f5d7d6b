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
from typing import NamedTuple, TypeVar

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.ray_casting_scene import RayHits
from cns_drake.sensors.returns.counter_random import uniform
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.link_budget import LinkBudget
from cns_drake.sensors.returns.materials import (
    BEADS,
    GLASS,
    LEAVES,
    RETRO,
    Materials,
)
from cns_drake.sensors.returns.met import Met

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
# The sheeting of signs and plates works up to this angle of incidence.
_RETRO_COSINE = np.cos(np.deg2rad(60.0))
# Panes are flat to this angle: within it and the beam's own they send the
# mirrored light back to the unit [rad].
_FLATNESS = 2e-3
# Numbers of a beam's draws for leaves, one for each of its rays.
_LEAF_DRAW = 8

_Numbers = TypeVar("_Numbers", float, np.ndarray)
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
        time: (N,) part of the turn at which it was sent.
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

    @classmethod
    def room_for(cls, count: int) -> Ways:
        """Returns rays to fill in."""
        return cls(
            np.empty(count, np.int64),
            np.empty(count, np.int64),
            np.empty((count, 3)),
            np.empty((count, 3)),
            np.empty(count, np.float32),
            np.empty(count),
            np.empty(count),
            np.empty(count),
            np.empty(count, np.int32),
            np.empty(count, np.float32),
        )

    def first(self, count: int) -> Ways:
        """Returns the first rays."""
        return Ways(*(values[:count] for values in self))


@compiled
def pane_shares(cosine: _Numbers) -> tuple[_Numbers, _Numbers]:
    """Returns the reflected and the transmitted part of light at a pane.

    Args:
        cosine: of the angle of incidence, one or many.
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
    met: Met,
    materials: Materials,
    budget: LinkBudget,
    divergence: float,
    max_range: float,
    cast: Cast,
) -> list[Light]:
    """Returns the light that comes back.

    Args:
        key: of the frame; see `frame_key`.
        ways: the rays of the beams.
        met: their hits.
        materials: of all geometries.
        budget: of the unit.
        divergence: half angle of a beam [rad].
        max_range: greatest distance of followed light [m].
        cast: casts the continued rays.
    """
    found: list[Light] = []
    for step in range(_MOST_STEPS):
        count = len(met.geometry)
        light, next_ways = Light.room_for(count), Ways.room_for(2 * count)
        num_parts, num_ways = _step(
            key,
            ways,
            met,
            materials,
            budget.scale,
            divergence,
            max_range,
            light,
            next_ways,
        )
        found.append(light.first(num_parts))
        if num_ways == 0 or step + 1 == _MOST_STEPS:
            break
        ways = next_ways.first(num_ways)
        hits = cast(ways.p_Wset, ways.d_Wset, ways.time, ways.reach)
        met = Met.of(ways.d_Wset, hits)
    return found


@compiled
def _step(
    key: np.uint64,
    ways: Ways,
    met: Met,
    materials: Materials,
    scale: float,
    divergence: float,
    max_range: float,
    light: Light,
    next_ways: Ways,
) -> tuple[int, int]:
    """Takes each ray to its hit.

    Args:
        key, ways, met, materials, divergence, max_range: see `follow`.
        scale: of the budget.
        light: to fill with returning light.
        next_ways: to fill with continued rays.

    Returns:
        The numbers of parts of light, and of rays.
    """
    flat = _FLATNESS + divergence
    num_parts, num_ways = 0, 0
    mirrored = np.empty(3)
    for i in range(len(met.geometry)):
        geometry, way = met.geometry[i], met.ranges[i]
        depth, inside = ways.depth[i], ways.inside[i]
        if inside >= 0:
            # Beyond the reach of the ray there is a leaf in any case.
            per_metre = _LEAF_PROJECTION * materials.leaf_area_density[inside]
            left = depth - per_metre * way
            if left < 0.0:
                light.beam[num_parts] = ways.beam[i]
                light.distance[num_parts] = ways.length[i] + depth / per_metre
                light.energy[num_parts] = (
                    ways.energy[i] * materials.reflectivity[inside]
                )
                light.geometry[num_parts] = inside
                num_parts += 1
                continue
            depth = left
        if geometry < 0:
            continue
        length = ways.length[i] + way
        kind = materials.kind[geometry]
        d_W, normal_W = met.d_Wset[i], met.normals_W[i]
        if kind == LEAVES:
            inside = -1
            if met.is_outside[i]:
                inside = geometry
                if depth == np.inf:
                    depth = leaf_depth(key, ways.beam[i], ways.sub[i])
            _go_on(ways, i, way, d_W, 1.0, next_ways, num_ways)
            next_ways.depth[num_ways] = depth
            next_ways.inside[num_ways] = inside
            next_ways.reach[num_ways] = max_range - length
            if inside >= 0:
                per_metre = (
                    _LEAF_PROJECTION * materials.leaf_area_density[inside]
                )
                next_ways.reach[num_ways] = min(
                    depth / per_metre, max_range - length
                )
            num_ways += 1
            continue
        cosine = met.cosine[i]
        add_light(
            light,
            num_parts,
            ways.beam[i],
            length,
            materials,
            geometry,
            cosine,
            ways.energy[i],
        )
        if kind == GLASS:
            reflected, through = pane_shares(cosine)
            if cosine > np.cos(flat):
                # The mirrored light fills a cone of the beam's width; a
                # Lambertian target spreads its own over pi.
                light.energy[num_parts] += ways.energy[i] * reflected / flat**2
            for axis in range(3):
                mirrored[axis] = d_W[axis] + 2.0 * cosine * normal_W[axis]
            # Light passes the pane there and back.
            for is_mirrored in (False, True):
                share = (reflected if is_mirrored else through) ** 2
                d_on = mirrored if is_mirrored else d_W
                seen = np.sqrt(scale * share * ways.energy[i] / _FAINT_SNR)
                reach = min(seen, max_range) - length
                if reach > 0.0:
                    _go_on(ways, i, way, d_on, share, next_ways, num_ways)
                    next_ways.depth[num_ways] = depth
                    next_ways.inside[num_ways] = inside
                    next_ways.reach[num_ways] = reach
                    num_ways += 1
        num_parts += 1
    return num_parts, num_ways


@compiled
def add_light(
    light: Light,
    part: int,
    beam: int,
    distance: float,
    materials: Materials,
    geometry: int,
    cosine: float,
    share: float,
) -> None:
    """Fills in the light that a surface reflects of a part of a beam."""
    light.beam[part] = beam
    light.distance[part] = distance
    energy = share * materials.reflectivity[geometry]
    kind = materials.kind[geometry]
    if kind == RETRO:
        energy *= cosine > _RETRO_COSINE
    elif kind != BEADS:
        energy *= cosine
    light.energy[part] = energy
    light.geometry[part] = geometry


@compiled
def _go_on(
    ways: Ways,
    i: int,
    way: float,
    d_Wset: np.ndarray,
    share: float,
    next_ways: Ways,
    row: int,
) -> None:
    """Continues a ray behind the surface, in a new direction."""
    next_ways.beam[row] = ways.beam[i]
    next_ways.sub[row] = ways.sub[i]
    next_ways.time[row] = ways.time[i]
    next_ways.length[row] = ways.length[i] + way
    next_ways.energy[row] = share * ways.energy[i]
    for axis in range(3):
        next_ways.d_Wset[row, axis] = d_Wset[axis]
        next_ways.p_Wset[row, axis] = (
            ways.p_Wset[i, axis]
            + way * ways.d_Wset[i, axis]
            + _SKIN * d_Wset[axis]
        )


@compiled
def leaf_depth(key: np.uint64, beam: int, sub: int) -> float:
    """Returns the leaf area that a ray passes before it meets a leaf.

    It is exponential with a mean of 1.
    """
    return -np.log(1.0 - uniform(key, beam, _LEAF_DRAW + sub))
