"""One house of a row: narrow, between neighbours, with a stoop in front."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from cns_drake.city.buildings.house_parts import dormers, house_walls, porches
from cns_drake.city.buildings.house_parts.openings import Openings
from cns_drake.city.buildings.parts import massing, pitched_roofs, wings
from cns_drake.city.buildings.parts.facades import Band, Patch
from cns_drake.city.buildings.parts.materials import Materials
from cns_drake.city.buildings.parts.roof_equipment import add_chimney
from cns_drake.city.buildings.parts.site import Assembly, Rgb
from cns_drake.city.buildings.parts.wings import Roof, Wing
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
    assembly: Assembly,
    materials: Materials,
    p: RowUnit,
    area: tuple[float, float, float, float],
    height: float,
    blind: frozenset[int],
    part: str = "",
    door_material: str = "accent",
) -> Wing:
    """Adds a house.

    Args:
        assembly: gets the chimney.
        materials: of a family house, gets all else.
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
    door = _add_entrance(materials, p, wing, openings, door_material)
    _add_bay(materials, p, wing, openings, storeys, step, door)
    house_walls.add_casings(materials, wing, openings, (0,), p.casing)
    bands = [Band(0.0, round(p.floor, 2), -0.05)]
    if storeys > 1:
        z = round(p.floor + step, 2)
        bands.append(Band(round(z - 0.15, 2), z, -0.05))
    if p.roof == "flat":
        z = round(wing.wall_top - 0.45, 2)
        bands.append(Band(z, wing.wall_top, -0.22))
    openings.add_walls(materials, (house_walls.GLASS_M,), bands)
    add_roof(materials, p, wing)
    if p.chimney:
        add_stack(assembly, p, wing, f"{part}chimney")
    return wing


