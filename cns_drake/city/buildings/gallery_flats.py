"""The slab block with galleries along the doors of the flats."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    Relief,
    WallFrame,
    balconies,
    bays,
    outlines,
    solids,
    tiers,
)
from cns_drake.city.geometry.mesh import merge_meshes


class GalleryFlats(Building):
    """The gallery block: walkways along the doors, loggias at the back."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.gallery = self.uniform(1.4, 1.8, 2)
        room = site.depth - self.gallery
        # Whether the galleries look to the street, else the loggias do.
        self.gallery_front = self.chance(0.5)
        # Depth of the bar between galleries and loggias.
        self.depth = round(min(room, self.uniform(10.0, 13.0)), 2)
        self.storey = self.uniform(2.8, 3.0)
        # Width of a flat.
        self.pitch = max(self.uniform(4.8, 6.4), site.width / 12)
        self.loggia = self.uniform(1.1, 1.5, 2)
        self.rail = self.uniform(0.95, 1.1, 2)
        self.recess = self.uniform(0.12, 0.2, 2)
        self.stair_left = self.chance(0.5)
        self.stair_width = self.uniform(3.2, 4.2, 2)
        # Part of the galleries' bays with a screen.
        self.panels = self.uniform(0.15, 0.5)
        self.ground = self.uniform(3.0, 3.6, 2)
        self.roof_items = self.draw_roof_items("vents tank mast dish", 2, 5)

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
        groups, per_group, storey = tiers.storey_groups(goal, self.storey, 6)
        top = _add_ground(self, slab)
        walls = _storey_walls(self, storey, open_edge)
        top = tiers.add_storeys(self, slab, walls, top, groups, per_group)
        stack = tiers.StoreyGroups(groups, per_group, storey)
        _add_galleries(self, slab, open_edge, stack)
        crown = Facade(0.6, (Band(0.4, 0.6, -0.1),))
        tiers.add_crown(
            self, slab, crown, top, 0.5, thickness=0.25, items=self.roof_items
        )
        left = x0 if self.stair_left else b - 0.05
        right = left + self.stair_width + 0.05
        low, high = slab[0, 1] + 0.8, slab[2, 1] - 0.8
        shaft = outlines.rectangle(left, low, right, high)
        _add_stair(self, shaft)


def _add_ground(p: GalleryFlats, slab: np.ndarray) -> float:
    """Adds cellars, bicycle rooms and a glazed hall."""
    h = p.ground
    store = bays.gate(2.4, 2.2, 0.2)
    window = bays.window(1.6, 1.4, h - 0.5, p.recess)
    hall = bays.window(3.6, 0.3, h - 0.4, 0.3, mullions=2)
    rows = bays.rhythm(p.pitch, [window, store], 0.5)
    front = bays.with_middle(rows, hall, 5.0)
    layout = bays.by_edge({0: front, 2: rows}, bays.plain)
    bands = (Band(0.0, 0.4, -0.05), Band(h - 0.2, h, -0.1))
    return tiers.add_ground(p, slab, Facade(h, bands, layout, (p.recess, 0.3)))


def _storey_walls(p: GalleryFlats, storey: float, open_edge: int) -> Facade:
    """Returns the facade of a storey, from its floor to the next floor.

    Doors and windows of the flats are on the side of the gallery, loggias on
    the opposite side. The ends have windows in the middle.

    Args:
        p: the building.
        storey: height of the storey [m].
        open_edge: the side of the gallery: 0 for the front, 2 for the back.
    """
    head = round(storey - 0.45, 2)

    def flat(a: float, b: float) -> list[Relief]:
        door = bays.window(1.0, 0.05, 2.1, p.recess + 0.15)
        pane = bays.window(1.5, 1.0, head, p.recess)
        middle = a + 0.4 * (b - a)
        return [*door(a + 0.1, middle), *pane(middle, b - 0.1)]

    behind = bays.loggia(p.pitch - 0.5, p.loggia, p.rail, head)
    layouts = {
        open_edge: bays.rhythm(p.pitch, [flat], 0.4),
        2 - open_edge: bays.rhythm(p.pitch, [behind], 0.4),
    }
    blank = bays.alone(bays.window(1.2, 0.9, head, p.recess), 2.2)
    glass = (p.recess, p.loggia + 0.15)
    return Facade(storey, (), bays.by_edge(layouts, blank), glass)


def _add_galleries(
    p: GalleryFlats, slab: np.ndarray, edge: int, stack: tiers.StoreyGroups
) -> None:
    """Adds a gallery to each storey, with continuous posts, and screens."""
    wall = WallFrame(slab, edge)
    end = wall.length
    reach = p.gallery - 0.05
    groups, per_group, storey = stack
    storeys, step = groups * per_group, per_group * storey
    gallery = wall.place(
        balconies.balcony(0.02, end - 0.02, reach, 0.0, p.rail)
    )
    group = (gallery.moved((0.0, 0.0, k * storey)) for k in range(per_group))
    p.stack("gallery", merge_meshes(*group), p.ground, step, groups)
    top = p.ground + storeys * storey
    posts = [wall.box(0.02, end - 0.02, -0.05, reach, top - 0.2, top)]
    cells = bays.stretches(end, p.pitch, 0.4)
    for x in bays.bounds(cells):
        spot = (x - 0.15, x + 0.15, reach - 0.35, reach - 0.05)
        posts.append(wall.standing(*spot, top - 0.1))
    p.add("posts", *posts)
    screens = []
    for a, b in cells:
        for k in range(storeys):
            if p.chance(p.panels):
                z = p.ground + k * storey
                u = p.uniform(a + 0.2, b - 1.8)
                spot = (round(u, 2), round(u + 1.5, 2), reach, reach + 0.06)
                screens.append(wall.box(*spot, z + 0.1, z + storey - 0.15))
    p.add("screens", *screens, finish=p.colours["panel"])


def _add_stair(p: GalleryFlats, shaft: np.ndarray) -> None:
    slit = bays.window(1.4, 2.8, p.height - 1.0, 0.25)
    entry = bays.window(1.6, 0.0, p.height - 1.0, 0.25)
    walls = tiers.shaft_walls(p.height, entry, slit, 2.4, (0.4, 0.08))
    body = tiers.lidded_walls(shaft, walls, 0.0)
    p.add("stair", solids.foundation(shaft), body, finish=p.colours["panel"])
