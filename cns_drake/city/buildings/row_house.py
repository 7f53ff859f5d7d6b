"""The row house: one narrow house between its neighbours, with a stoop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.city.buildings import family_house, house_walls, row_unit, wings
from cns_drake.city.buildings.openings import Openings
from cns_drake.city.buildings.row_unit import RowUnit
from cns_drake.city.buildings.site import Archetype, Assembly, Site, pick
from cns_drake.city.buildings.wings import Roof, Wing
from cns_drake.city.geometry.structures import Model

_WALLS = (
    *family_house.BRICKS,
    (0.80, 0.74, 0.62),
    (0.70, 0.58, 0.46),
    (0.66, 0.70, 0.68),
    (0.78, 0.62, 0.50),
)
# A house deeper than this gets a lower wing at its back [m].
_MOST_DEPTH = 10.5


@dataclass(frozen=True)
class RowHouse:
    """Parameters of a row house; lengths in metres."""

    height: float
    unit: RowUnit
    annex_height: float
    annex_width: float
    annex_left: bool
    rgb: tuple[float, float, float]
    roof_rgb: tuple[float, float, float]
    accent_rgb: tuple[float, float, float]


def draw(site: Site, height: float, rng: np.random.Generator) -> RowHouse:
    """Draws the parameters of one house."""
    x0, _, x1, _ = site.bounds
    roofs = ["gable", "gambrel", "flat"]
    if x1 - x0 < 9.5:
        roofs += ["front", "stepped"]
    unit = row_unit.draw_unit(rng, x1 - x0, roofs, family_house.BRICKS)
    return RowHouse(
        height=height,
        unit=unit,
        annex_height=round(float(rng.uniform(2.8, 3.6)), 2),
        annex_width=float(rng.uniform(0.45, 0.65)),
        annex_left=bool(rng.random() < 0.5),
        rgb=pick(rng, _WALLS),
        roof_rgb=pick(rng, family_house.ROOFS),
        accent_rgb=pick(rng, family_house.ACCENTS),
    )


def build(p: RowHouse, site: Site, rng: np.random.Generator) -> Model:
    """Builds the house on a rectangle."""
    assembly = Assembly(site.name, p.rgb)
    materials = family_house.house_materials(
        assembly, p.rgb, p.roof_rgb, p.accent_rgb
    )
    x0, y0, x1, y1 = site.bounds
    # Eaves and cornices stay on the lot, except towards the neighbours.
    side = 0.3 * (p.unit.roof == "flat")
    left = x0 + side * (3 not in site.blind_edges)
    right = x1 - side * (1 not in site.blind_edges)
    front, back = y0 + p.unit.stoop, y1 - 0.35
    deep = min(back - front, _MOST_DEPTH)
    if back - front - deep < 1.5:
        deep = back - front
    main = row_unit.add_unit(
        assembly,
        materials,
        p.unit,
        (left, front, right, front + deep),
        p.height,
        site.blind_edges & {1, 3},
    )
    if back - main.y1 > 1.0:
        _add_annex(materials, p, main, back)
    materials.finish(assembly)
    return assembly.model(site)


def _add_annex(materials, p: RowHouse, main: Wing, back: float) -> None:
    """Adds a low wing behind the house, on one side."""
    width = p.annex_width * (main.x1 - main.x0)
    x0 = main.x0 if p.annex_left else main.x1 - width
    blind = main.blind & {3 if p.annex_left else 1}
    top = min(p.annex_height + 0.9, main.wall_top)
    roof = Roof("shed", True, 0.0, 0.2, 0.18)
    wall_top = min(p.annex_height, top - 0.4)
    annex = Wing.at(
        x0, main.y1 - 0.06, x0 + width, back, wall_top, top, roof, blind
    )
    openings = Openings(annex, (main,))
    openings.row((1, 2, 3), 0.9, 2.6, [house_walls.sash(1.1, 0.1, 0.9, 2.1)])
    openings.add_walls(materials, (house_walls.GLASS_M,))
    wings.add_roof(materials, annex)


ROW_HOUSE = Archetype(
    name="row_house",
    draw=draw,
    build=build,
    heights=(6.5, 16.0),
    widths=(4.5, 16.0),
    overhang=0.35,
    party_walls=True,
)
