"""The slab block with galleries along the doors of the flats."""

from __future__ import annotations

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    Relief,
    WallFrame,
    around,
    balconies,
    bays,
    foot_band,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import Mesh, merge_meshes, outlines

# Greatest number of flats beside one another.
_MOST_FLATS = 12
# Strip between the side without a gallery and the edge of the site [m].
_MARGIN_M = 0.1
# How far the stair tower rises above the topmost storey [m].
_STAIR_RISE_M = 2.2
# Greatest number of parts of which the storeys consist.
_MOST_GROUPS = 6
# Overlap of the stair tower with the slab [m].
_STAIR_JOINT_M = 0.05
# How far the stair tower stands back from the slab's front and back [m].
_STAIR_SETBACK_M = 0.8
# Depth of the windows of the hall [m].
_HALL_RECESS_M = 0.3
# How much deeper the doors of the flats and loggias are than windows [m].
_DOOR_RECESS_M = 0.15
# Distance of the flats from the ends of the slab [m].
_END_M = 0.4
# Width of a screen on a gallery [m].
_SCREEN_M = 1.5
# Number of the slab's edge in front.
_FRONT = 0
# Number of the slab's edge at the back.
_BACK = 2


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
        self.pitch = max(self.uniform(4.8, 6.4), site.width / _MOST_FLATS)
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
        slab = _slab_outline(self)
        gallery_edge = _FRONT if self.gallery_front else _BACK
        room = self.height - _STAIR_RISE_M - self.ground
        storeys = tiers.storey_groups(
            room, storey=self.storey, most=_MOST_GROUPS
        )
        top = _add_ground(self, slab)
        top = tiers.add_storeys(
            self,
            slab,
            _storey_walls(self, storeys.storey, gallery_edge),
            z0=top,
            groups=storeys.groups,
            per_group=storeys.per_group,
        )
        _add_galleries(self, slab, gallery_edge, storeys)
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
        _add_stair(self, _stair_outline(self, slab))


def _slab_outline(flats: GalleryFlats) -> np.ndarray:
    """Returns the outline (4, 2) of the flats, beside the stair tower [m].

    The gallery has room in front of the slab, or behind it.
    """
    x0, y0, x1, y1 = flats.site.bounds
    room_front, room_back = _MARGIN_M, flats.gallery
    if flats.gallery_front:
        room_front, room_back = room_back, room_front
    front = y0 + room_front
    back = min(front + flats.depth, y1 - room_back)
    if flats.stair_left:
        x0 += flats.stair_width
    else:
        x1 -= flats.stair_width
    return outlines.rectangle(x0, round(front, 2), x1, round(back, 2))


def _stair_outline(flats: GalleryFlats, slab: np.ndarray) -> np.ndarray:
    """Returns the outline (4, 2) of the stair tower beside a slab [m]."""
    left = slab[1, 0] - _STAIR_JOINT_M
    if flats.stair_left:
        left = flats.site.bounds[0]
    right = left + flats.stair_width + _STAIR_JOINT_M
    front = slab[0, 1] + _STAIR_SETBACK_M
    back = slab[2, 1] - _STAIR_SETBACK_M
    return outlines.rectangle(left, front, right, back)


def _add_ground(flats: GalleryFlats, slab: np.ndarray) -> float:
    """Adds cellars, bicycle rooms and a hall; returns their top [m]."""
    height = flats.ground
    store = bays.gate(width=2.4, height=2.2, depth=0.2)
    window = bays.window(
        width=1.6, sill=1.4, head=height - 0.5, depth=flats.recess
    )
    hall = bays.window(
        width=3.6,
        sill=0.3,
        head=height - 0.4,
        depth=_HALL_RECESS_M,
        mullions=2,
    )
    rows = bays.rhythm(flats.pitch, [window, store], margin=0.5)
    front = bays.with_middle(rows, hall, width=5.0)
    walls = Facade(
        height,
        bands=(
            foot_band(height=0.4, reach=0.05),
            top_band(height, height=0.2, reach=0.1),
        ),
        layout=bays.by_edge({_FRONT: front, _BACK: rows}),
        glass=(flats.recess, _HALL_RECESS_M),
    )
    return tiers.add_ground(flats, slab, walls)


