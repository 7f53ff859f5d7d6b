"""The slab tower: a concrete slab block with loggias."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    around,
    bays,
    foot_band,
    outlines,
    solids,
    tiers,
    top_band,
)

# Height of the walls above the topmost storey [m].
_PARAPET_M = 1.2
# How far the stair tower rises above the slab [m].
_STAIR_RISE_M = 2.4
_ROOF_ITEMS = ("tank", "tank", "mast", "vents", "stair_house", "dish")


class SlabTower(Building):
    """The concrete slab block: loggias, a stair tower, pillars, a pavilion."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.ground_height = self.uniform(4.2, 5.2, digits=2)
        self.storey_height = self.uniform(2.9, 3.2)
        self.depth = round(min(site.depth, self.uniform(13.0, 17.0)), 1)
        self.at_back = self.chance(0.5)
        self.stair_width = self.uniform(4.0, 6.0, digits=1)
        self.stair_left = self.chance(0.5)
        self.pitch = max(self.uniform(3.4, 5.0), site.width / 11)
        self.loggia_depth = self.uniform(1.2, 1.7, digits=2)
        self.rail = self.uniform(0.9, 1.1, digits=2)
        self.window_recess = self.uniform(0.15, 0.3, digits=2)
        self.pavilion_height = self.uniform(4.0, 5.5, digits=1)

    def build(self) -> None:
        """Adds all parts of the slab block, whose longer sides lie along x.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y1 - self.depth if self.at_back else y0
        back = front + self.depth
        split = (
            x0 + self.stair_width if self.stair_left else x1 - self.stair_width
        )
        stair, ends = (split, x1), (x0, split)
        if self.stair_left:
            stair, ends = ends, stair
        slab = outlines.rectangle(ends[0], front, ends[1], back)
        top = _add_hall(self, slab)
        goal = self.height - _STAIR_RISE_M - _PARAPET_M
        groups, per_group, storey = tiers.storey_groups(
            goal - top, storey=self.storey_height, most=7
        )
        walls = _storey_walls(self, storey)
        top = tiers.add_storeys(
            self, slab, walls, z0=top, groups=groups, per_group=per_group
        )
        bands = (
            foot_band(height=0.25, reach=0.12),
            Band(z0=1.0, z1=_PARAPET_M, depth=-0.12),
        )
        crown = Facade(_PARAPET_M, bands=bands)
        tiers.add_crown(
            self, slab, crown, z0=top, parapet=0.9, items=_ROOF_ITEMS
        )
        shaft = outlines.rectangle(stair[0], front + 1.2, stair[1], back - 1.2)
        _add_stair(self, shaft)
        room = front - y0 if self.at_back else y1 - back
        if room > 9.0:
            ys = (y0, front - 1.0) if self.at_back else (back + 1.0, y1)
            _add_pavilion(self, (x0, x1), ys)


def _add_hall(block: SlabTower, slab: np.ndarray) -> float:
    """Adds a glazed hall behind the slab's pillars; returns its top [m]."""
    h = block.ground_height
    hall = outlines.inset(slab, (2.4, 0.4, 2.4, 0.4))
    pane = bays.ribbon(sill=0.5, head=h - 0.6, depth=0.25, post=0.3)
    glazing = bays.rhythm(block.pitch, [pane], margin=0.6)
    door = bays.with_middle(
        glazing, bays.entrance(width=2.2, height=2.8, depth=0.6), width=4.0
    )
    layout = bays.by_edge({0: door, 2: door}, glazing)
    walls = Facade(
        h,
        bands=(foot_band(height=0.5, reach=0.1),),
        layout=layout,
        glass=(0.25,),
    )
    pieces = [solids.flat(slab, h, up=False)]
    for edge in (0, 2):
        wall = WallFrame(slab, edge)
        for a, b in bays.stretches(
            wall.length, pitch=1.2 * block.pitch, margin=0.3
        ):
            x = round((a + b) / 2, 2)
            pieces.append(wall.standing(x=around(x, 0.3), y=(-1.5, -0.2), z1=h))
    return tiers.add_ground(block, hall, walls, extras=pieces)


def _storey_walls(block: SlabTower, storey: float) -> Facade:
    head = round(storey - 0.3, 2)
    loggia = bays.loggia(
        width=block.pitch - 0.3,
        depth=block.loggia_depth,
        rail=block.rail,
        head=head,
    )
    window = bays.window(
        width=1.9, sill=0.9, head=head - 0.2, depth=block.window_recess
    )
    slit = bays.alone(
        bays.window(width=1.4, sill=0.2, head=head, depth=block.window_recess),
        width=2.4,
    )
    layouts = {
        0: bays.rhythm(block.pitch, [loggia], margin=0.4),
        2: bays.rhythm(block.pitch / 1.4, [window], margin=0.5),
    }
    glass = (block.loggia_depth + 0.15, block.window_recess)
    layout = bays.by_edge(layouts, slit)
    return Facade(
        storey,
        bands=(foot_band(height=0.15, reach=0.06),),
        layout=layout,
        glass=glass,
    )


def _add_stair(block: SlabTower, shaft: np.ndarray) -> None:
    """Adds a stair tower beside the slab, with a window slit of full height."""
    slit = bays.window(width=1.2, sill=1.0, head=block.height - 2.0, depth=0.3)
    height = block.height
    walls = tiers.shaft_walls(
        height=height,
        entry=slit,
        slit=slit,
        room=2.0,
        rim=top_band(height, height=0.5, reach=0.15),
    )
    block.add(
        "stairs",
        solids.foundation(shaft),
        tiers.lidded_walls(shaft, walls, 0.0),
    )


def _add_pavilion(block: SlabTower, xs: bays.Span, ys: bays.Span) -> None:
    """Adds a low glazed pavilion in the open part of the site."""
    width = 0.55 * (xs[1] - xs[0])
    left = xs[0] if block.stair_left else xs[1] - width
    depth = min(ys[1] - ys[0], 14.0)
    plan = outlines.rectangle(left, ys[0], left + width, ys[0] + depth)
    h = block.pavilion_height
    pane = bays.ribbon(sill=0.4, head=h - 1.3, depth=0.5, post=0.35)
    glazing = bays.rhythm(2.8, [pane], margin=0.5)
    layout = bays.with_door(
        glazing, bays.entrance(width=2.4, height=2.6, depth=0.8), width=4.2
    )
    bands = (
        Band(z0=h - 0.9, z1=h - 0.4, depth=-0.9),
        Band(z0=h - 0.4, z1=h, depth=0.0),
    )
    walls = Facade(h, bands=bands, layout=layout, glass=(0.5,))
    tiers.add_ground(block, plan, walls, part="pavilion")
    block.add(
        "pavilion_roof",
        solids.roof_pan(plan, z_floor=h - 0.4, z_top=h, thickness=0.25),
    )
