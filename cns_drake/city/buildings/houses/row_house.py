"""The row house: one narrow house between its neighbours, with a stoop."""

from __future__ import annotations

from cns_drake.city.buildings.house_parts import family_house, row_unit
from cns_drake.city.facades import house_walls
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.wings import Roof, Wing

_WALLS = (
    *family_house.BRICKS,
    (0.80, 0.74, 0.62),
    (0.70, 0.58, 0.46),
    (0.66, 0.70, 0.68),
    (0.78, 0.62, 0.50),
)
# A house deeper than this gets a lower wing at its back [m].
_MOST_DEPTH = 10.5


class Parameters(family_house.Colours):
    """Parameters of a row house; lengths in metres."""

    def __init__(self, d: Dice) -> None:
        roofs = ["gable", "gambrel", "flat"]
        if d.width < 9.5:
            roofs += ["front", "stepped"]
        unit = row_unit.draw_unit(d.rng, d.width, roofs, family_house.BRICKS)
        self.height = d.height
        self.unit = unit
        self.annex_height = d.uniform(2.8, 3.6, 2)
        self.annex_width = d.uniform(0.45, 0.65)
        self.annex_left = d.chance(0.5)
        self.draw_colours(d, _WALLS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the house on a rectangle."""
    p.paint(out)
    x0, y0, x1, y1 = out.site.bounds
    # Eaves and cornices stay on the lot, except towards the neighbours.
    side = 0.3 * (p.unit.roof == "flat")
    blind = out.site.blind_edges & {1, 3}
    left, right = x0 + side * (3 not in blind), x1 - side * (1 not in blind)
    front, back = y0 + p.unit.stoop, y1 - 0.35
    deep = min(back - front, _MOST_DEPTH)
    if back - front - deep < 1.5:
        deep = back - front
    area = (left, front, right, front + deep)
    main = row_unit.add_unit(out, p.unit, area, p.height, blind)
    if back - main.y1 > 1.0:
        _add_annex(out, p, main, back)


def _add_annex(out: Assembly, p: Parameters, main: Wing, back: float) -> None:
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
    openings.enclose(out, (house_walls.GLASS_M,))
