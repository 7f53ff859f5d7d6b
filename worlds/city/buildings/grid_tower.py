"""The gridded office tower."""

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    bays,
    canopies,
    foot_band,
    solids,
    tiers,
)
from worlds.shapes import equip_roof, outlines

# Strip between the walls and the edge of the site [m].
_STRIP_M = 0.3
# Greatest number of windows around the whole tower.
_MOST_BAYS = 28
# Least height of a tower with a plant floor [m].
_PLANT_TOWER_M = 55.0
# Height of a plant floor [m].
_PLANT_M = 3.9
# Number of slats of the louvres of a plant floor.
_SLATS = 5
# Distance from one slat to the next [m].
_SLAT_PITCH_M = 0.6
# Height of the part of a beam that is above its storey's window [m].
_BEAM_ABOVE_M = 0.25
# Greatest number of parts of which a stretch of storeys consists.
_MOST_GROUPS = 7
# Width of the stretch of the front for the door [m].
_DOOR_BAY_M = 6.4


class GridTower(Building):
    """The gridded office tower: deep frames, louvred floors, offset slabs."""

    @property
    def margin(self) -> float:
        """Width of the plain wall between a corner and the first window [m]."""
        return self.recess + 0.15

    def draw(self) -> None:
        site = self.site
        # `box`, `offset` (two slabs that slide past each other) or `notched`.
        self.plan = self.pick(("box", "offset", "notched"))
        # How far the slabs slide, as a share of the width; or the size of the
        # notches, as a share of the shorter side.
        self.shift = self.uniform(0.1, 0.18)
        self.lobby = self.uniform(5.5, 8.0, digits=2)
        self.storey = self.uniform(3.5, 4.0)
        self.pitch = max(self.uniform(3.4, 5.0), site.open_length / _MOST_BAYS)
        # Width of the wall between windows side by side (pier), and its height
        # between windows one above another (beam).
        self.pier = self.uniform(0.5, 0.9, digits=2)
        self.beam = self.uniform(0.5, 0.9, digits=2)
        self.recess = self.uniform(0.4, 0.8, digits=2)
        # Whether each frame spans two storeys.
        self.double = self.chance(0.4)
        # Where a plant floor interrupts the grid, as a share of the height; 0
        # for none.
        self.waist = 0.0
        if self.height > _PLANT_TOWER_M:
            self.waist = self.uniform(0.45, 0.65)
        # Height of the screen around the roof.
        self.crown = self.uniform(2.4, 4.5, digits=2)
        self.roof_items = self.draw_roof_items(
            "lift_house cooling_tower air_handler cooling_tower mast ac_unit",
            low=3,
            high=7,
        )

    def build(self) -> None:
        plan = np.round(_outline(self), 2)
        top = _add_lobby(self, plan)
        if self.waist > 0:
            top = _add_grid(self, plan, top, self.waist * self.height, "low")
            top = _add_plant_floor(self, plan, top)
        top = _add_grid(self, plan, top, self.height - self.crown, "storey")
        self._add_roof_screen(plan, top)

    def _add_roof_screen(self, plan: np.ndarray, z0: float) -> None:
        """Adds a louvred screen around the roof, and equipment behind it.

        `plan` contains the corners (N, 2) of the walls, and `z0` is the height
        of the screen's foot [m].
        """
        rim = round(self.height - z0, 3)
        louvre = bays.window(
            width=self.pitch - self.pier, sill=0.5, head=rim - 0.5, depth=0.25
        )
        louvres = bays.rhythm(self.pitch, [louvre], margin=self.margin)
        crown = Facade(
            rim, bands=(foot_band(height=0.25, reach=0.1),), layout=louvres
        )
        roof = tiers.add_crown(
            self, plan, crown, z0=z0, parapet=rim - 0.6, thickness=0.45
        )
        free = outlines.inset(plan, 0.5)
        equip_roof(self, free, roof, self.roof_items, clear=0.8)


