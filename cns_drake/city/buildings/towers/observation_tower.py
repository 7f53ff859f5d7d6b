"""The observation tower: a slender shaft, a glazed pod, a mast."""

from __future__ import annotations

import itertools

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, tiers
from cns_drake.city.buildings.parts.facades import Band, Facade
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.mesh import Mesh

_SIDES = 16


class Parameters:
    """Parameters of an observation tower; lengths in metres."""

    def __init__(self, d: Dice) -> None:
        room = min(d.width, d.depth) / 2
        foot = round(d.uniform(0.3, 0.4) * room, 1)
        self.height = d.height
        self.pavilion_radius = round(d.uniform(0.8, 0.92) * room, 1)
        self.pavilion_height = d.uniform(4.5, 6.5, 1)
        self.foot_radius = foot
        self.neck_radius = round(d.uniform(0.5, 0.65) * foot, 1)
        self.ribs = d.pick((4, 8))
        self.pod_at = d.uniform(0.6, 0.7)
        self.pod_radius = round(d.uniform(0.75, 0.95) * room, 1)
        self.pod_floors = d.whole(2, 4)
        self.mast_share = d.uniform(0.14, 0.2)
        self.rgb = d.pick(((0.78, 0.77, 0.75), (0.66, 0.68, 0.72)))


def build(p: Parameters, out: Assembly) -> None:
    """Builds the tower in the middle of a rectangle."""
    x0, y0, x1, y1 = out.site.bounds
    center = ((x0 + x1) / 2, (y0 + y1) / 2)
    _add_pavilion(out, p, center)
    # Room for the bowl, the floors, the cone and some mast above it.
    above = 4.5 + 4.0 * p.pod_floors + 5.5 + 0.1 * p.height
    pod = round(min(p.pod_at * p.height, p.height - above), 1)
    profile = (
        (p.foot_radius, p.pavilion_height - 0.5),
        (0.5 * (p.foot_radius + p.neck_radius), 0.35 * pod),
        (p.neck_radius, 0.75 * pod),
        (p.neck_radius, pod + 1.0),
    )
    shaft = massing.revolved(profile, _SIDES, center)
    ribs = [_rib(p, center, 2 * np.pi * k / p.ribs, pod) for k in range(p.ribs)]
    out.add("shaft", shaft, *ribs)
    top = _add_pod(out, p, center, pod)
    _add_mast(out, p, center, top)


def _add_pavilion(out: Assembly, p: Parameters, center: massing.Point) -> None:
    h = p.pavilion_height
    # A flat side looks to the front, for the entrance.
    phase = -np.pi / 2 - np.pi / 12
    plan = massing.regular_polygon(p.pavilion_radius, 12, center, phase)
    pane = bays.ribbon(0.4, h - 1.4, 0.5, 0.3)
    side = details.WallFrame(plan, 0).length
    door = bays.alone(bays.entrance(2.2, 2.7, 0.9), min(3.6, side - 0.8))
    layout = bays.by_edge({0: door}, bays.rhythm(2.6, [pane], margin=0.4))
    bands = (Band(h - 1.0, h - 0.5, -0.9), Band(h - 0.5, h, -0.2))
    lid = massing.roof_pan(plan, h - 0.4, h, 0.3)
    walls = Facade(h, bands, layout, (0.5,))
    tiers.add_ground(out, plan, walls, [lid], part="pavilion")


def _rib(
    p: Parameters, center: massing.Point, angle: float, pod: float
) -> Mesh:
    """A fin that runs up the shaft, broad at its foot."""
    foot, neck = p.foot_radius, p.neck_radius
    lower = massing.rectangle(0.5 * neck, -0.35, foot + 1.0, 0.35)
    upper = massing.rectangle(0.5 * neck, -0.35, neck + 0.4, 0.35)
    fin = massing.frustum(lower, upper, p.pavilion_height - 0.5, 0.9 * pod)
    return fin.moved(yaw=angle).moved((*center, 0.0))


def _add_pod(
    out: Assembly, p: Parameters, center: massing.Point, z0: float
) -> float:
    """A bowl, floors of glass under ledges, and a cone on top."""
    r, floor, z = p.pod_radius, 4.0, z0 + 4.5
    bowl = ((p.neck_radius, z0), (0.7 * r, z0 + 2.2), (r, z))
    pieces = [massing.revolved(bowl, _SIDES, center)]
    wall = Facade(floor, (Band(0.0, 0.5, -0.4), Band(1.0, floor - 0.5, 0.3)))
    for k in range(p.pod_floors):
        ring = massing.regular_polygon(r * (1.0 - 0.1 * k), _SIDES, center)
        pieces.append(tiers.block(ring, wall, z))
        pieces.append(
            details.piers(ring, 99.0, 0.25, 0.1, z + 0.5, z + floor, depth=0.35)
        )
        z += floor
    neck, rim = 0.4 * r, r * (1.0 - 0.1 * (p.pod_floors - 1))
    cone = ((rim, z), (neck, z + 2.5), (neck, z + 5.5))
    out.add("pod", *pieces, massing.revolved(cone, _SIDES, center))
    return z + 5.5


def _add_mast(
    out: Assembly, p: Parameters, center: massing.Point, z0: float
) -> None:
    """Sections of a mast, each thinner than the one below it."""
    start = max(z0, p.height * (1.0 - p.mast_share))
    profile = [(1.4, z0 - 0.2), (1.4, start)] if start > z0 else []
    levels = itertools.pairwise(np.linspace(start, p.height, 5))
    for radius, (low, high) in zip((0.9, 0.65, 0.4, 0.2), levels, strict=True):
        profile += [(radius, low), (radius, high)]
    mast = massing.revolved(profile, 8, center)
    out.add("mast", mast, rgb=(0.75, 0.25, 0.2))
