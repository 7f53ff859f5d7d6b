"""Slab blocks of flats, with loggias, balconies or galleries."""

from __future__ import annotations

from collections.abc import Sequence
import itertools

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    Relief,
    Site,
    WallFrame,
    balconies,
    bays,
    equip_roof,
    outlines,
    solids,
    tiers,
)
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_PARAPET = 1.2
_STAIR_RISE = 2.4
_ROOF_ITEMS = ("tank", "tank", "mast", "vents", "stair_house", "dish")


class SlabTower(Building):
    """The concrete slab block: loggias, a stair tower, pillars, a pavilion."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.ground_height = self.uniform(4.2, 5.2, 2)
        self.storey_height = self.uniform(2.9, 3.2)
        self.depth = round(min(site.depth, self.uniform(13.0, 17.0)), 1)
        self.at_back = self.chance(0.5)
        self.stair_width = self.uniform(4.0, 6.0, 1)
        self.stair_left = self.chance(0.5)
        self.pitch = max(self.uniform(3.4, 5.0), site.width / 11)
        self.loggia_depth = self.uniform(1.2, 1.7, 2)
        self.rail = self.uniform(0.9, 1.1, 2)
        self.window_recess = self.uniform(0.15, 0.3, 2)
        self.pavilion_height = self.uniform(4.0, 5.5, 1)

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
        goal = self.height - _STAIR_RISE - _PARAPET
        groups, per_group, storey = tiers.storey_groups(
            goal - top, self.storey_height, 7
        )
        walls = _storey(self, storey)
        top = tiers.add_storeys(self, slab, walls, top, groups, per_group)
        bands = (Band(0.0, 0.25, -0.12), Band(1.0, _PARAPET, -0.12))
        crown = Facade(_PARAPET, bands)
        tiers.add_crown(self, slab, crown, top, 0.9, items=_ROOF_ITEMS)
        shaft = outlines.rectangle(stair[0], front + 1.2, stair[1], back - 1.2)
        _add_stair(self, shaft)
        room = front - y0 if self.at_back else y1 - back
        if room > 9.0:
            ys = (y0, front - 1.0) if self.at_back else (back + 1.0, y1)
            _add_pavilion(self, (x0, x1), ys)


def _add_hall(p: SlabTower, slab: np.ndarray) -> float:
    """Adds a glazed hall behind the slab's pillars; returns its top [m]."""
    h = p.ground_height
    hall = outlines.inset(slab, (2.4, 0.4, 2.4, 0.4))
    pane = bays.ribbon(0.5, h - 0.6, 0.25, 0.3)
    glazing = bays.rhythm(p.pitch, [pane], margin=0.6)
    door = bays.with_middle(glazing, bays.entrance(2.2, 2.8, 0.6), 4.0)
    layout = bays.by_edge({0: door, 2: door}, glazing)
    walls = Facade(h, (Band(0.0, 0.5, -0.1),), layout, (0.25,))
    pieces = [solids.flat(slab, h, up=False)]
    for edge in (0, 2):
        wall = WallFrame(slab, edge)
        for a, b in bays.stretches(wall.length, 1.2 * p.pitch, 0.3):
            x = round((a + b) / 2, 2)
            pieces.append(wall.standing(x - 0.3, x + 0.3, -1.5, -0.2, h))
    return tiers.add_ground(p, hall, walls, pieces)


def _storey(p: SlabTower, storey: float) -> Facade:
    head = round(storey - 0.3, 2)
    loggia = bays.loggia(p.pitch - 0.3, p.loggia_depth, p.rail, head)
    window = bays.window(1.9, 0.9, head - 0.2, p.window_recess)
    slit = bays.alone(bays.window(1.4, 0.2, head, p.window_recess), 2.4)
    layouts = {
        0: bays.rhythm(p.pitch, [loggia], margin=0.4),
        2: bays.rhythm(p.pitch / 1.4, [window], margin=0.5),
    }
    glass = (p.loggia_depth + 0.15, p.window_recess)
    layout = bays.by_edge(layouts, slit)
    return Facade(storey, (Band(0.0, 0.15, -0.06),), layout, glass)


