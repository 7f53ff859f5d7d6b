"""The art-deco tower: symmetric setbacks, tall piers, a stepped crown."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.walls import Band, Facade

_STONES = ((0.76, 0.70, 0.60), (0.68, 0.64, 0.58), (0.70, 0.58, 0.48))


class Parameters:
    """Parameters of an art-deco tower; lengths in metres.

    `steps` has, for each tier above the base, where it starts (as a
    fraction of the height) and how far it steps back across the front and
    along the sides.
    """

    def __init__(self, d: Dice) -> None:
        starts = d.pick(((0.5,), (0.3, 0.62)))
        share = 0.24 if len(starts) == 2 else 0.4
        steps, across, along = ([], 0.0, 0.0)
        for start in starts:
            across += share * d.uniform(0.3, 0.9) * d.depth / 2
            along += share * d.uniform(0.6, 1.2) * d.width / 2
            jitter = d.uniform(-0.04, 0.04)
            steps.append((start + jitter, round(across, 1), round(along, 1)))
        self.height = d.height
        self.ground_height = d.uniform(6.5, 8.5, 2)
        self.wall = tiers.Grooves(
            storey_height=d.uniform(3.4, 3.8),
            spandrel=d.uniform(1.1, 1.6, 2),
            ledge=0.0,
            glass_depth=d.uniform(0.2, 0.4, 2),
            pitch=max(d.uniform(2.6, 3.6), d.site.open_length / 34),
            width=d.uniform(0.8, 1.4, 2),
            reach=d.uniform(0.2, 0.34, 2),
            corner=d.uniform(1.4, 2.4, 2),
        )
        self.steps = tuple(steps)
        self.portal_width = d.uniform(4.0, 5.5, 1)
        self.crown_steps = d.whole(2, 5)
        self.spire = d.uniform(0.35, 0.6)
        self.notch = d.pick((0.0, 1.2, 2.0))
        self.rgb = d.pick(_STONES)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the tower on a rectangle."""
    base = out.site.outline
    plan = massing.notched(base, p.notch) if p.notch else base
    top = _add_ground(out, p, plan)
    crown_height = round(min(0.16 * p.height, 16.0), 1)
    goals = [p.height * f for f, _, _ in p.steps] + [p.height - crown_height]
    for k, goal in enumerate(goals):
        goal = round(goal, 1)
        top = tiers.add_grooved(
            out, plan, p.wall, top, goal, f"tier_{k}", rise=1.7
        )
        if k == len(goals) - 1:
            break
        _add_terrace(out, plan, top, k)
        _, across, along = p.steps[k]
        plan = massing.inset(base, (across, along, across, along))
        plan = massing.notched(plan, p.notch) if p.notch else plan
    _add_crown(out, p, plan, top)


def _add_ground(out: Assembly, p: Parameters, plan: np.ndarray) -> float:
    h = p.ground_height
    portal = bays.entrance(p.portal_width, h - 1.6, 1.4, surround=0.3)
    arch = bays.arched(3.4, 0.5, 3.2, 0.5)
    arches = bays.rhythm(1.7 * p.wall.pitch, [arch], margin=1.4)
    bands = (Band(h - 0.7, h - 0.4, -0.15), Band(h - 0.4, h, -0.3))
    layout = bays.with_door(arches, portal, p.portal_width + 2.0)
    roof = details.front_canopy(plan, 2.4, 1.4, 3.6)
    return tiers.add_ground(out, plan, Facade(h, bands, layout, (0.5,)), [roof])


def _add_terrace(out: Assembly, plan: np.ndarray, z: float, k: int) -> None:
    parapet = Facade(1.3, (Band(0.0, 0.3, -0.12), Band(1.0, 1.3, -0.1)))
    tiers.add_crown(out, plan, parapet, z, 1.1, part=f"terrace_{k}")


def _add_crown(
    out: Assembly, p: Parameters, plan: np.ndarray, z0: float
) -> None:
    pieces = []
    height = p.height - z0
    step = round((1.0 - p.spire) * height / p.crown_steps, 2)
    side = massing.shortest_side(plan)
    bands = (Band(0.6, 0.5 * step, 0.25), Band(step - 0.4, step, -0.25))
    for k in range(p.crown_steps):
        pieces.append(tiers.block(plan, Facade(step, bands), z0 + k * step))
        plan = massing.inset(plan, 0.28 * side / p.crown_steps)
    z = z0 + p.crown_steps * step
    pieces.append(massing.spire(plan, np.mean(plan, axis=0), z, z0 + height))
    out.add("crown", *pieces)
