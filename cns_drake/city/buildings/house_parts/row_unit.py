"""One house of a row: narrow, between neighbours, with a stoop in front."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from cns_drake.city.facades import details, house_walls, massing, roofs, wings
from cns_drake.city.facades.assembly import Assembly, Rgb, pick
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import add_chimney
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
        rise: of the roof, as a part of half its span.
        storey: wanted height of a storey.
        floor: height of the ground floor above the street.
        door_left: whether the door is on the left.
        window_pitch, window_width: of the windows.
        casing: style of the windows' frames.
        bay: `none`, `canted`, `box` (on the ground) or `oriel` (above it).
        bay_storeys: of the bay window.
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
        height: of its top [m].
        blind: edges against a neighbour.
        part: prefix of its own visuals.
        door_material: of the door's leaf.

    Returns:
        The box of the house.
    """
    wing, storeys = unit_box(p, area, height, blind)
    openings = Openings(wing)
    step = (wing.wall_top - 0.25 - p.floor) / storeys
    sides = [k for k in (1, 3) if k not in blind]
    for edges, pitch in (((0, 2), p.window_pitch), (sides, 4.2)):
        house_walls.add_rows(
            openings, edges, p.floor, step, storeys, pitch, p.window_width,
            head=min(2.2, step - 0.45),
        )  # fmt: skip
    door = _add_entrance(out, p, wing, openings, door_material)
    _add_bay(out, p, wing, openings, storeys, step, door)
    house_walls.add_casings(out, wing, openings, (0,), p.casing)
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
    house_walls.add_door(
        out, wing, openings, 0, x, p.floor, height=2.25, material=material
    )
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


def draw_unit(
    rng: np.random.Generator,
    width: float,
    roofs: Sequence[str],
    bricks: Sequence[Rgb],
) -> RowUnit:
    """Draws the parameters of one house of a row."""
    return RowUnit(
        roof=pick(rng, roofs),
        rise=float(rng.uniform(0.75, 1.15)),
        storey=float(rng.uniform(2.75, 3.1)),
        floor=round(float(rng.choice([0.2, 0.5, 0.8, 1.0])), 2),
        door_left=bool(rng.random() < 0.5),
        window_pitch=max(1.7, float(rng.uniform(1.9, 2.5))),
        window_width=round(float(rng.uniform(0.9, 1.2)), 2),
        casing=pick(rng, ("frame", "sill", "sill", "shutters")),
        bay=pick(rng, ("none", "canted", "box", "oriel")),
        bay_storeys=int(rng.integers(1, 4)),
        dormers=int(rng.integers(0, max(2, round(width / 2.2)))),
        dormer=pick(rng, ("gable", "shed")),
        canopy=bool(rng.random() < 0.4),
        stoop=1.3,
        chimney=bool(rng.random() < 0.75),
        brick=pick(rng, bricks),
    )
