"""The art-deco tower."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    bays,
    canopies,
    outlines,
    solids,
    tiers,
)


class ArtDecoTower(Building):
    """The art-deco tower: symmetric setbacks, tall piers, a stepped crown."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        # Where each tier above the base starts, as a share of the height.
        starts = self.pick(((0.5,), (0.3, 0.62)))
        share = 0.24 if len(starts) == 2 else 0.4
        # Of each of these tiers: the height at which it starts, as a share of
        # the tower's height; how far it steps back across the front and along
        # the sides; and a share by which the start is shifted.
        self.steps = [
            (
                start,
                share * self.uniform(0.3, 0.9) * site.depth / 2,
                share * self.uniform(0.6, 1.2) * site.width / 2,
                self.uniform(-0.04, 0.04),
            )
            for start in starts
        ]
        self.ground_height = self.uniform(6.5, 8.5, 2)
        self.grooves = tiers.Grooves(
            storey_height=self.uniform(3.4, 3.8),
            spandrel=self.uniform(1.1, 1.6, 2),
            recess=self.uniform(0.2, 0.4, 2),
            pitch=max(self.uniform(2.6, 3.6), site.open_length / 34),
            pier=self.uniform(0.8, 1.4, 2),
            pier_reach=self.uniform(0.2, 0.34, 2),
            solid_corner=self.uniform(1.4, 2.4, 2),
        )
        self.portal_width = self.uniform(4.0, 5.5, 1)
        self.crown_steps = self.whole(2, 5)
        # Height of the spire, as a share of the height of the crown.
        self.spire = self.uniform(0.35, 0.6)
        self.notch = self.pick((0.0, 1.2, 2.0))

    def build(self) -> None:
        """Adds all parts of the art-deco tower.

        The building's site must be a rectangle.
        """
        base = self.site.outline
        plan = outlines.notched(base, self.notch) if self.notch else base
        top = _add_ground(self, plan)
        crown_height = round(min(0.16 * self.height, 16.0), 1)
        across = along = 0.0
        for k, (start, a, b, jitter) in enumerate(self.steps):
            goal = round(self.height * (start + jitter), 1)
            part = f"tier_{k}"
            top = tiers.add_grooved(
                self, plan, self.grooves, top, goal, part, 1.7
            )
            edges = (Band(0.0, 0.3, -0.12), Band(1.0, 1.3, -0.1))
            parapet = Facade(1.3, edges)
            part = f"terrace_{k}"
            tiers.add_crown(self, plan, parapet, top, 1.1, part=part)
            across, along = across + a, along + b
            step = (round(across, 1), round(along, 1)) * 2
            plan = outlines.inset(base, step)
            plan = outlines.notched(plan, self.notch) if self.notch else plan
        goal = round(self.height - crown_height, 1)
        part = f"tier_{k + 1}"
        top = tiers.add_grooved(self, plan, self.grooves, top, goal, part, 1.7)
        _add_crown(self, plan, top)


def _add_ground(p: ArtDecoTower, plan: np.ndarray) -> float:
    h = p.ground_height
    portal = bays.entrance(p.portal_width, h - 1.6, 1.4, surround=0.3)
    arch = bays.arched(3.4, 0.5, 3.2, 0.5)
    arches = bays.rhythm(1.7 * p.grooves.pitch, [arch], margin=1.4)
    bands = (Band(h - 0.7, h - 0.4, -0.15), Band(h - 0.4, h, -0.3))
    layout = bays.with_door(arches, portal, p.portal_width + 2.0)
    roof = canopies.front_canopy(plan, 2.4, 1.4, 3.6)
    return tiers.add_ground(p, plan, Facade(h, bands, layout, (0.5,)), [roof])


def _add_crown(p: ArtDecoTower, plan: np.ndarray, z0: float) -> None:
    pieces = []
    height = p.height - z0
    step = round((1.0 - p.spire) * height / p.crown_steps, 2)
    side = outlines.shortest_side(plan)
    bands = (Band(0.6, 0.5 * step, 0.25), Band(step - 0.4, step, -0.25))
    for k in range(p.crown_steps):
        pieces.append(
            tiers.lidded_walls(plan, Facade(step, bands), z0 + k * step)
        )
        plan = outlines.inset(plan, 0.28 * side / p.crown_steps)
    z = z0 + p.crown_steps * step
    pieces.append(solids.spire(plan, np.mean(plan, axis=0), z, z0 + height))
    p.add("crown", *pieces)