def _add_stair(p: SlabTower, shaft: np.ndarray) -> None:
    """Adds a stair tower beside the slab, with a window slit of full height."""
    slit = bays.window(1.2, 1.0, p.height - 2.0, 0.3)
    walls = tiers.shaft_walls(p.height, slit, slit, 2.0, (0.5, 0.15))
    p.add(
        "stairs",
        solids.foundation(shaft),
        tiers.lidded_walls(shaft, walls, 0.0),
    )


def _add_pavilion(p: SlabTower, xs: bays.Span, ys: bays.Span) -> None:
    """Adds a low glazed pavilion in the open part of the site."""
    width = 0.55 * (xs[1] - xs[0])
    left = xs[0] if p.stair_left else xs[1] - width
    depth = min(ys[1] - ys[0], 14.0)
    plan = outlines.rectangle(left, ys[0], left + width, ys[0] + depth)
    h = p.pavilion_height
    pane = bays.ribbon(0.4, h - 1.3, 0.5, 0.35)
    glazing = bays.rhythm(2.8, [pane], margin=0.5)
    layout = bays.with_door(glazing, bays.entrance(2.4, 2.6, 0.8), 4.2)
    bands = (Band(h - 0.9, h - 0.4, -0.9), Band(h - 0.4, h, 0.0))
    walls = Facade(h, bands, layout, (0.5,))
    tiers.add_ground(p, plan, walls, part="pavilion")
    p.add("pavilion_roof", solids.roof_pan(plan, h - 0.4, h, 0.25))


# Room for balconies in front, and for canopies [m].
_FRONT_M = 1.7


