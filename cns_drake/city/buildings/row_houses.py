"""Houses in a row: single, as a terrace, above a shop."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import numpy as np

from cns_drake.city.facades import (
    bays,
    details,
    house_walls,
    massing,
    roofs,
    wings,
)
from cns_drake.city.facades.assembly import Assembly, Building, Dice, Rgb, pick
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import add_chimney, equip_roof
from cns_drake.city.facades.walls import Band, Patch
from cns_drake.city.facades.wings import Roof, Wing
from cns_drake.city.geometry.mesh import Mesh

_ROOF_M = 0.2
# Party walls rise this far above a roof whose ridge follows the street [m].
_FIREWALL_M = 0.25


@dataclass(frozen=True)
class RowUnit:
    """Parameters of one house; lengths in metres.

    Attributes:
        roof: `gable` and `gambrel` along the street, `front` with its gable
            to the street, `stepped` with steps on it, `flat` with a cornice.
        rise: rise of the roof, as a part of half its span.
        storey: wanted height of a storey.
        floor: height of the ground floor above the street.
        door_left: whether the door is on the left.
        window_pitch, window_width: those of the windows.
        casing: style of the windows' frames.
        bay: `none`, `canted`, `box` (on the ground) or `oriel` (above it).
        bay_storeys: storeys of the bay window.
        dormers: how many at most, and their shape.
        canopy: whether there is a hood above the door.
        stoop: room in front of the wall for steps.
        chimney: whether it has one, in `brick`.
    """

    roof: str
    rise: float
    storey: float
    floor: float
    door_left: bool
    window_pitch: float
    window_width: float
    casing: str
    bay: str
    bay_storeys: int
    dormers: int
    dormer: str
    canopy: bool
    stoop: float
    chimney: bool
    brick: Rgb


def add_unit(
    out: Assembly,
    p: RowUnit,
    area: massing.Area,
    height: float,
    blind: frozenset[int],
    part: str = "",
    door_material: str = "accent",
) -> Wing:
    """Adds a house.

    Args:
        out: the building, with the materials of a family house.
        p: the house.
        area: x0, y0, x1, y1 of its walls; `p.stoop` in front stays free.
        height: height of its top [m].
        blind: edges against a neighbour.
        part: prefix of its own visuals.
        door_material: material of the door's leaf.

    Returns:
        The box of the house.
    """
    wing, storeys = unit_box(p, area, height, blind)
    openings = Openings(wing)
    step = (wing.wall_top - 0.25 - p.floor) / storeys
    sides = [k for k in (1, 3) if k not in blind]
    for edges, pitch in (((0, 2), p.window_pitch), (sides, 4.2)):
        openings.add_rows(edges, p.floor, step, storeys, pitch, p.window_width,
            head=min(2.2, step - 0.45),
        )  # fmt: skip
    door = _add_entrance(out, p, wing, openings, door_material)
    _add_bay(out, p, wing, openings, storeys, step, door)
    openings.add_casings(out, (0,), p.casing)
    bands = [Band(0.0, round(p.floor, 2), -0.05)]
    if storeys > 1:
        z = round(p.floor + step, 2)
        bands.append(Band(round(z - 0.15, 2), z, -0.05))
    if p.roof == "flat":
        z = round(wing.wall_top - 0.45, 2)
        bands.append(Band(z, wing.wall_top, -0.22))
    openings.add_walls(out, (house_walls.GLASS_M,), bands)
    add_roof(out, p, wing)
    if p.chimney:
        add_stack(out, p, wing, f"{part}chimney")
    return wing


def unit_box(
    p: RowUnit, area: massing.Area, height: float, blind: frozenset[int]
) -> tuple[Wing, int]:
    """Returns the walls under their roof, and the storeys above `p.floor`."""
    x0, y0, x1, y1 = area
    across = p.roof in ("front", "stepped")
    span = (x1 - x0) if across else (y1 - y0)
    top, rise = height, p.rise * span / 2
    if p.roof == "flat":
        rise = 0.5
    elif p.roof == "stepped":
        top -= 0.4
    elif not across:
        top -= _FIREWALL_M
    room = top - p.floor - _ROOF_M - 0.25
    storeys = max(1, round((room - rise) / p.storey))
    if p.roof == "flat":
        wall_top = top - rise
    else:
        wanted = p.floor + storeys * p.storey + 0.25
        least = top - _ROOF_M - 0.75 * span
        wall_top = min(max(wanted, least), top - _ROOF_M - 0.1 * span)
    kind = "gable" if across else p.roof
    eaves, verge = 0.0 if across else 0.35, 0.0 if p.roof == "stepped" else 0.3
    roof = Roof(kind, across, eaves, verge, _ROOF_M, parapet=0.45)
    return Wing.at(x0, y0, x1, y1, wall_top, top, roof, blind), storeys


def _add_entrance(
    out: Assembly, p: RowUnit, wing: Wing, openings: Openings, material: str
) -> float:
    """Adds the door on its landing; returns where it is [m]."""
    wall = wing.wall(0)
    inset = min(0.95, 0.3 * wall.length)
    x = inset if p.door_left else wall.length - inset
    openings.add_door(out, 0, x, p.floor, height=2.25, material=material)
    count = max(1, round(p.floor / 0.17))
    run = min(0.29 * count, max(p.stoop - 0.5, 0.3 * p.stoop))
    landing = p.stoop - run
    a, b = x - 0.65, x + 0.65
    if p.floor > 0.05:
        slab = wall.standing(a, b, -0.05, landing, p.floor, bottom=True)
        out.add_to("base", slab)
        details.add_steps(out, wall, a, b, landing, p.floor, run)
    if p.canopy:
        z = p.floor + 2.4
        hood = wall.box(x - 0.8, x + 0.8, -0.05, 0.8, z, z + 0.14)
        out.add_to("trim", hood)
    return x


def _add_bay(
    out: Assembly,
    p: RowUnit,
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
    x, low, foot = (a + b) / 2, 0.0, p.floor
    if p.bay == "oriel":
        low, foot, count = p.floor + step, 0.0, min(count, storeys - 1)
    high = min(foot + low + count * step - 0.1, wing.wall_top - 0.6)
    reach = min(0.6, 0.5 * p.stoop)
    openings.clear(0, x - width / 2 - 0.1, x + width / 2 + 0.1, low, high + 0.5)
    details.add_bay_window(
        out, wall, x, width, reach, round(low, 2), round(high, 2),
        storeys=count, canted=p.bay != "box",
    )  # fmt: skip


def add_roof(out: Assembly, p: RowUnit, wing: Wing) -> None:
    """Adds a roof with its dormers, firewalls or steps."""
    low = wing.wall_top + 0.45
    attic = wings.attic_window(0.8, low, low + 1.1, house_walls.GLASS_M)
    wings.add_roof(out, wing, None if p.roof == "stepped" else attic)
    if p.roof == "stepped":
        for edge in (0, 2):
            out.add_to("walls", *_stepped_gable(wing, wing.wall(edge)))
        _add_gable_windows(out, wing)
    elif p.roof in ("gable", "gambrel"):
        _add_firewalls(out, wing)
        wings.add_dormers(out, wing, 0.0, wing.width, p.dormers, p.dormer)


def _stepped_gable(wing: Wing, wall: details.WallFrame) -> list[Mesh]:
    """Steps up to the middle of a gable."""
    middle = wing.width / 2
    rise = wing.top + 0.4 - wing.wall_top
    count = max(3, round(rise / 0.9))
    pieces = []
    for k in range(count):
        # Each step covers the slope below it.
        half = max(middle * (1.0 - k / count), 0.5)
        low = wing.wall_top + rise * (k / count) - 0.3
        top = wing.wall_top + rise * (k + 1) / count
        spot = (middle - half, middle + half, -0.32, 0.03, low, top)
        pieces.append(wall.box(*(round(v, 2) for v in spot)))
    return pieces


def _add_gable_windows(out: Assembly, wing: Wing) -> None:
    """Puts windows into the steps, their frames in front of the wall."""
    x, z = wing.width / 2, wing.wall_top + 0.4
    spots = [x - 1.1, x + 1.1] if wing.top - wing.wall_top > 3.2 else [x]
    for edge in (0, 2):
        wall = wing.wall(edge)
        for u in spots:
            pane = Patch(u - 0.45, u + 0.45, z, z + 1.2, house_walls.GLASS_M)
            frame = details.casings([pane], (pane.depth,), "frame", 0.12)
            glass = details.board(pane.x0, pane.x1, pane.z0, pane.z1, 0.05)
            out.add_to("trim", *(wall.place(piece) for piece in frame))
            out.add_to("glass", wall.place(glass))


def _add_firewalls(out: Assembly, wing: Wing) -> None:
    """Raises the side walls above the roof."""
    line = [(u, z + _FIREWALL_M) for u, z in wing.line]
    for x in (wing.x0, wing.x1 - 0.3):
        wall = roofs.shell(line, x, x + 0.3, _FIREWALL_M + 0.1)
        out.add_to("walls", wall)


def add_stack(out: Assembly, p: RowUnit, wing: Wing, name: str) -> None:
    """Stands a chimney on the roof of a house."""
    yaw = math.pi / 2
    if p.roof in ("front", "stepped"):
        x = wing.x0 + 0.3 * wing.width
        z = roofs.line_height(wing.line, x)
        spot = (x, wing.y0 + 0.6 * wing.depth, z - 0.6)
        add_chimney(out, name, spot, p.brick, yaw=yaw)
        return
    x = wing.x0 + 0.45 if p.door_left else wing.x1 - 0.45
    y = wing.y0 + 0.55 * wing.depth
    spot = (x, y, roofs.line_height(wing.line, y) - 0.8)
    row, scale = "chimney_row", (0.8, 0.85, 1.0)
    add_chimney(out, name, spot, p.brick, item=row, yaw=yaw, scale=scale)


def draw_unit(d: Dice, width: float, roofs: Sequence[str]) -> RowUnit:
    """Draws the parameters of one house of a row."""
    return RowUnit(
        roof=d.pick(roofs),
        rise=d.uniform(0.75, 1.15),
        storey=d.uniform(2.75, 3.1),
        floor=round(float(d.rng.choice([0.2, 0.5, 0.8, 1.0])), 2),
        door_left=d.chance(0.5),
        window_pitch=max(1.7, d.uniform(1.9, 2.5)),
        window_width=d.uniform(0.9, 1.2, 2),
        casing=d.pick(("frame", "sill", "sill", "shutters")),
        bay=d.pick(("none", "canted", "box", "oriel")),
        bay_storeys=d.whole(1, 4),
        dormers=d.whole(0, max(2, round(width / 2.2))),
        dormer=d.pick(("gable", "shed")),
        canopy=d.chance(0.4),
        stoop=1.3,
        chimney=d.chance(0.75),
        brick=d.pick(d.kind.choices["bricks"]),
    )


# A house deeper than this gets a lower wing at its back [m].
_MOST_DEPTH = 10.5


class RowHouse(Building):
    """The row house: one narrow house between its neighbours, with a stoop."""

    def draw(self, d: Dice) -> None:
        roofs = ["gable", "gambrel", "flat"]
        if d.width < 9.5:
            roofs += ["front", "stepped"]
        unit = draw_unit(d, d.width, roofs)
        self.unit = unit
        self.annex_height = d.uniform(2.8, 3.6, 2)
        self.annex_width = d.uniform(0.45, 0.65)
        self.annex_left = d.chance(0.5)

    def build(self) -> None:
        """Builds the house on a rectangle."""
        x0, y0, x1, y1 = self.site.bounds
        # Eaves and cornices stay on the lot, except towards the neighbours.
        side = 0.3 * (self.unit.roof == "flat")
        blind = self.site.blind_edges & {1, 3}
        left, right = x0 + side * (3 not in blind), x1 - side * (1 not in blind)
        front, back = y0 + self.unit.stoop, y1 - 0.35
        deep = min(back - front, _MOST_DEPTH)
        if back - front - deep < 1.5:
            deep = back - front
        area = (left, front, right, front + deep)
        main = add_unit(self, self.unit, area, self.height, blind)
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
    openings = Openings(Wing.at(*area, wall_top, top, roof, blind), (main,))
    openings.row((1, 2, 3), 0.9, 2.6, [house_walls.sash(1.1, 0.1, 0.9, 2.1)])
    openings.enclose(p, (house_walls.GLASS_M,))


_DOORS = ("accent", "trim", "roof")


class Terrace(Building):
    """The terrace: a row of narrow houses, alike but not the same.

    Attributes:
        unit: what the houses have in common.
        width: wanted width of a house.
        step: height by which every other pair of houses is lower.
        setback: distance by which every other pair stands back.
        crossed: part of the houses with their gable to the street.
        paired: whether doors lie side by side in pairs.
        bays: part of the houses with a bay window.
    """

    def draw(self, d: Dice) -> None:
        width = d.uniform(5.0, 6.6)
        unit = draw_unit(d, width, ("gable", "gable", "gambrel"))
        if unit.bay == "none":
            unit = replace(unit, bay="canted", bay_storeys=1)
        if unit.casing == "frame":
            unit = replace(unit, casing="sill")
        self.unit = replace(
            unit, stoop=1.6, floor=min(unit.floor, 0.5), rise=0.8 * unit.rise
        )
        self.width = width
        self.step = d.pick((0.0, 0.4, 0.8))
        self.setback = d.pick((0.0, 0.0, 0.8))
        self.crossed = d.uniform(0.0, 0.35)
        self.paired = d.chance(0.6)
        self.bays = d.uniform(0.2, 0.9)

    def build(self) -> None:
        """Builds the terrace along the front of a rectangle."""
        x0, y0, x1, y1 = self.site.bounds
        front, back = (
            y0 + self.unit.stoop,
            min(y1 - 0.35, y0 + self.unit.stoop + 10.5),
        )
        count = max(1, round((x1 - x0) / self.width))
        bounds = np.round(np.linspace(x0, x1, count + 1), 2).tolist()
        deep = back - front - self.setback > 6.0
        for k in range(count):
            low = (k // 2) % 2 == 1
            unit = _varied(self, k, self.rng)
            y = front + self.setback * (low and deep)
            area = (bounds[k], round(y, 2), bounds[k + 1], round(back, 2))
            height, blind = (
                self.height - self.step * low,
                self.site.blind_in(k, count),
            )
            add_unit(
                self, unit, area, height, blind,
                part=f"house_{k:02d}_", door_material=pick(self.rng, _DOORS),
            )  # fmt: skip


def _varied(p: Terrace, k: int, rng: np.random.Generator) -> RowUnit:
    """Returns one house: single things differ, the rest stays."""
    crossed = rng.random() < p.crossed
    bay = p.unit.bay if rng.random() < p.bays else "none"
    return replace(
        p.unit,
        roof="front" if crossed and k > 0 else p.unit.roof,
        door_left=k % 2 == 1 if p.paired else p.unit.door_left,
        bay=bay,
        dormers=int(rng.integers(0, p.unit.dormers + 1)),
        canopy=bool(rng.random() < 0.5),
        chimney=k % 2 == 0,
    )


class ShopHouse(Building):
    """The shop house: shops on the ground floor, flats above them.

    Attributes:
        unit: the flats; its floor is the top of the shops.
        awnings: part of the shops with an awning.
        oriels: bay windows above the shops, at most.
        course: how far the band above the shops sticks out.
    """

    def draw(self, d: Dice) -> None:
        x0, y0, x1, y1 = d.site.bounds
        roofs = ["flat", "gable", "gambrel"]
        if d.width < 10.0 and d.depth > d.width:
            roofs += ["front", "stepped"]
        if d.depth > 14.0:
            roofs = ["flat"]
        unit = draw_unit(d, d.width, roofs)
        ground = d.uniform(3.5, 4.2, 2)
        if d.height - ground < 3.2:
            ground, unit = (
                min(3.4, d.height - 1.6),
                replace(unit, roof="flat"),
            )
        pitch = max(unit.window_pitch, (x1 - x0 + y1 - y0) / 22)
        self.unit = replace(
            unit, floor=round(ground, 2), stoop=0.35, window_pitch=pitch
        )
        self.shop_width = d.uniform(4.5, 7.5)
        self.awnings = d.uniform(0.2, 0.9)
        self.oriels = d.whole(0, 3)
        self.course = d.uniform(0.08, 0.2, 2)
        self.roof_items = d.some_of("stair_house vents ac_unit skylight", 1, 5)

    def build(self) -> None:
        """Builds the house on a rectangle."""
        x0, y0, x1, y1 = self.site.bounds
        side = 0.3 * (self.unit.roof == "flat")
        blind = self.site.blind_edges & {1, 3}
        left, right = x0 + side * (3 not in blind), x1 - side * (1 not in blind)
        area = (left, y0 + self.unit.stoop, right, y1 - 0.35)
        wing, storeys = unit_box(self.unit, area, self.height, blind)
        openings = Openings(wing)
        ground = self.unit.floor
        room = wing.wall_top - 0.25 - ground
        upper = storeys if room > 2.4 else 0
        step = room / max(upper, 1)
        sides = [k for k in (1, 3) if k not in blind]
        head = min(2.25, step - 0.4)
        for edges, pitch in (((0, 2), self.unit.window_pitch), (sides, 4.0)):
            openings.add_rows(edges, ground, step, upper, pitch,
                self.unit.window_width, head=head,
            )  # fmt: skip
        _add_ground(self, wing, openings)
        _add_oriels(self, wing, openings, upper, step)
        openings.add_casings(self, (0,), self.unit.casing)
        bands = [Band(round(ground - 0.3, 2), ground, -self.course)]
        if self.unit.roof == "flat" and room > 0.8:
            z = round(wing.wall_top - 0.45, 2)
            bands.append(Band(z, wing.wall_top, -0.25))
        glass = (house_walls.GLASS_M, *house_walls.SHOP_GLASS_M)
        openings.add_walls(self, glass, bands)
        add_roof(self, self.unit, wing)
        if self.unit.roof == "flat":
            equip_roof(self, wing.outline, wing.floor, self.roof_items)
        elif self.unit.chimney:
            add_stack(self, self.unit, wing, "chimney")


def _add_ground(p: ShopHouse, wing: Wing, openings: Openings) -> None:
    """Adds the shops, the door to the flats, service doors at the back."""
    wall = wing.wall(0)
    door, length = 1.7 * (p.unit.floor < p.height - 3.0), wall.length
    left = p.unit.door_left
    start, end = (door, length) if left else (0.0, length - door)
    openings.add_shops(p, 0, start, end, p.unit.floor,
        width=p.shop_width, awnings=p.awnings,
    )  # fmt: skip
    if door:
        x = 0.9 if left else length - 0.9
        openings.add_door(p, 0, x, 0.0, height=2.3)
    back = [house_walls.sash(1.2, 0.0, 1.4, 2.3), bays.gate(2.2, 2.3, 0.2)]
    openings.row((2,), 0.5, 4.5, back, 0.8)


def _add_oriels(
    p: ShopHouse, wing: Wing, openings: Openings, upper: int, step: float
) -> None:
    if upper < 1 or step < 2.5 or p.oriels == 0:
        return
    wall = wing.wall(0)
    low = round(p.unit.floor + 0.15, 2)
    high = round(p.unit.floor + max(1, upper - 1) * step - 0.15, 2)
    high = min(high, wing.wall_top - 0.7)
    for a, b in bays.stretches(wall.length, wall.length / p.oriels, 0.4):
        width = min(2.4, b - a - 1.2)
        if width < 1.5:
            continue
        x = (a + b) / 2
        openings.clear(
            0, x - width / 2 - 0.15, x + width / 2 + 0.15, low, high + 0.4
        )
        details.add_bay_window(
            p, wall, x, width, 0.6, low, high,
            storeys=max(1, upper - 1), canted=p.unit.bay != "box",
        )  # fmt: skip
