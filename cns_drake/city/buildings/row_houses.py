"""Row houses: single houses, terraces, and houses above a shop."""

from collections.abc import Sequence
import copy
import math

import numpy as np

from cns_drake.city.buildings.house_heights import ROOF_M
from cns_drake.city.facades import (
    Assembly,
    Band,
    Building,
    Openings,
    Patch,
    Roof,
    WallFrame,
    Wing,
    add_chimney,
    bay_windows,
    bays,
    boards,
    equip_roof,
    outlines,
    porches,
    roofs,
    wing_openings,
    wing_roofs,
)
from cns_drake.city.geometry.mesh import Mesh

# Party walls rise this far above a roof whose ridge follows the street [m].
_FIREWALL_M = 0.25


# Roofs of a house: `gable` and `gambrel` along the street, `flat` with a
# cornice. Narrow houses may also have a gable to the street: `front`, or
# `stepped` with steps on it.
_ROOFS = ("gable", "gambrel", "flat", "front", "stepped")
# Roofs of a shop house, of the same kinds.
_ROOFS_ABOVE_SHOPS = ("flat", "gable", "gambrel", "front", "stepped")


class _HouseInARow(Building):
    """The base class of houses that stand wall to wall.

    Attributes:
        stoop: room in front of the wall for steps [m].
        floor: height of the ground floor above the street [m].
    """

    stoop: float
    floor: float

    def draw_house(
        self,
        width: float,
        roofs: Sequence[str],
        casings: Sequence[str] = ("frame", "sill", "sill", "shutters"),
    ) -> None:
        """Draws sizes and style of a house.

        Args:
            width: width of the house [m].
            roofs: the roofs that it may have, as in `_ROOFS`.
            casings: styles of the frames around the windows.
        """
        self.roof = self.pick(roofs)
        # Rise of the roof, as a share of half its span.
        self.rise = self.uniform(0.75, 1.15)
        self.storey = self.uniform(2.75, 3.1)
        self.plinth = self.pick((0.2, 0.5, 0.8, 1.0))
        self.door_left = self.chance(0.5)
        self.window_pitch = self.uniform(1.9, 2.5)
        self.window_width = self.uniform(0.9, 1.2, 2)
        self.casing = self.pick(casings)
        # `none`, `canted`, `box` (on the ground) or `oriel` (above it).
        self.bay = self.pick(("none", "canted", "box", "oriel"))
        self.bay_storeys = self.whole(1, 4)
        # Greatest number of dormers.
        self.dormers = self.whole(0, max(2, round(width / 2.2)))
        self.dormer = self.pick(("gable", "shed"))
        # Whether there is a hood above the door.
        self.canopy = self.chance(0.4)
        self.chimney = self.chance(0.75)
        self.brick = self.pick(self.kind.choices["bricks"])


def _add_unit(
    p: _HouseInARow,
    area: outlines.Area,
    blind: frozenset[int],
    part: str = "",
    door_material: str = "accent",
) -> Wing:
    """Adds a house on an area, and returns its wing.

    Ground in front of the house stays free for the stoop. The names of its own
    visuals start with `part`.
    """
    wing, storeys = _wing_and_storeys(p, area, blind)
    openings = Openings(p, wing)
    step = (wing.wall_top - 0.25 - p.floor) / storeys
    sides = [k for k in (1, 3) if k not in blind]
    for edges, pitch in (((0, 2), p.window_pitch), (sides, 4.2)):
        wing_openings.add_window_storeys(
            openings,
            edges,
            p.floor,
            step,
            storeys,
            pitch,
            p.window_width,
            head=min(2.2, step - 0.45),
        )
    door = _add_entrance(p, wing, openings, door_material)
    _add_bay(p, wing, openings, storeys, step, door)
    wing_openings.add_casings(openings, (0,), p.casing)
    bands = [Band(0.0, round(p.floor, 2), -0.05)]
    if storeys > 1:
        z = round(p.floor + step, 2)
        bands.append(Band(round(z - 0.15, 2), z, -0.05))
    if p.roof == "flat":
        z = round(wing.wall_top - 0.45, 2)
        bands.append(Band(z, wing.wall_top, -0.22))
    openings.add_walls((wing_openings.GLASS_M,), bands)
    _add_roof(p, wing)
    if p.chimney:
        _add_stack(p, wing, f"{part}chimney")
    return wing


