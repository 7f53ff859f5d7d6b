"""The glass skyscraper: curtain walls with fins, setbacks, a crown."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade

_TINTS = (
    ((0.62, 0.66, 0.70), (0.24, 0.34, 0.42)),
    ((0.42, 0.45, 0.50), (0.17, 0.23, 0.30)),
    ((0.72, 0.71, 0.68), (0.28, 0.36, 0.38)),
    ((0.35, 0.33, 0.31), (0.25, 0.22, 0.18)),
)
_CORNERS = ("plain", "chamfered", "notched", "rounded")
_CROWNS = ("screen", "wedge", "stepped")

_ROOF_ITEMS = ("lift_house", "mast", *2 * ("cooling_tower",), "air_handler")


class Parameters:
    """Parameters of a glass skyscraper; lengths in metres.

    `setbacks` has, for each tier above the first, where it starts (as a
    fraction of the height) and how far each edge of the site steps back.
    """

    def __init__(self, d: Dice) -> None:
        outline = d.site.outline
        side = massing.shortest_side(outline)
        count = len(outline)
        heights = d.pick(((0.62,), (0.45, 0.78)))
        style = d.whole(0, 4)  # Ribbons, a grid, or fins (twice).
        total: np.ndarray = np.zeros(count)
        setbacks = []
        for fraction in heights:
            if count == 4:
                step = (
                    d.rng.uniform(0.06, 0.13, 4)
                    * (d.rng.random(4) < 0.6)
                    * side
                )
            else:
                reach = min(0.08 * side, 0.5 * massing.inset_limit(outline))
                step = np.full(count, d.rng.uniform(0.5, 1.0) * reach)
            total = total + np.round(step, 1)
            setbacks.append(
                (fraction + d.uniform(-0.06, 0.06), tuple(total.tolist()))
            )
        rgb, glass_rgb = d.pick(_TINTS)
        corner = d.pick(_CORNERS)
        self.height = d.height
        self.lobby_height = d.uniform(6.0, 9.0, 2)
        self.wall = tiers.Grooves(
            storey_height=d.uniform(3.7, 4.2),
            spandrel=d.uniform(0.6, 1.2, 2),
            ledge=d.uniform(0.3, 0.6, 2) * (style < 2),
            glass_depth=d.uniform(0.2, 0.4, 2),
            pitch=max(d.uniform(2.2, 3.6), d.site.open_length / 38),
            width=d.uniform(0.12, 0.3, 2) * (style > 0),
            reach=d.uniform(0.2, 0.55, 2),
            corner=0.0,
        )
        self.corner = corner if count == 4 else "plain"
        self.corner_size = round(d.uniform(0.08, 0.16) * side, 1)
        self.setbacks = tuple(setbacks)
        self.crown = d.pick(_CROWNS)
        self.crown_height = d.uniform(5.0, 9.0, 1)
        self.rgb = rgb
        self.glass_rgb = glass_rgb


def build(p: Parameters, out: Assembly) -> None:
    """Builds the skyscraper on any outline."""
    out.glass_rgb = p.glass_rgb
    base = out.site.outline
    plan = _shaped(base, p)
    top = _add_lobby(out, p, plan)
    levels = [*(round(f * p.height, 1) for f, _ in p.setbacks)]
    for k, goal in enumerate(levels):
        top = tiers.add_grooved(
            out, plan, p.wall, top, goal, f"tier_{k}", rise=1.1
        )
        terrace = Facade(1.1, (Band(0.8, 1.1, -0.1),))
        tiers.add_crown(out, plan, terrace, top, 1.0, part=f"terrace_{k}")
        plan = _shaped(massing.inset(base, p.setbacks[k][1]), p)
    rise = p.crown_height if p.crown == "screen" else 0.0
    goal = p.height - p.crown_height
    top = tiers.add_grooved(out, plan, p.wall, top, goal, "tier_top", rise=rise)
    _add_crown(out, p, plan, top)


def _shaped(outline: np.ndarray, p: Parameters) -> np.ndarray:
    size = p.corner_size
    if p.corner == "chamfered":
        return massing.chamfered(outline, size)
    if p.corner == "notched":
        return massing.notched(outline, 0.6 * size)
    if p.corner == "rounded":
        corners = dict.fromkeys(range(len(outline)), size)
        return massing.rounded(outline, corners, 3.5)
    return outline


def _add_lobby(out: Assembly, p: Parameters, plan: np.ndarray) -> float:
    height, length = p.lobby_height, details.WallFrame(plan, 0).length
    door = bays.entrance(min(5.0, length / 3), 3.6, 1.6)
    bar = bays.bar(0.12, 0.0, height - 0.8, 0.4)
    mullions = bays.rhythm(2 * p.wall.pitch, [bar], margin=1.0)
    bands = (
        Band(0.0, height - 0.8, 0.7),
        Band(0.0, 0.3, 0.45),
        Band(height - 0.8, height - 0.5, -0.25),
    )
    layout = bays.with_door(mullions, door, 7.0)
    columns = details.piers(
        plan, 7.0, 0.9, 0.25, 0.0, height - 0.8, depth=0.75, margin=0.55,
        entrance=min(5.8, length / 2),
    )  # fmt: skip
    roof = details.front_canopy(plan, 4.0, 1.5, 4.2)
    lobby = Facade(height, bands, layout, (0.7,))
    return tiers.add_ground(out, plan, lobby, [columns, roof])


def _add_crown(
    out: Assembly, p: Parameters, plan: np.ndarray, z0: float
) -> None:
    height = round(p.height - z0, 3)
    if p.crown == "wedge":
        out.add("crown", massing.sloped_prism(plan, z0, height, 0.35))
        return
    if p.crown == "stepped":
        low = round(0.45 * height, 2)
        ledge = Facade(low, (Band(low - 0.5, low, -0.3),))
        tiers.add_crown(out, plan, ledge, z0, 1.0, part="crown_low")
        reach = 0.12 * massing.shortest_side(plan)
        plan = massing.inset(plan, min(reach, massing.inset_limit(plan)))
        z0, height = round(z0 + low - 1.0, 3), round(height - low + 1.0, 3)
    louvres = tuple(
        Band(z, z + 0.5, 0.2)
        for z in np.arange(0.8, height - 1.5, 1.0).tolist()
    )
    parapet = 0.7 * height if p.crown == "screen" else 1.0
    walls = Facade(height, louvres)
    roof = tiers.add_crown(out, plan, walls, z0, parapet)
    equip_roof(out, plan, roof, _ROOF_ITEMS)
