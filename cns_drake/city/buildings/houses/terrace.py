"""The terrace: a row of narrow houses, alike but not the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cns_drake.city.buildings.house_parts import family_house, row_unit
from cns_drake.city.buildings.house_parts.row_unit import RowUnit
from cns_drake.city.facades.assembly import Assembly, Dice, pick

_DOORS = ("accent", "trim", "roof")


class Parameters(family_house.Colours):
    """Parameters of a terrace; lengths in metres.

    Attributes:
        height: of the highest house.
        unit: what the houses have in common.
        width: wanted, of a house.
        step: by which every other pair of houses is lower.
        setback: by which every other pair stands back.
        crossed: how many houses turn their gable to the street.
        paired: whether doors lie side by side in pairs.
        bays: part of the houses with a bay window.
    """

    def __init__(self, d: Dice) -> None:
        width = d.uniform(5.0, 6.6)
        unit = row_unit.draw_unit(
            d.rng, width, ("gable", "gable", "gambrel"), family_house.BRICKS
        )
        if unit.bay == "none":
            unit = replace(unit, bay="canted", bay_storeys=1)
        if unit.casing == "frame":
            unit = replace(unit, casing="sill")
        self.height = d.height
        self.unit = replace(
            unit, stoop=1.6, floor=min(unit.floor, 0.5), rise=0.8 * unit.rise
        )
        self.width = width
        self.step = d.pick((0.0, 0.4, 0.8))
        self.setback = d.pick((0.0, 0.0, 0.8))
        self.crossed = d.uniform(0.0, 0.35)
        self.paired = d.chance(0.6)
        self.bays = d.uniform(0.2, 0.9)
        self.draw_colours(d)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the terrace along the front of a rectangle."""
    p.paint(out)
    x0, y0, x1, y1 = out.site.bounds
    front, back = y0 + p.unit.stoop, min(y1 - 0.35, y0 + p.unit.stoop + 10.5)
    count = max(1, round((x1 - x0) / p.width))
    bounds = np.round(np.linspace(x0, x1, count + 1), 2).tolist()
    deep = back - front - p.setback > 6.0
    for k in range(count):
        low = (k // 2) % 2 == 1
        unit = _varied(p, k, out.rng)
        y = front + p.setback * (low and deep)
        area = (bounds[k], round(y, 2), bounds[k + 1], round(back, 2))
        height, blind = p.height - p.step * low, out.site.blind_in(k, count)
        row_unit.add_unit(
            out, unit, area, height, blind,
            part=f"house_{k:02d}_", door_material=pick(out.rng, _DOORS),
        )  # fmt: skip


def _varied(p: Parameters, k: int, rng: np.random.Generator) -> RowUnit:
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