def _wing_and_storeys(
    p: _HouseInARow, area: outlines.Area, blind: frozenset[int]
) -> tuple[Wing, int]:
    """Returns the wing of a house, and its storeys above `p.floor`."""
    x0, y0, x1, y1 = area
    across = p.roof in ("front", "stepped")
    span = (x1 - x0) if across else (y1 - y0)
    top = p.height
    rise = p.rise * span / 2
    if p.roof == "flat":
        rise = 0.5
    elif p.roof == "stepped":
        top -= 0.4
    elif not across:
        top -= _FIREWALL_M
    room = top - p.floor - ROOF_M - 0.25
    storeys = max(1, round((room - rise) / p.storey))
    if p.roof == "flat":
        wall_top = top - rise
    else:
        wanted = p.floor + storeys * p.storey + 0.25
        least = top - ROOF_M - 0.75 * span
        wall_top = min(max(wanted, least), top - ROOF_M - 0.1 * span)
    kind = "gable" if across else p.roof
    eaves, verge = 0.0 if across else 0.35, 0.0 if p.roof == "stepped" else 0.3
    roof = Roof(kind, across, eaves, verge, ROOF_M, parapet=0.45)
    return Wing.at((x0, y0, x1, y1), wall_top, top, roof, blind), storeys


def _add_entrance(
    p: _HouseInARow, wing: Wing, openings: Openings, material: str
) -> float:
    """Adds the door on its landing; returns its place along the wall [m]."""
    wall = wing.wall(0)
    inset = min(0.95, 0.3 * wall.length)
    x = inset if p.door_left else wall.length - inset
    wing_openings.add_door(
        openings, 0, x, p.floor, height=2.25, material=material
    )
    count = max(1, round(p.floor / 0.17))
    run = min(0.29 * count, max(p.stoop - 0.5, 0.3 * p.stoop))
    landing = p.stoop - run
    a, b = x - 0.65, x + 0.65
    if p.floor > 0.05:
        slab = wall.standing(a, b, -0.05, landing, p.floor, bottom=True)
        p.add_to("base", slab)
        porches.add_steps(p, wall, a, b, landing, p.floor, run)
    if p.canopy:
        z = p.floor + 2.4
        p.add_to("trim", wall.box(x - 0.8, x + 0.8, -0.05, 0.8, z, z + 0.14))
    return x


def _add_bay(
    p: _HouseInARow,
    wing: Wing,
    openings: Openings,
    storeys: int,
    step: float,
    door: float,
) -> None:
    """Adds a bay window beside the door, in place of the windows there."""
    wall = wing.wall(0)
    a, b = (door + 0.8, wall.length) if p.door_left else (0.0, door - 0.8)
    width = min(b - a - 0.7, 2.6)
    if p.bay == "none" or width < 1.7 or (p.bay == "oriel" and storeys < 2):
        return
    count = min(p.bay_storeys, storeys)
    x = (a + b) / 2
    low = 0.0
    foot = p.floor
    if p.bay == "oriel":
        low = p.floor + step
        foot = 0.0
        count = min(count, storeys - 1)
    high = min(foot + low + count * step - 0.1, wing.wall_top - 0.6)
    reach = min(0.6, 0.5 * p.stoop)
    openings.clear(0, x - width / 2 - 0.1, x + width / 2 + 0.1, low, high + 0.5)
    bay_windows.add_bay_window(
        p, wall, x, width, reach, round(low, 2), round(high, 2),
        storeys=count, canted=p.bay != "box",
    )  # fmt: skip


def _add_roof(p: _HouseInARow, wing: Wing) -> None:
    """Adds a roof with its dormers, firewalls or stepped gables."""
    low = wing.wall_top + 0.45
    attic = wing_roofs.attic_window(0.8, low, low + 1.1, wing_openings.GLASS_M)
    wing_roofs.add_roof(p, wing, None if p.roof == "stepped" else attic)
    if p.roof == "stepped":
        for edge in (0, 2):
            p.add_to("walls", *_stepped_gable(wing, wing.wall(edge)))
        _add_gable_windows(p, wing)
    elif p.roof in ("gable", "gambrel"):
        line = [(u, z + _FIREWALL_M) for u, z in wing.roof_line]
        for x in (wing.x0, wing.x1 - 0.3):
            firewall = roofs.shell(line, x, x + 0.3, _FIREWALL_M + 0.1)
            p.add_to("walls", firewall)
        wing_roofs.add_dormers(p, wing, 0.0, wing.width, p.dormers, p.dormer)


