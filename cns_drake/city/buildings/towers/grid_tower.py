"""The gridded office tower: deep frames, plant floors, offset slabs."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice, Site
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade

_CLADDINGS = (
    (0.80, 0.78, 0.74),
    (0.62, 0.60, 0.58),
    (0.48, 0.50, 0.53),
    (0.72, 0.60, 0.48),
    (0.56, 0.44, 0.38),
)
_GLASSES = ((0.20, 0.26, 0.31), (0.24, 0.32, 0.34), (0.16, 0.20, 0.26))


class Parameters:
    """Parameters of a tower; lengths in metres.

    Attributes:
        height: of the crown.
        plan: `box`, `offset` (two slabs that slide past each other) or
            `notched`.
        shift: of the slabs or size of the notches, as a part of the depth.
        lobby: height of the ground floor.
        storey: wanted height of a storey.
        pitch: of the frames.
        pier, beam: what the frames leave of wall beside and below windows.
        recess: of the windows.
        double: whether each frame spans two storeys.
        waist: where a plant floor interrupts the grid, as a part of the
            height; 0 for none.
        crown: height of the screen around the roof.
    """

    def __init__(self, d: Dice) -> None:
        self.height = d.height
        self.plan = d.pick(("box", "offset", "notched"))
        self.shift = d.uniform(0.1, 0.18)
        self.lobby = d.uniform(5.5, 8.0, 2)
        self.storey = d.uniform(3.5, 4.0)
        self.pitch = max(d.uniform(3.4, 5.0), d.site.open_length / 28)
        self.pier = d.uniform(0.5, 0.9, 2)
        self.beam = d.uniform(0.5, 0.9, 2)
        self.recess = d.uniform(0.4, 0.8, 2)
        self.double = d.chance(0.4)
        self.waist = d.uniform(0.45, 0.65) if d.height > 55.0 else 0.0
        self.crown = d.uniform(2.4, 4.5, 2)
        self.roof_items = d.some_of(
            "lift_house cooling_tower air_handler cooling_tower mast ac_unit",
            3,
            7,
        )
        self.rgb = d.pick(_CLADDINGS)
        self.glass_rgb = d.pick(_GLASSES)

    @property
    def margin(self) -> float:
        """Width of solid wall at corners, which keeps recesses apart [m]."""
        return self.recess + 0.15


def build(p: Parameters, out: Assembly) -> None:
    """Builds the tower on a rectangle."""
    out.glass_rgb = p.glass_rgb
    plan = np.round(_plan(p, out.site), 2)
    top = _add_lobby(out, p, plan)
    if p.waist > 0:
        top = _add_grid(out, p, plan, top, p.waist * p.height, "low")
        top = _add_plant_floor(out, p, plan, top)
    top = _add_grid(out, p, plan, top, p.height - p.crown, "storey")
    rim = round(p.height - top, 3)
    louvre = bays.window(p.pitch - p.pier, 0.5, rim - 0.5, 0.25)
    louvres = bays.rhythm(p.pitch, [louvre], p.margin)
    crown = Facade(rim, (Band(0.0, 0.25, -0.1),), louvres)
    roof = tiers.add_crown(out, plan, crown, top, rim - 0.6, thickness=0.45)
    free = massing.inset(plan, 0.5)
    equip_roof(out, free, roof, p.roof_items, clear=0.8)


def _plan(p: Parameters, site: Site) -> np.ndarray:
    """Returns the outline, its front first, a little within the site."""
    x0, y0, x1, y1 = site.bounds
    base = massing.rectangle(x0 + 0.3, y0 + 0.3, x1 - 0.3, y1 - 0.3)
    if p.plan == "notched":
        return massing.notched(base, p.shift * massing.shortest_side(base))
    if p.plan == "box":
        return base
    (a, c), (b, d) = base[0], base[2]
    sx, my = p.shift * (b - a), (c + d) / 2
    return np.array(
        [(a, c), (b - sx, c), (b - sx, my), (b, my), (b, d), (a + sx, d),
         (a + sx, my), (a, my)]
    )  # fmt: skip


def _add_lobby(out: Assembly, p: Parameters, plan: np.ndarray) -> float:
    """Adds a tall glazed hall behind the feet of the piers."""
    h = p.lobby
    pane = bays.window(p.pitch - p.pier, 0.3, h - 1.2, p.recess, transom=3.2)
    glazing = bays.rhythm(p.pitch, [pane], p.margin)
    door = bays.entrance(3.6, 3.2, p.recess + 0.6, surround=0.15)
    layout = bays.with_door(glazing, door, 6.4)
    facade = Facade(h, (Band(h - 0.9, h - 0.2, -0.12),), layout, (p.recess,))
    half = min(4.5, details.WallFrame(plan, 0).length / 2 - 0.6)
    lid = details.front_canopy(plan, half, 1.6, 3.7)
    return tiers.add_ground(out, plan, facade, [lid])


def _add_grid(
    out: Assembly,
    p: Parameters,
    plan: np.ndarray,
    z0: float,
    goal: float,
    part: str,
) -> float:
    """Adds storeys behind frames; returns their top [m]."""
    unit = p.storey * (2 if p.double else 1)
    groups, per_group, height = tiers.divided(goal - z0, unit, 7)
    # A part of the beam closes the storey's top.
    low, high = round(p.beam - 0.25, 2), height - 0.25
    frame = bays.window(
        p.pitch - p.pier, low, high, p.recess, pier=p.pier / 2,
        transom=round((low + high) / 2, 2) if p.double else None,
    )  # fmt: skip
    layout = bays.rhythm(p.pitch, [frame], p.margin)
    facade = Facade(height, (), layout, (p.recess,))
    return tiers.add_storeys(
        out, plan, facade, z0, groups, per_group, part=part
    )


def _add_plant_floor(
    out: Assembly, p: Parameters, plan: np.ndarray, z0: float
) -> float:
    """Adds a floor of louvres, set back behind the grid."""
    inner = massing.inset(plan, p.recess)
    slats = [
        Band(round(0.4 + 0.6 * k, 2), round(0.7 + 0.6 * k, 2), 0.18)
        for k in range(5)
    ]
    facade = Facade(3.9, tuple(slats))
    ring = tiers.block(inner, facade, z0)
    out.add("plant", ring)
    top = round(z0 + 3.9, 3)
    for z, up in ((z0, True), (top, False)):
        out.add(f"ledge_{int(up)}", massing.flat(plan, z, up=up))
    return top