def unit_box(
    p: RowUnit,
    area: tuple[float, float, float, float],
    height: float,
    blind: frozenset[int],
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
    kind = {"front": "gable", "stepped": "gable"}.get(p.roof, p.roof)
    roof = Roof(
        kind,
        across,
        eaves=0.0 if across else 0.35,
        verge=0.0 if p.roof == "stepped" else 0.3,
        thickness=_ROOF_M,
        parapet=0.45,
    )
    return Wing.at(x0, y0, x1, y1, wall_top, top, roof, blind), storeys


def _add_entrance(
    materials, p: RowUnit, wing: Wing, openings: Openings, material: str
) -> float:
    """Adds the door on its landing; returns where it is [m]."""
    wall = wing.wall(0)
    inset = min(0.95, 0.3 * wall.length)
    x = inset if p.door_left else wall.length - inset
    house_walls.add_door(
        materials, wing, openings, 0, x, p.floor, height=2.25,
        material=material,
    )  # fmt: skip
    count = max(1, round(p.floor / 0.17))
    run = min(0.29 * count, max(p.stoop - 0.5, 0.3 * p.stoop))
    landing = p.stoop - run
    a, b = x - 0.65, x + 0.65
    if p.floor > 0.05:
        slab = massing.box(a, b, -0.05, landing, -0.5, p.floor)
        materials.add("base", wall.place(slab))
        porches.add_steps(materials, wall, a, b, landing, p.floor, run)
    if p.canopy:
        z = p.floor + 2.4
        hood = massing.box(x - 0.8, x + 0.8, -0.05, 0.8, z, z + 0.14)
        materials.add("trim", wall.place(hood))
    return x


def _add_bay(materials, p: RowUnit, wing, openings, storeys, step, door):
    """Adds a bay window beside the door, in place of the windows there."""
    wall = wing.wall(0)
    a, b = (door + 0.8, wall.length) if p.door_left else (0.0, door - 0.8)
    width = min(b - a - 0.7, 2.6)
    if p.bay == "none" or width < 1.7:
        return
    count = min(p.bay_storeys, storeys)
    x = (a + b) / 2
    low = 0.0
    if p.bay == "oriel":
        if storeys < 2:
            return
        low, count = p.floor + step, min(count, storeys - 1)
    high = p.floor * (p.bay != "oriel") + low + count * step - 0.1
    high = min(high, wing.wall_top - 0.6)
    reach = min(0.6, 0.5 * p.stoop)
    openings.clear(0, x - width / 2 - 0.1, x + width / 2 + 0.1, low, high + 0.5)
    porches.add_bay_window(
        materials, wall, x, width, reach, round(low, 2), round(high, 2),
        storeys=count, canted=p.bay != "box",
    )  # fmt: skip


def add_roof(materials: Materials, p: RowUnit, wing: Wing) -> None:
    """Adds a roof with its dormers, firewalls or steps."""
    low = wing.wall_top + 0.45
    attic = wings.attic_window(0.8, low, low + 1.1, house_walls.GLASS_M)
    wings.add_roof(materials, wing, None if p.roof == "stepped" else attic)
    if p.roof == "stepped":
        for edge in (0, 2):
            steps = _stepped_gable(wing)
            materials.add("walls", *(wing.wall(edge).place(s) for s in steps))
        _add_gable_windows(materials, wing)
    elif p.roof in ("gable", "gambrel"):
        _add_firewalls(materials, wing)
        length = wing.x1 - wing.x0
        dormers.add_dormers(materials, wing, 0.0, length, p.dormers, p.dormer)


def _stepped_gable(wing: Wing) -> list[Mesh]:
    """Steps up to the middle of a gable, in wall coordinates."""
    middle = (wing.x1 - wing.x0) / 2
    rise = wing.top + 0.4 - wing.wall_top
    count = max(3, round(rise / 0.9))
    pieces = []
    for k in range(count):
        # Each step covers the slope below it.
        half = max(middle * (1.0 - k / count), 0.5)
        low = wing.wall_top + rise * (k / count) - 0.3
        top = wing.wall_top + rise * (k + 1) / count
        spot = (middle - half, middle + half, -0.32, 0.03, low, top)
        pieces.append(massing.box(*(round(v, 2) for v in spot)))
    return pieces


def _add_gable_windows(materials: Materials, wing: Wing) -> None:
    """Puts windows into the steps, their frames in front of the wall."""
    rise = wing.top - wing.wall_top
    for edge in (0, 2):
        wall, x = wing.wall(edge), (wing.x1 - wing.x0) / 2
        spots = [x - 1.1, x + 1.1] if rise > 3.2 else [x]
        z = wing.wall_top + 0.4
        for u in spots:
            pane = Patch(u - 0.45, u + 0.45, z, z + 1.2, house_walls.GLASS_M)
            frame = porches.casings([pane], (pane.depth,), "frame", 0.12)
            glass = porches.board(pane.x0, pane.x1, pane.z0, pane.z1, 0.05)
            materials.add("trim", *(wall.place(piece) for piece in frame))
            materials.add("glass", wall.place(glass))


def _add_firewalls(materials: Materials, wing: Wing) -> None:
    """Raises the side walls above the roof."""
    line = [(u, z + _FIREWALL_M) for u, z in wing.line]
    for x in (wing.x0, wing.x1 - 0.3):
        wall = pitched_roofs.shell(line, x, x + 0.3, _FIREWALL_M + 0.1)
        materials.add("walls", wall)


def add_stack(assembly: Assembly, p: RowUnit, wing: Wing, name: str) -> None:
    """Stands a chimney on the roof of a house."""
    if p.roof in ("front", "stepped"):
        x = wing.x0 + 0.3 * (wing.x1 - wing.x0)
        z = pitched_roofs.line_height(wing.line, x)
        spot = (x, wing.y0 + 0.6 * (wing.y1 - wing.y0), z - 0.6)
        add_chimney(assembly, name, spot, p.brick, yaw=math.pi / 2)
        return
    x = wing.x0 + 0.45 if p.door_left else wing.x1 - 0.45
    y = wing.y0 + 0.55 * (wing.y1 - wing.y0)
    z = pitched_roofs.line_height(wing.line, y)
    spot = (x, y, z - 0.8)
    scale = (0.8, 0.85, 1.0)
    add_chimney(
        assembly, name, spot, p.brick, item="chimney_row",
        yaw=math.pi / 2, scale=scale,
    )  # fmt: skip


def draw_unit(rng: np.random.Generator, width: float, roofs, bricks) -> RowUnit:
    """Draws the parameters of one house of a row."""
    return RowUnit(
        roof=roofs[int(rng.integers(len(roofs)))],
        rise=float(rng.uniform(0.75, 1.15)),
        storey=float(rng.uniform(2.75, 3.1)),
        floor=round(float(rng.choice([0.2, 0.5, 0.8, 1.0])), 2),
        door_left=bool(rng.random() < 0.5),
        window_pitch=max(1.7, float(rng.uniform(1.9, 2.5))),
        window_width=round(float(rng.uniform(0.9, 1.2)), 2),
        casing=("frame", "sill", "sill", "shutters")[int(rng.integers(4))],
        bay=("none", "canted", "box", "oriel")[int(rng.integers(4))],
        bay_storeys=int(rng.integers(1, 4)),
        dormers=int(rng.integers(0, max(2, round(width / 2.2)))),
        dormer=("gable", "shed")[int(rng.integers(2))],
        canopy=bool(rng.random() < 0.4),
        stoop=1.3,
        chimney=bool(rng.random() < 0.75),
        brick=bricks[int(rng.integers(len(bricks)))],
    )
