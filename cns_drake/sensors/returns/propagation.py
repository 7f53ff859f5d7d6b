"""The ways of light through leaves and panes.

Leaves are a medium: a ray gets through a way s with the probability
exp(-G LAD s), where LAD is the leaf area in a volume and G = 1/2 the part of
it that leaves of all directions turn to a ray.

A pane reflects R of the light like a mirror and lets T through, by Fresnel's
equations for both of its faces. What dust on it scatters comes back directly,
as does the mirrored light where the beam meets the pane at right angles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.ray_casting_scene import RayHits
from cns_drake.sensors.returns.counter_random import uniform
from cns_drake.sensors.returns.link_budget import LinkBudget
from cns_drake.sensors.returns.materials import (
    GLASS,
    LEAVES,
    RETRO,
    Materials,
)

# Refractive index of window glass near 900 nm.
_GLASS_INDEX = 1.52
# G of leaves of all directions.
_LEAF_PROJECTION = 0.5
# How often a ray goes on at most.
_MOST_STEPS = 6
# A ray that goes on begins this far behind what it met [m].
_SKIN = 1e-3
# Light is not followed where a white target right behind would send back less
# than this SNR.
_FAINT_SNR = 3.0
# A retro-reflector works up to this angle of incidence.
_RETRO_COSINE = np.cos(np.deg2rad(60.0))
# Panes are flat to this angle: within it and the beam's own they send the
# mirrored light back to the unit [rad].
_FLATNESS = 2e-3
_LEAF_DRAW = 2

# Casts rays of origins (N, 3), directions (N, 3) and times (N,).
Cast = Callable[[np.ndarray, np.ndarray, np.ndarray], RayHits]


# Fields of `Light`: beam, distance, energy, geometry.
Part = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Ways(NamedTuple):
    """N rays on their way.

    Attributes:
        beam: (N,) number of the beam of each.
        sub: (N,) number of the ray among those of its beam.
        p_Wset: (N, 3) where each begins now.
        d_Wset: (N, 3) where it goes.
        time: (N,) part of the turn at which it was sent.
        length: (N,) how far light has come before [m].
        energy: (N,) part of the beam that is sent, and that gets back.
        depth: (N,) leaf area that is still in its way.
        inside: (N,) geometry in which it begins, -1 for none.
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

    def take(self, rows: np.ndarray) -> Ways:
        """Returns the rays of some rows."""
        return Ways(*(values[rows] for values in self))

    def go_on(self, ranges: np.ndarray, d_Wset: np.ndarray) -> Ways:
        """Returns the rays behind what they met, in new directions."""
        p_Wset = self.p_Wset + ranges[:, None] * self.d_Wset + _SKIN * d_Wset
        return self._replace(
            p_Wset=p_Wset, d_Wset=d_Wset, length=self.length + ranges
        )


@compiled
def leaf_depths(
    key: np.uint64, beam: np.ndarray, sub: np.ndarray, depth: np.ndarray
) -> None:
    """Fills in leaf areas that rays pass before they meet a leaf.

    Args:
        key: of the frame; see `frame_key`.
        beam, sub: (N,) which ray.
        depth: (N,) to fill, exponential with a mean of 1.
    """
    for i in range(len(beam)):
        draw = uniform(key, beam[i], _LEAF_DRAW + sub[i])
        depth[i] = -np.log(1.0 - draw)


