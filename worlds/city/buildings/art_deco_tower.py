"""The art-deco tower."""

from typing import NamedTuple

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    bays,
    canopies,
    foot_band,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import outlines

# Where each tier above the base starts, as shares of the tower's height.
_TIER_STARTS = ((0.5,), (0.3, 0.62))
# Greatest number of piers around the whole tower.
_MOST_PIERS = 34
# How far the piers of a tier rise above its topmost storey [m].
_PIER_RISE_M = 1.7
# Height of the walls around a terrace [m].
_TERRACE_WALL_M = 1.3
# Height of the crown, as a share of the tower's height.
_CROWN_SHARE = 0.16
# Greatest height of the crown [m].
_MOST_CROWN_M = 16.0
# By how much all steps of the crown narrow it, as a share of its shorter side.
_CROWN_TAPER = 0.28
# Depth of the arched windows of the ground floor [m].
_ARCH_RECESS_M = 0.5


class _Setback(NamedTuple):
    """Where a tier above the base starts, and how far it steps back.

    Attributes:
        start: height of the tier's foot, as a share of the tower's height.
        across: step back at the front and the back [m].
        along: step back at the two sides [m].
    """

    start: float
    across: float
    along: float


class ArtDecoTower(Building):
    """The art-deco tower: symmetric setbacks, tall piers, a stepped crown."""

    def draw(self) -> None:
        site = self.site
        starts = self.pick(_TIER_STARTS)
        # Two tiers step back less than one tier.
        share = 0.24 if len(starts) == 2 else 0.4
        self.setbacks = [self._draw_setback(start, share) for start in starts]
        self.ground_height = self.uniform(6.5, 8.5, digits=2)
        self.grooves = tiers.Grooves(
            storey_height=self.uniform(3.4, 3.8),
            spandrel=self.uniform(1.1, 1.6, digits=2),
            recess=self.uniform(0.2, 0.4, digits=2),
            pitch=max(self.uniform(2.6, 3.6), site.open_length / _MOST_PIERS),
            pier=self.uniform(0.8, 1.4, digits=2),
            pier_reach=self.uniform(0.2, 0.34, digits=2),
            solid_corner=self.uniform(1.4, 2.4, digits=2),
        )
        self.portal_width = self.uniform(4.0, 5.5, digits=1)
        self.crown_steps = self.whole(2, 5)
        # Height of the spire, as a share of the height of the crown.
        self.spire = self.uniform(0.35, 0.6)
        self.notch = self.pick((0.0, 1.2, 2.0))

    def _draw_setback(self, start: float, share: float) -> _Setback:
        """Returns a random setback.

        Args:
            start: height of the tier's foot, as a share of the tower's height,
                before a random shift.
            share: how far the tier steps back, as a share of half the site.
        """
        site = self.site
        across = share * self.uniform(0.3, 0.9) * site.depth / 2
        along = share * self.uniform(0.6, 1.2) * site.width / 2
        return _Setback(start + self.uniform(-0.04, 0.04), across, along)

    def build(self) -> None:
        base = self.site.outline
        plan = self._with_notches(base)
        top = _add_ground(self, plan)
        crown_height = round(min(_CROWN_SHARE * self.height, _MOST_CROWN_M), 1)
        across = along = 0.0
        for k, setback in enumerate(self.setbacks):
            goal = round(self.height * setback.start, 1)
            top = _add_tier(self, plan, top, goal, part=f"tier_{k}")
            _add_terrace(self, plan, top, part=f"terrace_{k}")
            across, along = across + setback.across, along + setback.along
            step = (round(across, 1), round(along, 1)) * 2
            plan = self._with_notches(outlines.inset(base, step))
        goal = round(self.height - crown_height, 1)
        part = f"tier_{len(self.setbacks)}"
        top = _add_tier(self, plan, top, goal, part)
        _add_crown(self, plan, top)

    def _with_notches(self, plan: np.ndarray) -> np.ndarray:
        """Returns an outline (N, 2) with notched corners, if the tower has any.

        `plan` contains the corners (4, 2) of a rectangle [m].
        """
        return outlines.notched(plan, self.notch) if self.notch else plan


def _add_tier(
    tower: ArtDecoTower, plan: np.ndarray, z0: float, goal: float, part: str
) -> float:
    """Adds storeys between piers, from `z0` to about `goal` [m].

    Returns the height of the topmost storey's top [m].
    """
    return tiers.add_grooved(
        tower,
        plan,
        tower.grooves,
        z0=z0,
        goal=goal,
        part=part,
        rise=_PIER_RISE_M,
    )


def _add_terrace(
    tower: ArtDecoTower, plan: np.ndarray, z0: float, part: str
) -> None:
    """Adds the parapet and the floor of the terrace on top of a tier."""
    height = _TERRACE_WALL_M
    edges = (
        foot_band(height=0.3, reach=0.12),
        Band(z0=1.0, z1=height, depth=-0.1),
    )
    walls = Facade(height, bands=edges)
    tiers.add_crown(tower, plan, walls, z0=z0, parapet=1.1, part=part)


def _add_ground(tower: ArtDecoTower, plan: np.ndarray) -> float:
    """Adds a ground floor with arched windows and a portal in front.

    Returns the height of its top [m].
    """
    height = tower.ground_height
    portal = bays.entrance(
        width=tower.portal_width, height=height - 1.6, depth=1.4, surround=0.3
    )
    arch = bays.arched(width=3.4, bottom=0.5, spring=3.2, depth=_ARCH_RECESS_M)
    arches = bays.rhythm(1.7 * tower.grooves.pitch, [arch], margin=1.4)
    walls = Facade(
        height,
        bands=(
            Band(z0=height - 0.7, z1=height - 0.4, depth=-0.15),
            top_band(height, height=0.4, reach=0.3),
        ),
        layout=bays.with_door(arches, portal, width=tower.portal_width + 2.0),
        glass=(_ARCH_RECESS_M,),
    )
    canopy = canopies.front_canopy(plan, half=2.4, reach=1.4, z=3.6)
    return tiers.add_ground(tower, plan, walls, extras=[canopy])


def _add_crown(tower: ArtDecoTower, plan: np.ndarray, z0: float) -> None:
    """Adds steps that narrow towards the top, and a spire on them."""
    pieces = []
    height = tower.height - z0
    step = round((1.0 - tower.spire) * height / tower.crown_steps, 2)
    side = outlines.shortest_side(plan)
    bands = (
        Band(z0=0.6, z1=0.5 * step, depth=0.25),
        top_band(step, height=0.4, reach=0.25),
    )
    walls = Facade(step, bands=bands)
    for k in range(tower.crown_steps):
        pieces.append(tiers.lidded_walls(plan, walls, z0 + k * step))
        plan = outlines.inset(plan, _CROWN_TAPER * side / tower.crown_steps)
    z = z0 + tower.crown_steps * step
    tip = np.mean(plan, axis=0)
    pieces.append(solids.spire(plan, tip, z0=z, z1=z0 + height))
    tower.add("crown", *pieces)
