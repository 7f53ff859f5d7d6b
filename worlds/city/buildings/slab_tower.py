"""The slab tower: a concrete slab block with loggias."""

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    around,
    bays,
    foot_band,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import outlines

# Height of the walls above the topmost storey [m].
_PARAPET_M = 1.2
# How far the stair tower rises above the slab [m].
_STAIR_RISE_M = 2.4
# How far the stair tower stands back from the slab's front and back [m].
_STAIR_SETBACK_M = 1.2
# Greatest number of flats beside one another.
_MOST_FLATS = 11
# Greatest number of parts of which the storeys consist.
_MOST_GROUPS = 7
# Distance of the hall's walls from the edges of the slab, from the front
# counter-clockwise [m].
_HALL_INSET_M = (2.4, 0.4, 2.4, 0.4)
# Depth of the glass of the hall [m].
_HALL_RECESS_M = 0.25
# Depth of the glass of the pavilion [m].
_PAVILION_RECESS_M = 0.5
# Half the width of a pillar [m].
_PILLAR_HALF_M = 0.3
# How much deeper the doors of loggias are than the loggias [m].
_DOOR_RECESS_M = 0.15
# Least depth of open ground for a pavilion [m].
_PAVILION_ROOM_M = 9.0
# Greatest depth of a pavilion [m].
_PAVILION_DEPTH_M = 14.0
# Distance between pavilion and slab [m].
_PAVILION_GAP_M = 1.0
# Height of the edge of a pavilion's roof [m].
_PAVILION_RIM_M = 0.4
# Equipment on the roof.
_ROOF_ITEMS = ("tank", "tank", "mast", "vents", "stair_house", "dish")