def _outline(tower: GridTower) -> np.ndarray:
    """Returns the outline, slightly within the site; the front comes first."""
    x0, y0, x1, y1 = tower.site.bounds
    base = outlines.rectangle(
        x0 + _STRIP_M, y0 + _STRIP_M, x1 - _STRIP_M, y1 - _STRIP_M
    )
    if tower.plan == "notched":
        return outlines.notched(
            base, tower.shift * outlines.shortest_side(base)
        )
    if tower.plan == "box":
        return base
    # The front slab slides to the left, the one behind it to the right.
    (x0, y0), (x1, y1) = base[0], base[2]
    shift, middle = tower.shift * (x1 - x0), (y0 + y1) / 2
    return np.array(
        [
            (x0, y0),
            (x1 - shift, y0),
            (x1 - shift, middle),
            (x1, middle),
            (x1, y1),
            (x0 + shift, y1),
            (x0 + shift, middle),
            (x0, middle),
        ]
    )


def _add_lobby(tower: GridTower, plan: np.ndarray) -> float:
    """Adds a tall glazed hall behind the piers; returns its top [m]."""
    height = tower.lobby
    pane = bays.window(
        width=tower.pitch - tower.pier,
        sill=0.3,
        head=height - 1.2,
        depth=tower.recess,
        transom=3.2,
    )
    glazing = bays.rhythm(tower.pitch, [pane], margin=tower.margin)
    door = bays.entrance(
        width=3.6, height=3.2, depth=tower.recess + 0.6, surround=0.15
    )
    walls = Facade(
        height,
        bands=(Band(z0=height - 0.9, z1=height - 0.2, depth=-0.12),),
        layout=bays.with_door(glazing, door, width=_DOOR_BAY_M),
        glass=(tower.recess,),
    )
    half = min(4.5, WallFrame(plan, 0).length / 2 - 0.6)
    canopy = canopies.front_canopy(plan, half=half, reach=1.6, z=3.7)
    return tiers.add_ground(tower, plan, walls, extras=[canopy])


def _add_grid(
    tower: GridTower, plan: np.ndarray, z0: float, goal: float, part: str
) -> float:
    """Adds storeys behind frames up to about `goal`; returns their top [m]."""
    unit = tower.storey * (2 if tower.double else 1)
    groups, per_group, height = tiers.storey_groups(
        goal - z0, storey=unit, most=_MOST_GROUPS
    )
    # Part of the beam closes the storey at its top.
    low, high = round(tower.beam - _BEAM_ABOVE_M, 2), height - _BEAM_ABOVE_M
    frame = bays.window(
        width=tower.pitch - tower.pier,
        sill=low,
        head=high,
        depth=tower.recess,
        pier=tower.pier / 2,
        transom=round((low + high) / 2, 2) if tower.double else None,
    )
    layout = bays.rhythm(tower.pitch, [frame], margin=tower.margin)
    facade = Facade(height, layout=layout, glass=(tower.recess,))
    return tiers.add_storeys(
        tower,
        plan,
        facade,
        z0=z0,
        groups=groups,
        per_group=per_group,
        part=part,
    )


def _add_plant_floor(tower: GridTower, plan: np.ndarray, z0: float) -> float:
    """Adds a floor of louvres behind the grid; returns its top [m]."""
    inner = outlines.inset(plan, tower.recess)
    slats = [
        Band(
            z0=round(0.4 + _SLAT_PITCH_M * k, 2),
            z1=round(0.7 + _SLAT_PITCH_M * k, 2),
            depth=0.18,
        )
        for k in range(_SLATS)
    ]
    walls = Facade(_PLANT_M, bands=tuple(slats))
    tower.add("plant", tiers.lidded_walls(inner, walls, z0))
    top = round(z0 + _PLANT_M, 3)
    for z, up in ((z0, True), (top, False)):
        tower.add(f"ledge_{int(up)}", solids.flat(plan, z, up=up))
    return top