class BalconyFlats(Building):
    """The white slab block: stacks of balconies, staggered sections."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        room = site.depth - 2.0
        # Distance by which every other section stands back.
        self.stagger = self.pick((0.0, 0.0, 1.5, 2.4)) if room > 12.0 else 0.0
        # Parts of the slab, each with its own stair.
        self.sections = min(max(round(site.width / 18.0), 1), 3)
        # Storeys by which every other section is lower.
        self.step = self.whole(0, 2)
        self.depth = round(
            min(room - self.stagger, self.uniform(11.0, 14.0)), 1
        )
        self.storey = self.uniform(2.8, 3.1)
        self.pitch = max(self.uniform(2.8, 3.6), site.width / 16)
        self.window_width = self.uniform(1.3, 2.0, 2)
        self.recess = self.uniform(0.12, 0.22, 2)
        self.balcony_width = self.uniform(2.8, 3.8, 2)
        self.balcony_reach = self.uniform(1.1, 1.5, 2)
        # `stacks` (one above the other), `ribbons` (all along the front) or
        # `checks` (every other one left out).
        self.balconies = self.pick(("stacks", "ribbons", "checks"))
        self.rail = self.uniform(0.9, 1.1, 2)
        # `slit` (a strip of glass) or `tower` (stands out in front).
        self.stair = self.pick(("slit", "tower"))
        self.roof_items = self.draw_roof_items(
            "stair_house tank mast vents dish", 1, 6
        )

    def build(self) -> None:
        """Adds all parts of the slab block, which lies along the front.

        The building's site must be a rectangle.
        """
        sections = _sections(self, self.site)
        plan, fronts = _outline(sections)
        storeys = max(2, round((self.height - 1.9) / self.storey))
        lower = self.step if self.sections > 1 and storeys > 3 else 0
        storey = (self.height - 1.9) / storeys
        walls = [_Front(self, plan, edge) for edge in fronts]
        ground = _facade(self, storey, walls, ground=True)
        top = tiers.add_ground(self, plan, ground)
        count, per_group, exact = tiers.storey_groups(
            (storeys - 1 - lower) * storey, storey, 5
        )
        facade = _facade(self, exact, walls)
        top = tiers.add_storeys(self, plan, facade, top, count, per_group)
        common = count * per_group
        _add_balconies(self, walls, ground.height, (count, per_group, exact))
        for k, section in enumerate(sections):
            part = f"section_{k}"
            high = top
            if lower and k % 2 == 0:
                rows = bays.rhythm(self.pitch, [_window(self, exact)], 0.5)
                attic = Facade(exact, (), rows, (self.recess,))
                high = tiers.add_storeys(
                    self, section, attic, top, 1, lower, part=f"{part}_storey"
                )
            rim = Facade(0.9, (Band(0.0, 0.15, -0.08), Band(0.75, 0.9, -0.08)))
            roof = tiers.add_crown(
                self, section, rim, high, 0.6, part=f"{part}_crown",
                thickness=0.25,
            )  # fmt: skip
            items = self.roof_items[k :: self.sections]
            equip_roof(self, section, roof, items, prefix=f"{part}_")
        high = ground.height + common * exact
        stairs = []
        for k, wall in enumerate(walls):
            stairs += _stair(self, wall, high, k == 0)
        self.add("stairs", *stairs, finish=self.colours["rail"])


def _sections(p: BalconyFlats, site: Site) -> list[np.ndarray]:
    """Returns the outlines of the rectangular sections, left to right."""
    x0, y0, x1, _ = site.bounds
    bounds = np.round(np.linspace(x0, x1, p.sections + 1), 2).tolist()
    fronts = [y0 + _FRONT_M + p.stagger * (k % 2) for k in range(p.sections)]
    return [
        outlines.rectangle(a, round(y, 2), b, round(y + p.depth, 2))
        for (a, b), y in zip(itertools.pairwise(bounds), fronts, strict=True)
    ]


def _window(p: BalconyFlats, storey: float, sill: float = 0.85) -> bays.Bay:
    return bays.window(p.window_width, sill, storey - 0.45, p.recess)


def _facade(
    p: BalconyFlats, storey: float, walls: list[_Front], *, ground: bool = False
) -> Facade:
    """Returns a storey's walls; the ground floor has doors and a plinth."""
    window, french = _window(p, storey), _window(p, storey, 0.12)
    slit = bays.window(1.3, 0.3, storey, p.recess)
    door = bays.window(1.6, 0.0, 2.3, p.recess, mullions=1)
    by_front = {front.edge: front for front in walls}
    blank = bays.alone(bays.window(1.0, 1.0, storey - 0.5, p.recess), 2.0)
    rows = bays.rhythm(p.pitch, [window], 0.5)

    def layout(edge: int, length: float) -> Sequence[Relief]:
        if edge not in by_front:
            return (rows if length > 15.0 else blank)(edge, length)
        front = by_front[edge]
        relief: list[Relief] = []
        for k, (a, b) in enumerate(front.cells):
            if k == front.middle:
                if ground:
                    relief += door(a, b)
                elif p.stair == "slit":
                    relief += slit(a, b)
            else:
                has_balcony = k in front.spots and not ground
                relief += (french if has_balcony else window)(a, b)
        return relief

    band = Band(0.0, 0.35, -0.06) if ground else Band(0.0, 0.12, -0.04)
    return Facade(round(storey, 3), (band,), layout, (p.recess,))


def _add_balconies(
    p: BalconyFlats,
    walls: list[_Front],
    z0: float,
    stack: tuple[int, int, float],
) -> None:
    """Adds the balconies of several storeys, one above another."""
    groups, per_group, storey = stack
    pieces: list[Mesh] = []
    joined = p.balconies == "ribbons"
    for front in walls:
        for a, b in _balcony_stretches(front.cells, front.spots, joined):
            width = b - a - 0.3
            if not joined:
                width = min(width, p.balcony_width)
            x = (a + b) / 2
            ends = round(x - width / 2, 2), round(x + width / 2, 2)
            balcony = balconies.balcony(*ends, p.balcony_reach, 0.0, p.rail)
            pieces += [
                front.wall.place(balcony, k * storey) for k in range(per_group)
            ]
    if pieces:
        mesh = merge_meshes(*pieces)
        step = per_group * storey
        p.stack("balconies", mesh, z0, step, groups, finish=p.colours["rail"])