def _storey_walls(
    flats: GalleryFlats, storey: float, gallery_edge: int
) -> Facade:
    """Returns the facade of a storey, from its floor to the next floor.

    Doors and windows of the flats are on the side of the gallery, loggias on
    the opposite side. The ends have windows in the middle.

    Args:
        flats: the building.
        storey: height of the storey [m].
        gallery_edge: the side of the gallery: 0 for the front, 2 for the back.
    """
    head = round(storey - 0.45, 2)

    def flat(x0: float, x1: float) -> list[Relief]:
        """Returns the door and the window of a flat."""
        door = bays.window(
            width=1.0,
            sill=0.05,
            head=2.1,
            depth=flats.recess + _DOOR_RECESS_M,
        )
        window = bays.window(width=1.5, sill=1.0, head=head, depth=flats.recess)
        middle = x0 + 0.4 * (x1 - x0)
        return [*door(x0 + 0.1, middle), *window(middle, x1 - 0.1)]

    loggia = bays.loggia(
        width=flats.pitch - 0.5, depth=flats.loggia, rail=flats.rail, head=head
    )
    layouts = {
        gallery_edge: bays.rhythm(flats.pitch, [flat], margin=_END_M),
        _BACK - gallery_edge: bays.rhythm(flats.pitch, [loggia], margin=_END_M),
    }
    end_window = bays.window(width=1.2, sill=0.9, head=head, depth=flats.recess)
    ends = bays.alone(end_window, width=2.2)
    return Facade(
        storey,
        layout=bays.by_edge(layouts, ends),
        glass=(flats.recess, flats.loggia + _DOOR_RECESS_M),
    )


def _add_galleries(
    flats: GalleryFlats,
    slab: np.ndarray,
    edge: int,
    storeys: tiers.StoreyGroups,
) -> None:
    """Adds a gallery to each storey, with continuous posts, and screens.

    Args:
        flats: the building.
        slab: (4, 2) outline of the flats [m].
        edge: number of the slab's edge with the galleries.
        storeys: the storeys above the ground floor.
    """
    wall = WallFrame(slab, edge)
    reach = flats.gallery - 0.05
    groups, per_group, storey = storeys
    balcony = balconies.balcony(
        x0=0.02, x1=wall.length - 0.02, reach=reach, z=0.0, rail=flats.rail
    )
    gallery = wall.place(balcony)
    group = (gallery.moved((0.0, 0.0, k * storey)) for k in range(per_group))
    flats.stack(
        "gallery",
        merge_meshes(*group),
        z0=flats.ground,
        step=per_group * storey,
        count=groups,
    )
    cells = bays.stretches(wall.length, pitch=flats.pitch, margin=_END_M)
    top = flats.ground + storeys.num_storeys * storey
    posts = _gallery_posts(wall, cells, reach, top)
    flats.add("posts", *posts)
    screens = _screens(flats, wall, cells, reach, storeys)
    flats.add("screens", *screens, finish=flats.colours["panel"])


def _gallery_posts(
    wall: WallFrame, cells: list[bays.Span], reach: float, top: float
) -> list[Mesh]:
    """Returns the roof over the topmost gallery, and posts between the flats.

    Args:
        wall: the wall with the galleries.
        cells: start and end of each flat along the wall [m].
        reach: how far the galleries reach out of the wall [m].
        top: height of the roof's top [m].
    """
    roof = wall.box(
        x=(0.02, wall.length - 0.02), y=(-0.05, reach), z=(top - 0.2, top)
    )
    posts = [
        wall.standing(
            x=around(x, 0.15), y=(reach - 0.35, reach - 0.05), z1=top - 0.1
        )
        for x in bays.bounds(cells)
    ]
    return [roof, *posts]


def _screens(
    flats: GalleryFlats,
    wall: WallFrame,
    cells: list[bays.Span],
    reach: float,
    storeys: tiers.StoreyGroups,
) -> list[Mesh]:
    """Returns screens at random places on the outer edge of the galleries.

    Args:
        flats: the building.
        wall: the wall with the galleries.
        cells: start and end of each flat along the wall [m].
        reach: how far the galleries reach out of the wall [m].
        storeys: the storeys above the ground floor.
    """
    screens = []
    for start, end in cells:
        for k in range(storeys.num_storeys):
            if flats.chance(flats.panels):
                z = flats.ground + k * storeys.storey
                x = flats.uniform(start + 0.2, end - 1.8)
                screen = wall.box(
                    x=(round(x, 2), round(x + _SCREEN_M, 2)),
                    y=(reach, reach + 0.06),
                    z=(z + 0.1, z + storeys.storey - 0.15),
                )
                screens.append(screen)
    return screens


def _add_stair(flats: GalleryFlats, shaft: np.ndarray) -> None:
    """Adds the stair tower, with a strip of glass in front and behind.

    `shaft` is the outline (4, 2) of the tower [m].
    """
    height = flats.height
    slit = bays.window(width=1.4, sill=2.8, head=height - 1.0, depth=0.25)
    entry = bays.window(width=1.6, sill=0.0, head=height - 1.0, depth=0.25)
    walls = tiers.shaft_walls(
        height=height,
        entry=entry,
        slit=slit,
        room=2.4,
        rim=top_band(height, height=0.4, reach=0.08),
    )
    tower = [solids.foundation(shaft), tiers.lidded_walls(shaft, walls, 0.0)]
    flats.add("stair", *tower, finish=flats.colours["panel"])
