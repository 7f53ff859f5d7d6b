"""The art-deco tower: symmetric setbacks, tall piers, a stepped crown."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.parts import (
    bays,
    details,
    massing,
    outlines,
    tiers,
)
from cns_drake.city.buildings.parts.facades import Band, Facade
from cns_drake.city.buildings.parts.site import Assembly, Dice

_STONES = ((0.76, 0.70, 0.60), (0.68, 0.64, 0.58), (0.70, 0.58, 0.48))


class Parameters:
    """Parameters of an art-deco tower; lengths in metres.

    `steps` has, for each tier above the base, where it starts (as a
    fraction of the height) and how far it steps back across the front and
    along the sides.
    """

    def __init__(self, d: Dice):
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


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the tower on a rectangle."""
    base = assembly.site.outline
    plan = outlines.notched(base, p.notch) if p.notch else base
    top = _add_ground(assembly, p, plan)
    crown_height = round(min(0.16 * p.height, 16.0), 1)
    goals = [p.height * f for f, _, _ in p.steps] + [p.height - crown_height]
    for k, goal in enumerate(goals):
        goal = round(goal, 1)
        top = tiers.add_grooved(
            assembly, plan, p.wall, top, goal, f"tier_{k}", rise=1.7
        )
        if k == len(goals) - 1:
            break
        _add_terrace(assembly, plan, top, k)
        _, across, along = p.steps[k]
        plan = massing.inset(base, (across, along, across, along))
        plan = outlines.notched(plan, p.notch) if p.notch else plan
    _add_crown(assembly, p, plan, top)


def _add_ground(assembly, p: Parameters, plan) -> float:
    h = p.ground_height
    wall = details.WallFrame(plan, 0)
    portal = bays.entrance(p.portal_width, h - 1.6, 1.4, surround=0.3)
    arches = bays.rhythm(
        1.7 * p.wall.pitch, [bays.arched(3.4, 0.5, 3.2, 0.5)], margin=1.4
    )
    ground = Facade(
        h,
        (Band(h - 0.7, h - 0.4, -0.15), Band(h - 0.4, h, -0.3)),
        bays.by_edge(
            {0: bays.with_middle(arches, portal, p.portal_width + 2.0)}, arches
        ),
        glass=(0.5,),
    )
    middle = wall.length / 2
    roof = details.canopy(middle - 2.4, middle + 2.4, 1.4, 3.6)
    return tiers.add_ground(assembly, plan, ground, [wall.place(roof)])


def _add_terrace(assembly, plan, z, k) -> None:
    parapet = Facade(1.3, (Band(0.0, 0.3, -0.12), Band(1.0, 1.3, -0.1)))
    tiers.add_crown(assembly, plan, parapet, z, 1.1, part=f"terrace_{k}")


def _add_crown(assembly, p: Parameters, plan, z0) -> None:
    pieces = []
    height = p.height - z0
    step = round((1.0 - p.spire) * height / p.crown_steps, 2)
    side = massing.shortest_side(plan)
    for k in range(p.crown_steps):
        step_bands = (
            Band(0.6, 0.5 * step, 0.25),
            Band(step - 0.4, step, -0.25),
        )
        ledge = Facade(step, step_bands)
        pieces.append(tiers.block(plan, ledge, z0 + k * step))
        plan = massing.inset(plan, 0.28 * side / p.crown_steps)
    z = z0 + p.crown_steps * step
    middle = np.mean(plan, axis=0)
    pieces.append(massing.spire(plan, middle, z, z0 + height))
    assembly.add("crown", *pieces)