class SlabTower(Building):
    """The concrete slab block: loggias, a stair tower, pillars, a pavilion."""

    def draw(self) -> None:
        site = self.site
        self.ground_height = self.uniform(4.2, 5.2, digits=2)
        self.storey_height = self.uniform(2.9, 3.2)
        self.depth = round(min(site.depth, self.uniform(13.0, 17.0)), 1)
        self.at_back = self.chance(0.5)
        self.stair_width = self.uniform(4.0, 6.0, digits=1)
        self.stair_left = self.chance(0.5)
        self.pitch = max(self.uniform(3.4, 5.0), site.width / _MOST_FLATS)
        self.loggia_depth = self.uniform(1.2, 1.7, digits=2)
        self.rail = self.uniform(0.9, 1.1, digits=2)
        self.window_recess = self.uniform(0.15, 0.3, digits=2)
        self.pavilion_height = self.uniform(4.0, 5.5, digits=1)

    def build(self) -> None:
        """Adds all parts of the slab block, whose longer sides lie along x."""
        x0, y0, x1, y1 = self.site.bounds
        front = y1 - self.depth if self.at_back else y0
        back = front + self.depth
        slab_xs, stair_xs = self._split_along_x()
        slab = outlines.rectangle(slab_xs[0], front, slab_xs[1], back)
        top = _add_hall(self, slab)
        goal = self.height - _STAIR_RISE_M - _PARAPET_M
        groups, per_group, storey = tiers.storey_groups(
            goal - top, storey=self.storey_height, most=_MOST_GROUPS
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
        shaft = outlines.rectangle(
            stair_xs[0],
            front + _STAIR_SETBACK_M,
            stair_xs[1],
            back - _STAIR_SETBACK_M,
        )
        _add_stair(self, shaft)
        room = front - y0 if self.at_back else y1 - back
        if room > _PAVILION_ROOM_M:
            open_ys = (back + _PAVILION_GAP_M, y1)
            if self.at_back:
                open_ys = (y0, front - _PAVILION_GAP_M)
            _add_pavilion(self, (x0, x1), open_ys)

    def _split_along_x(self) -> tuple[bays.Span, bays.Span]:
        """Returns x of the ends of the slab, and of the stair tower [m]."""
        x0, _, x1, _ = self.site.bounds
        if self.stair_left:
            split = x0 + self.stair_width
            return (split, x1), (x0, split)
        split = x1 - self.stair_width
        return (x0, split), (split, x1)


def _add_hall(block: SlabTower, slab: np.ndarray) -> float:
    """Adds a glazed hall behind the slab's pillars; returns its top [m]."""
    height = block.ground_height
    hall = outlines.inset(slab, _HALL_INSET_M)
    pane = bays.ribbon(
        sill=0.5, head=height - 0.6, depth=_HALL_RECESS_M, post=0.3
    )
    glazing = bays.rhythm(block.pitch, [pane], margin=0.6)
    entrance = bays.entrance(width=2.2, height=2.8, depth=0.6)
    with_door = bays.with_middle(glazing, entrance, width=4.0)
    walls = Facade(
        height,
        bands=(foot_band(height=0.5, reach=0.1),),
        layout=bays.by_edge({0: with_door, 2: with_door}, glazing),
        glass=(_HALL_RECESS_M,),
    )
    pieces = [solids.flat(slab, height, up=False)]
    for edge in (0, 2):
        wall = WallFrame(slab, edge)
        cells = bays.stretches(wall.length, pitch=1.2 * block.pitch, margin=0.3)
        for start, end in cells:
            x = around(round((start + end) / 2, 2), _PILLAR_HALF_M)
            pieces.append(wall.standing(x=x, y=(-1.5, -0.2), z1=height))
    return tiers.add_ground(block, hall, walls, extras=pieces)


def _storey_walls(block: SlabTower, storey: float) -> Facade:
    """Returns the walls of a storey: loggias in front, windows at the back.

    `storey` is the height of the storey [m].
    """
    head = round(storey - 0.3, 2)
    recess = block.window_recess
    loggia = bays.loggia(
        width=block.pitch - 0.3,
        depth=block.loggia_depth,
        rail=block.rail,
        head=head,
    )
    window = bays.window(width=1.9, sill=0.9, head=head - 0.2, depth=recess)
    slit = bays.window(width=1.4, sill=0.2, head=head, depth=recess)
    layouts = {
        0: bays.rhythm(block.pitch, [loggia], margin=0.4),
        2: bays.rhythm(block.pitch / 1.4, [window], margin=0.5),
    }
    return Facade(
        storey,
        bands=(foot_band(height=0.15, reach=0.06),),
        layout=bays.by_edge(layouts, bays.alone(slit, width=2.4)),
        glass=(block.loggia_depth + _DOOR_RECESS_M, recess),
    )


def _add_stair(block: SlabTower, shaft: np.ndarray) -> None:
    """Adds a stair tower beside the slab, with a window slit of full height.

    `shaft` is the outline (4, 2) of the tower [m].
    """
    height = block.height
    slit = bays.window(width=1.2, sill=1.0, head=height - 2.0, depth=0.3)
    walls = tiers.shaft_walls(
        height=height,
        entry=slit,
        slit=slit,
        room=2.0,
        rim=top_band(height, height=0.5, reach=0.15),
    )
    body = tiers.lidded_walls(shaft, walls, 0.0)
    block.add("stairs", solids.foundation(shaft), body)


def _add_pavilion(block: SlabTower, xs: bays.Span, ys: bays.Span) -> None:
    """Adds a low glazed pavilion in the open part of the site.

    `xs` and `ys` are the ranges of x and y of the open part [m].
    """
    width = 0.55 * (xs[1] - xs[0])
    left = xs[0] if block.stair_left else xs[1] - width
    depth = min(ys[1] - ys[0], _PAVILION_DEPTH_M)
    plan = outlines.rectangle(left, ys[0], left + width, ys[0] + depth)
    height = block.pavilion_height
    roof = height - _PAVILION_RIM_M
    pane = bays.ribbon(
        sill=0.4, head=height - 1.3, depth=_PAVILION_RECESS_M, post=0.35
    )
    glazing = bays.rhythm(2.8, [pane], margin=0.5)
    entrance = bays.entrance(width=2.4, height=2.6, depth=0.8)
    walls = Facade(
        height,
        bands=(
            Band(z0=height - 0.9, z1=roof, depth=-0.9),
            Band(z0=roof, z1=height, depth=0.0),
        ),
        layout=bays.with_door(glazing, entrance, width=4.2),
        glass=(_PAVILION_RECESS_M,),
    )
    tiers.add_ground(block, plan, walls, part="pavilion")
    pan = solids.roof_pan(plan, z_floor=roof, z_top=height, thickness=0.25)
    block.add("pavilion_roof", pan)