def _stair(
    p: BalconyFlats, front: _Front, top: float, highest: bool
) -> list[Mesh]:
    """Returns a canopy over the door, and what shows of the stair.

    That is a stair tower in front of the wall, or on the highest section a
    house on the roof.
    """
    x, wall = front.stair, front.wall
    pieces = [
        wall.box(x - 1.5, x + 1.5, -0.05, 1.4, 2.55, 2.75),
        wall.standing(x - 1.4, x - 1.25, 1.1, 1.25, 2.6),
        wall.standing(x + 1.25, x + 1.4, 1.1, 1.25, 2.6),
    ]
    if p.stair == "tower":
        high = p.height if highest else top + 1.6
        pieces.append(wall.box(x - 1.5, x + 1.5, -2.5, 0.9, 2.7, high))
        for k in range(int((high - 4.2) / p.storey)):
            z = 3.7 + k * p.storey
            pieces.append(wall.box(x - 0.55, x + 0.55, 0.85, 0.98, z, z + 1.1))
    elif highest:
        spot = (x - 2.2, x + 2.2, -5.0, -1.5)
        pieces.append(wall.box(*spot, top - 0.1, p.height))
    return pieces


def _outline(sections: list[np.ndarray]) -> tuple[np.ndarray, list[int]]:
    """Returns the outline of all sections, and which edges are in front."""
    points: list[np.ndarray] = []
    fronts = []
    for section in sections:
        if not points or abs(points[-1][1] - section[0, 1]) > 1e-6:
            points.append(section[0])
        fronts.append(len(points) - 1)
        points.append(section[1])
    for section in reversed(sections):
        if abs(points[-1][1] - section[2, 1]) > 1e-6:
            points.append(section[2])
        points.append(section[3])
    return np.array(points), fronts


class _Front:
    """The front wall of a section, with the bays of stair and balconies."""

    def __init__(self, p: BalconyFlats, plan: np.ndarray, edge: int) -> None:
        self.edge = edge
        self.wall = WallFrame(plan, edge)
        self.cells = bays.stretches(self.wall.length, p.pitch, 0.5)
        self.middle = len(self.cells) // 2
        free = [k for k in range(len(self.cells)) if k != self.middle]
        if p.balconies == "ribbons":
            self.spots = free
        elif p.balconies == "checks":
            self.spots = free[::2]
        else:
            last = len(self.cells) - 1
            self.spots = [k for k in free if min(k, last - k) % 3 != 1]

    @property
    def stair(self) -> float:
        """Middle of the stair's bay along the wall [m]."""
        return sum(self.cells[self.middle]) / 2


def _balcony_stretches(
    cells: list[bays.Span], spots: list[int], joined: bool
) -> list[bays.Span]:
    """Returns stretches with balconies; neighbours are merged if `joined`."""
    runs: list[tuple[float, float]] = []
    for k in spots:
        a, b = cells[k]
        if joined and runs and abs(runs[-1][1] - a) < 1e-6:
            runs[-1] = (runs[-1][0], b)
        else:
            runs.append((a, b))
    return runs


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
        walls = _gallery_flats_storey(self, storey, open_edge)
        top = tiers.add_storeys(self, slab, walls, top, groups, per_group)
        stack = (groups, per_group, storey)
        _add_galleries(self, slab, open_edge, stack)
        crown = Facade(0.6, (Band(0.4, 0.6, -0.1),))
        tiers.add_crown(
            self, slab, crown, top, 0.5, thickness=0.25, items=self.roof_items
        )
        left = x0 if self.stair_left else b - 0.05
        right = left + self.stair_width + 0.05
        low, high = slab[0, 1] + 0.8, slab[2, 1] - 0.8
        shaft = outlines.rectangle(left, low, right, high)
        _add_gallery_flats_stair(self, shaft)


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


def _gallery_flats_storey(
    p: GalleryFlats, storey: float, open_edge: int
) -> Facade:
    """Returns the facade of a storey, from its floor to the next one.

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
    p: GalleryFlats, slab: np.ndarray, edge: int, stack: tuple[int, int, float]
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


def _add_gallery_flats_stair(p: GalleryFlats, shaft: np.ndarray) -> None:
    slit = bays.window(1.4, 2.8, p.height - 1.0, 0.25)
    entry = bays.window(1.6, 0.0, p.height - 1.0, 0.25)
    walls = tiers.shaft_walls(p.height, entry, slit, 2.4, (0.4, 0.08))
    body = tiers.lidded_walls(shaft, walls, 0.0)
    p.add("stair", solids.foundation(shaft), body, finish=p.colours["panel"])