def pane_shares(cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns what a pane reflects, and what it lets through.

    Args:
        cosine: (N,) of the angle of incidence.
    """
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / _GLASS_INDEX
    inner = np.sqrt(1.0 - sine**2)
    n = _GLASS_INDEX
    across = ((cosine - n * inner) / (cosine + n * inner)) ** 2
    along = ((inner - n * cosine) / (inner + n * cosine)) ** 2
    # Light goes to and fro between the faces; both polarisations.
    reflected = across / (1.0 + across) + along / (1.0 + along)
    return reflected, 1.0 - reflected


def follow(
    ways: Ways,
    hits: RayHits,
    materials: Materials,
    budget: LinkBudget,
    divergence: float,
    cast: Cast,
) -> list[Part]:
    """Returns the light that comes back, as fields of `Light`.

    Args:
        ways: the rays of the beams.
        hits: what they meet.
        materials: of all geometries.
        budget: of the unit.
        divergence: half angle of a beam [rad].
        cast: casts the rays that go on.
    """
    found: list[Part] = []
    for _ in range(_MOST_STEPS):
        rows = np.flatnonzero(hits.geometry >= 0)
        if len(rows) < len(hits.geometry):
            ways, hits = ways.take(rows), hits.take(rows)
        kind = materials.kind[hits.geometry]
        is_stopped = np.zeros(len(kind), bool)
        going_on = []
        is_leaf = kind == LEAVES
        if is_leaf.any() or (ways.inside >= 0).any():
            depths, is_stopped = _pass_leaves(ways, hits, materials)
            found.append(
                _leaf_light(ways, materials, np.flatnonzero(is_stopped))
            )
            ways = ways._replace(depth=depths)
            going_on.append(
                _cross_leaves(ways, hits, np.flatnonzero(is_leaf & ~is_stopped))
            )
        solid = np.flatnonzero(~is_leaf & ~is_stopped)
        cosine = np.abs(np.einsum("ij,ij->i", hits.normals_W, ways.d_Wset))
        found.append(
            _sent_back(ways, hits, materials, cosine, solid, divergence)
        )
        panes = np.flatnonzero((kind == GLASS) & ~is_stopped)
        if len(panes):
            going_on += _through_panes(ways, hits, cosine, panes, budget)
        sent = [rays for rays in going_on if len(rays.beam)]
        if not sent:
            break
        ways = Ways(
            *(np.concatenate(fields) for fields in zip(*sent, strict=True))
        )
        hits = cast(ways.p_Wset, ways.d_Wset, ways.time)
    return found


def _sent_back(
    ways: Ways,
    hits: RayHits,
    materials: Materials,
    cosine: np.ndarray,
    rows: np.ndarray,
    divergence: float,
) -> Part:
    """Returns the light that surfaces send straight back."""
    geometry, cosine = hits.geometry[rows], cosine[rows]
    kind = materials.kind[geometry]
    rho = materials.reflectivity[geometry]
    energy = rho * cosine
    is_retro = kind == RETRO
    energy[is_retro] = rho[is_retro] * (cosine[is_retro] > _RETRO_COSINE)
    is_mirror = (kind == GLASS) & (cosine > np.cos(_FLATNESS + divergence))
    if is_mirror.any():
        reflected, _ = pane_shares(cosine[is_mirror])
        # The mirrored light fills a cone of the beam's width; a Lambertian
        # target spreads its own over pi.
        energy[is_mirror] += reflected / (_FLATNESS + divergence) ** 2
    distance = ways.length[rows] + hits.ranges[rows]
    return ways.beam[rows], distance, energy * ways.energy[rows], geometry


def _through_panes(
    ways: Ways,
    hits: RayHits,
    cosine: np.ndarray,
    rows: np.ndarray,
    budget: LinkBudget,
) -> list[Ways]:
    """Returns the rays behind panes, and those that panes mirror."""
    rays, cosine = ways.take(rows), cosine[rows]
    ranges = hits.ranges[rows].astype(float)
    normals = hits.normals_W[rows].astype(float)
    reflected, through = pane_shares(cosine)
    mirrored = rays.d_Wset + 2.0 * cosine[:, None] * normals
    on = []
    # Light passes the pane there and back.
    for share, d_Wset in ((through**2, rays.d_Wset), (reflected**2, mirrored)):
        next_rays = rays.go_on(ranges, d_Wset)
        next_rays = next_rays._replace(energy=rays.energy * share)
        snr = budget.scale * next_rays.energy / next_rays.length**2
        on.append(next_rays.take(np.flatnonzero(snr > _FAINT_SNR)))
    return on


def _pass_leaves(
    ways: Ways, hits: RayHits, materials: Materials
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the leaf area that is left, and which rays ended at leaves.

    The area is negative for those.
    """
    density = np.where(
        ways.inside >= 0, materials.leaf_area_density[ways.inside], 0.0
    )
    left = ways.depth - _LEAF_PROJECTION * density * hits.ranges
    return left, left < 0.0


def _leaf_light(ways: Ways, materials: Materials, rows: np.ndarray) -> Part:
    """Returns the light of leaves inside of volumes."""
    geometry = ways.inside[rows]
    density = materials.leaf_area_density[geometry]
    inner = ways.depth[rows] / (_LEAF_PROJECTION * density)
    return (
        ways.beam[rows],
        ways.length[rows] + inner,
        ways.energy[rows] * materials.reflectivity[geometry],
        geometry,
    )


def _cross_leaves(ways: Ways, hits: RayHits, rows: np.ndarray) -> Ways:
    """Returns rays that enter or leave a volume of leaves."""
    rays = ways.take(rows)
    entered = np.where(hits.is_outside[rows], hits.geometry[rows], -1)
    on = rays.go_on(hits.ranges[rows].astype(float), rays.d_Wset)
    return on._replace(inside=entered)
