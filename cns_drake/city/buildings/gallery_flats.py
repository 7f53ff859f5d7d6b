"""The slab block with galleries along the doors of the flats."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    Relief,
    WallFrame,
    around,
    balconies,
    bays,
    foot_band,
    outlines,
    solids,
    tiers,
    top_band,
)
from cns_drake.city.geometry.mesh import merge_meshes


class GalleryFlats(Building):
    """The gallery block: walkways along the doors, loggias at the back."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.gallery = self.uniform(1.4, 1.8, digits=2)
        room = site.depth - self.gallery
        # Whether the galleries look to the street, else the loggias do.
        self.gallery_front = self.chance(0.5)
        # Depth of the bar between galleries and loggias.
        self.depth = round(min(room, self.uniform(10.0, 13.0)), 2)
        self.storey = self.uniform(2.8, 3.0)
        # Width of a flat.
        self.pitch = max(self.uniform(4.8, 6.4), site.width / 12)
        self.loggia = self.uniform(1.1, 1.5, digits=2)
        self.rail = self.uniform(0.95, 1.1, digits=2)
        self.recess = self.uniform(0.12, 0.2, digits=2)
        self.stair_left = self.chance(0.5)
        self.stair_width = self.uniform(3.2, 4.2, digits=2)
        # Part of the galleries' bays with a screen.
        self.panels = self.uniform(0.15, 0.5)
        self.ground = self.uniform(3.0, 3.6, digits=2)
        self.roof_items = self.draw_roof_items(
            "vents tank mast dish", low=2, high=5
        )

    def build(self) -> None:
        """Adds all parts of the gallery block, whose longer sides lie along x.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + (self.gallery if self.gallery_front else 0.1)
        back = min(
            front + self.depth,
            y1 - (0.1 if self.gallery_front else self.gallery),
        )
        a = x0 + self.stair_width * self.stair_left
        b = x1 - self.stair_width * (not self.stair_left)
        slab = outlines.rectangle(a, round(front, 2), b, round(back, 2))
        open_edge = 0 if self.gallery_front else 2
        goal = self.height - 2.2 - self.ground
        groups, per_group, storey = tiers.storey_groups(
            goal, storey=self.storey, most=6
        )
        top = _add_ground(self, slab)
        walls = _storey_walls(self, storey, open_edge)
        top = tiers.add_storeys(
            self, slab, walls, z0=top, groups=groups, per_group=per_group
        )
        stack = tiers.StoreyGroups(groups, per_group, storey)
        _add_galleries(self, slab, open_edge, stack)
        crown = Facade(0.6, bands=(Band(z0=0.4, z1=0.6, depth=-0.1),))
        tiers.add_crown(
            self,
            slab,
            crown,
            z0=top,
            parapet=0.5,
            thickness=0.25,
            items=self.roof_items,
        )
        left = x0 if self.stair_left else b - 0.05
        right = left + self.stair_width + 0.05
        low, high = slab[0, 1] + 0.8, slab[2, 1] - 0.8
        shaft = outlines.rectangle(left, low, right, high)
        _add_stair(self, shaft)


def _add_ground(flats: GalleryFlats, slab: np.ndarray) -> float:
    """Adds cellars, bicycle rooms and a glazed hall."""
    h = flats.ground
    store = bays.gate(width=2.4, height=2.2, depth=0.2)
    window = bays.window(width=1.6, sill=1.4, head=h - 0.5, depth=flats.recess)
    hall = bays.window(width=3.6, sill=0.3, head=h - 0.4, depth=0.3, mullions=2)
    rows = bays.rhythm(flats.pitch, [window, store], margin=0.5)
    front = bays.with_middle(rows, hall, width=5.0)
    layout = bays.by_edge({0: front, 2: rows}, bays.plain)
    bands = (
        foot_band(height=0.4, reach=0.05),
        top_band(h, height=0.2, reach=0.1),
    )
    return tiers.add_ground(
        flats,
        slab,
        Facade(h, bands=bands, layout=layout, glass=(flats.recess, 0.3)),
    )


def _storey_walls(flats: GalleryFlats, storey: float, open_edge: int) -> Facade:
    """Returns the facade of a storey, from its floor to the next floor.

    Doors and windows of the flats are on the side of the gallery, loggias on
    the opposite side. The ends have windows in the middle.

    Args:
        flats: the building.
        storey: height of the storey [m].
        open_edge: the side of the gallery: 0 for the front, 2 for the back.
    """
    head = round(storey - 0.45, 2)

    def flat(a: float, b: float) -> list[Relief]:
        door = bays.window(
            width=1.0, sill=0.05, head=2.1, depth=flats.recess + 0.15
        )
        pane = bays.window(width=1.5, sill=1.0, head=head, depth=flats.recess)
        middle = a + 0.4 * (b - a)
        return [*door(a + 0.1, middle), *pane(middle, b - 0.1)]

    behind = bays.loggia(
        width=flats.pitch - 0.5, depth=flats.loggia, rail=flats.rail, head=head
    )
    layouts = {
        open_edge: bays.rhythm(flats.pitch, [flat], margin=0.4),
        2 - open_edge: bays.rhythm(flats.pitch, [behind], margin=0.4),
    }
    blank = bays.alone(
        bays.window(width=1.2, sill=0.9, head=head, depth=flats.recess),
        width=2.2,
    )
    glass = (flats.recess, flats.loggia + 0.15)
    return Facade(
        storey, bands=(), layout=bays.by_edge(layouts, blank), glass=glass
    )


def _add_galleries(
    flats: GalleryFlats, slab: np.ndarray, edge: int, stack: tiers.StoreyGroups
) -> None:
    """Adds a gallery to each storey, with continuous posts, and screens."""
    wall = WallFrame(slab, edge)
    end = wall.length
    reach = flats.gallery - 0.05
    groups, per_group, storey = stack
    storeys, step = groups * per_group, per_group * storey
    gallery = wall.place(
        balconies.balcony(
            x0=0.02, x1=end - 0.02, reach=reach, z=0.0, rail=flats.rail
        )
    )
    group = (gallery.moved((0.0, 0.0, k * storey)) for k in range(per_group))
    flats.stack(
        "gallery",
        merge_meshes(*group),
        z0=flats.ground,
        step=step,
        count=groups,
    )
    top = flats.ground + storeys * storey
    posts = [
        wall.box(x=(0.02, end - 0.02), y=(-0.05, reach), z=(top - 0.2, top))
    ]
    cells = bays.stretches(end, pitch=flats.pitch, margin=0.4)
    for x in bays.bounds(cells):
        post = wall.standing(
            x=around(x, 0.15), y=(reach - 0.35, reach - 0.05), z1=top - 0.1
        )
        posts.append(post)
    flats.add("posts", *posts)
    screens = []
    for a, b in cells:
        for k in range(storeys):
            if flats.chance(flats.panels):
                z = flats.ground + k * storey
                u = flats.uniform(a + 0.2, b - 1.8)
                screen = wall.box(
                    x=(round(u, 2), round(u + 1.5, 2)),
                    y=(reach, reach + 0.06),
                    z=(z + 0.1, z + storey - 0.15),
                )
                screens.append(screen)
    flats.add("screens", *screens, finish=flats.colours["panel"])


def _add_stair(flats: GalleryFlats, shaft: np.ndarray) -> None:
    slit = bays.window(width=1.4, sill=2.8, head=flats.height - 1.0, depth=0.25)
    entry = bays.window(
        width=1.6, sill=0.0, head=flats.height - 1.0, depth=0.25
    )
    walls = tiers.shaft_walls(
        height=flats.height, entry=entry, slit=slit, room=2.4, rim=(0.4, 0.08)
    )
    body = tiers.lidded_walls(shaft, walls, 0.0)
    flats.add(
        "stair", solids.foundation(shaft), body, finish=flats.colours["panel"]
    )