def _stepped_gable(wing: Wing, wall: WallFrame) -> list[Mesh]:
    """Returns the steps that rise to the middle of a gable."""
    middle = wing.width / 2
    rise = wing.top + 0.4 - wing.wall_top
    count = max(3, round(rise / 0.9))
    pieces = []
    for k in range(count):
        # Each step is wide enough to hide the slope behind it.
        half = max(middle * (1.0 - k / count), 0.5)
        low = wing.wall_top + rise * (k / count) - 0.3
        top = wing.wall_top + rise * (k + 1) / count
        spot = (middle - half, middle + half, -0.32, 0.03, low, top)
        pieces.append(wall.box(*(round(v, 2) for v in spot)))
    return pieces


def _add_gable_windows(out: Assembly, wing: Wing) -> None:
    """Adds windows to a stepped gable, with frames in front of the wall."""
    x, z = wing.width / 2, wing.wall_top + 0.4
    spots = [x - 1.1, x + 1.1] if wing.top - wing.wall_top > 3.2 else [x]
    for edge in (0, 2):
        wall = wing.wall(edge)
        for u in spots:
            pane = Patch(u - 0.45, u + 0.45, z, z + 1.2, wing_openings.GLASS_M)
            frame = boards.casings([pane], (pane.depth,), "frame", 0.12)
            glass = boards.board(pane.x0, pane.x1, pane.z0, pane.z1, 0.05)
            out.add_to("trim", *(wall.place(piece) for piece in frame))
            out.add_to("glass", wall.place(glass))


def _add_stack(p: _HouseInARow, wing: Wing, name: str) -> None:
    """Adds a chimney to the roof of a house."""
    yaw = math.pi / 2
    if p.roof in ("front", "stepped"):
        x = wing.x0 + 0.3 * wing.width
        z = roofs.line_height(wing.roof_line, x)
        spot = (x, wing.y0 + 0.6 * wing.depth, z - 0.6)
        add_chimney(p, name, spot, p.brick, yaw=yaw)
        return
    x = wing.x0 + 0.45 if p.door_left else wing.x1 - 0.45
    y = wing.y0 + 0.55 * wing.depth
    spot = (x, y, roofs.line_height(wing.roof_line, y) - 0.8)
    row = "chimney_row"
    scale = (0.8, 0.85, 1.0)
    add_chimney(p, name, spot, p.brick, item=row, yaw=yaw, scale=scale)


def _front_site(p: _HouseInARow) -> tuple[float, float, frozenset[int]]:
    """Returns the x of a house's left and right wall, and its blind edges.

    Eaves and cornices stay on the lot, except towards the neighbours.
    """
    x0, _, x1, _ = p.site.bounds
    side = 0.3 * (p.roof == "flat")
    blind = p.site.blind_edges & {1, 3}
    return x0 + side * (3 not in blind), x1 - side * (1 not in blind), blind


# A house deeper than this gets a lower wing at its back [m].
_MOST_DEPTH_M = 10.5


