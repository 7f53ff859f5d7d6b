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
        self.ground_height = self.uniform(6.5, 8.5, digits=2)
        self.grooves = tiers.Grooves(
            storey_height=self.uniform(3.4, 3.8),
            spandrel=self.uniform(1.1, 1.6, digits=2),
            recess=self.uniform(0.2, 0.4, digits=2),
            pitch=max(self.uniform(2.6, 3.6), site.open_length / 34),
            pier=self.uniform(0.8, 1.4, digits=2),
            pier_reach=self.uniform(0.2, 0.34, digits=2),
            solid_corner=self.uniform(1.4, 2.4, digits=2),
        )
        self.portal_width = self.uniform(4.0, 5.5, digits=1)
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
                self, plan, self.grooves, z0=top, goal=goal, part=part, rise=1.7
            )
            edges = (
                Band(z0=0.0, z1=0.3, depth=-0.12),
                Band(z0=1.0, z1=1.3, depth=-0.1),
            )
            parapet = Facade(1.3, bands=edges)
            part = f"terrace_{k}"
            tiers.add_crown(self, plan, parapet, z0=top, parapet=1.1, part=part)
            across, along = across + a, along + b
            step = (round(across, 1), round(along, 1)) * 2
            plan = outlines.inset(base, step)
            plan = outlines.notched(plan, self.notch) if self.notch else plan
        goal = round(self.height - crown_height, 1)
        part = f"tier_{k + 1}"
        top = tiers.add_grooved(
            self, plan, self.grooves, z0=top, goal=goal, part=part, rise=1.7
        )
        _add_crown(self, plan, top)


def _add_ground(tower: ArtDecoTower, plan: np.ndarray) -> float:
    h = tower.ground_height
    portal = bays.entrance(
        width=tower.portal_width, height=h - 1.6, depth=1.4, surround=0.3
    )
    arch = bays.arched(width=3.4, bottom=0.5, spring=3.2, depth=0.5)
    arches = bays.rhythm(1.7 * tower.grooves.pitch, [arch], margin=1.4)
    bands = (
        Band(z0=h - 0.7, z1=h - 0.4, depth=-0.15),
        Band(z0=h - 0.4, z1=h, depth=-0.3),
    )
    layout = bays.with_door(arches, portal, width=tower.portal_width + 2.0)
    roof = canopies.front_canopy(plan, half=2.4, reach=1.4, z=3.6)
    return tiers.add_ground(
        tower,
        plan,
        Facade(h, bands=bands, layout=layout, glass=(0.5,)),
        extras=[roof],
    )


def _add_crown(tower: ArtDecoTower, plan: np.ndarray, z0: float) -> None:
    pieces = []
    height = tower.height - z0
    step = round((1.0 - tower.spire) * height / tower.crown_steps, 2)
    side = outlines.shortest_side(plan)
    bands = (
        Band(z0=0.6, z1=0.5 * step, depth=0.25),
        Band(z0=step - 0.4, z1=step, depth=-0.25),
    )
    for k in range(tower.crown_steps):
        pieces.append(
            tiers.lidded_walls(plan, Facade(step, bands=bands), z0 + k * step)
        )
        plan = outlines.inset(plan, 0.28 * side / tower.crown_steps)
    z = z0 + tower.crown_steps * step
    pieces.append(
        solids.spire(plan, np.mean(plan, axis=0), z0=z, z1=z0 + height)
    )
    tower.add("crown", *pieces)