class RowHouse(_HouseInARow):
    """The row house: one narrow house between its neighbours, with a stoop."""

    def draw(self) -> None:
        """Samples sizes and style."""
        width = self.site.width
        self.draw_house(width, _ROOFS[:5] if width < 9.5 else _ROOFS[:3])
        self.stoop = 1.3
        self.floor = self.plinth
        # Size and side of the lower wing behind the house.
        self.annex_height = self.uniform(2.8, 3.6, 2)
        self.annex_width = self.uniform(0.45, 0.65)
        self.annex_left = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the row house.

        The building's site must be a rectangle.
        """
        _, y0, _, y1 = self.site.bounds
        left, right, blind = _front_site(self)
        front, back = y0 + self.stoop, y1 - 0.35
        deep = min(back - front, _MOST_DEPTH_M)
        if back - front - deep < 1.5:
            deep = back - front
        main = _add_unit(self, (left, front, right, front + deep), blind)
        if back - main.y1 > 1.0:
            _add_annex(self, main, back)


def _add_annex(p: RowHouse, main: Wing, back: float) -> None:
    """Adds a low wing behind the house, on one side."""
    width = p.annex_width * main.width
    x0 = main.x0 if p.annex_left else main.x1 - width
    blind = main.blind & {3 if p.annex_left else 1}
    top = min(p.annex_height + 0.9, main.wall_top)
    wall_top = min(p.annex_height, top - 0.4)
    area = (x0, main.y1 - 0.06, x0 + width, back)
    roof = Roof("shed", True, 0.0, 0.2, 0.18)
    openings = Openings(p, Wing.at(area, wall_top, top, roof, blind), (main,))
    openings.add_bays(
        (1, 2, 3), 0.9, 2.6, [wing_openings.sash(1.1, 0.1, 0.9, 2.1)]
    )
    openings.enclose((wing_openings.GLASS_M,))


# Materials of the doors in a terrace.
_DOORS = ("accent", "trim", "roof")


class Terrace(_HouseInARow):
    """The terrace: a row of narrow houses, similar but not the same."""

    def draw(self) -> None:
        """Samples sizes and style."""
        # Wanted width of a house.
        self.unit_width = self.uniform(5.0, 6.6)
        self.draw_house(
            self.unit_width,
            ("gable", "gable", "gambrel"),
            ("sill", "sill", "sill", "shutters"),
        )
        self.rise *= 0.8
        self.stoop = 1.6
        self.floor = min(self.plinth, 0.5)
        # Kind of bay window of the houses that have one.
        self.house_bay = self.bay
        if self.bay == "none":
            self.house_bay = "canted"
            self.bay_storeys = 1
        # Height by which every other pair of houses is lower.
        self.step = self.pick((0.0, 0.4, 0.8))
        # Distance by which every other pair of houses stands back.
        self.setback = self.pick((0.0, 0.0, 0.8))
        # Share of the houses with a gable to the street.
        self.crossed = self.uniform(0.0, 0.35)
        # Whether doors lie side by side in pairs.
        self.paired = self.chance(0.6)
        # Share of the houses with a bay window.
        self.bays = self.uniform(0.2, 0.9)

    def build(self) -> None:
        """Adds all parts of the houses, side by side along the front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + self.stoop
        back = min(y1 - 0.35, front + 10.5)
        count = max(1, round((x1 - x0) / self.unit_width))
        bounds = np.round(np.linspace(x0, x1, count + 1), 2).tolist()
        deep = back - front - self.setback > 6.0
        for k in range(count):
            low = (k // 2) % 2 == 1
            y = front + self.setback * (low and deep)
            area = (bounds[k], round(y, 2), bounds[k + 1], round(back, 2))
            house = self._varied(k)
            house.height = self.height - self.step * low
            _add_unit(
                house, area, self.site.blind_edges_of_unit(k, count),
                f"house_{k:02d}_", self.pick(_DOORS),
            )  # fmt: skip

    def _varied(self, k: int) -> _HouseInARow:
        """Returns the k-th house, which differs from its neighbours in details.

        Its parts and meshes are added to the parts and meshes of the terrace.
        """
        house = copy.copy(self)
        if self.chance(self.crossed) and k > 0:
            house.roof = "front"
        house.bay = self.house_bay if self.chance(self.bays) else "none"
        if self.paired:
            house.door_left = k % 2 == 1
        house.dormers = self.whole(0, self.dormers + 1)
        house.canopy = self.chance(0.5)
        house.chimney = k % 2 == 0
        return house


class ShopHouse(_HouseInARow):
    """The shop house: shops on the ground floor, flats above them."""

    def draw(self) -> None:
        """Samples sizes and style."""
        width, depth = self.site.width, self.site.depth
        roofs = _ROOFS_ABOVE_SHOPS[: 5 if width < min(10.0, depth) else 3]
        self.draw_house(width, roofs if depth <= 14.0 else ("flat",))
        self.window_pitch = max(self.window_pitch, (width + depth) / 22)
        self.stoop = 0.35
        # Height of the shops. A low house contains nothing but shops.
        self.floor = self.uniform(3.5, 4.2, 2)
        if self.height - self.floor < 3.2:
            self.roof = "flat"
            self.floor = round(min(3.4, self.height - 1.6), 2)
        self.shop_width = self.uniform(4.5, 7.5)
        # Share of the shops with an awning.
        self.awnings = self.uniform(0.2, 0.9)
        # Greatest number of bay windows above the shops.
        self.oriels = self.whole(0, 3)
        # How far the band above the shops sticks out.
        self.course = self.uniform(0.08, 0.2, 2)
        self.roof_items = self.draw_roof_items(
            "stair_house vents ac_unit skylight", 1, 5
        )

    def build(self) -> None:
        """Adds all parts of the shop house.

        The building's site must be a rectangle.
        """
        _, y0, _, y1 = self.site.bounds
        left, right, blind = _front_site(self)
        area = (left, y0 + self.stoop, right, y1 - 0.35)
        wing, storeys = _wing_and_storeys(self, area, blind)
        openings = Openings(self, wing)
        ground = self.floor
        room = wing.wall_top - 0.25 - ground
        upper = storeys if room > 2.4 else 0
        step = room / max(upper, 1)
        sides = [k for k in (1, 3) if k not in blind]
        head = min(2.25, step - 0.4)
        width = self.window_width
        for edges, pitch in (((0, 2), self.window_pitch), (sides, 4.0)):
            wing_openings.add_window_storeys(
                openings, edges, ground, step, upper, pitch, width, head=head
            )
        _add_ground(self, wing, openings)
        _add_oriels(self, wing, openings, upper, step)
        wing_openings.add_casings(openings, (0,), self.casing)
        bands = [Band(round(ground - 0.3, 2), ground, -self.course)]
        if self.roof == "flat" and room > 0.8:
            z = round(wing.wall_top - 0.45, 2)
            bands.append(Band(z, wing.wall_top, -0.25))
        glass = (wing_openings.GLASS_M, *wing_openings.SHOP_GLASS_M)
        openings.add_walls(glass, bands)
        _add_roof(self, wing)
        if self.roof == "flat":
            equip_roof(self, wing.outline, wing.floor, self.roof_items)
        elif self.chimney:
            _add_stack(self, wing, "chimney")


def _add_ground(p: ShopHouse, wing: Wing, openings: Openings) -> None:
    """Adds the shops, the door to the flats, service doors at the back."""
    wall = wing.wall(0)
    door = 1.7 * (p.floor < p.height - 3.0)
    length = wall.length
    left = p.door_left
    start, end = (door, length) if left else (0.0, length - door)
    wing_openings.add_shops(openings, 0, start, end, p.floor,
        width=p.shop_width, awnings=p.awnings,
    )  # fmt: skip
    if door:
        x = 0.9 if left else length - 0.9
        wing_openings.add_door(openings, 0, x, 0.0, height=2.3)
    back = [wing_openings.sash(1.2, 0.0, 1.4, 2.3), bays.gate(2.2, 2.3, 0.2)]
    openings.add_bays((2,), 0.5, 4.5, back, 0.8)


def _add_oriels(
    p: ShopHouse, wing: Wing, openings: Openings, upper: int, step: float
) -> None:
    if upper < 1 or step < 2.5 or p.oriels == 0:
        return
    wall = wing.wall(0)
    low = round(p.floor + 0.15, 2)
    high = round(p.floor + max(1, upper - 1) * step - 0.15, 2)
    high = min(high, wing.wall_top - 0.7)
    for a, b in bays.stretches(wall.length, wall.length / p.oriels, 0.4):
        width = min(2.4, b - a - 1.2)
        if width < 1.5:
            continue
        x = (a + b) / 2
        openings.clear(
            0, x - width / 2 - 0.15, x + width / 2 + 0.15, low, high + 0.4
        )
        bay_windows.add_bay_window(
            p, wall, x, width, 0.6, low, high,
            storeys=max(1, upper - 1), canted=p.bay != "box",
        )  # fmt: skip
