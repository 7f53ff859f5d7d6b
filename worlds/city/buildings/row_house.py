"""The row house: one house between its neighbours."""

from worlds.city.buildings.house_in_row import (
    HouseInRow,
    add_house,
    front_of_site,
)
from worlds.city.facades import Openings, Roof, Wing, wing_openings

_ROOFS = ("gable", "gambrel", "flat")
# A narrow house can also have a roof with a gable to the street.
_NARROW_ROOFS = (*_ROOFS, "front", "stepped")
# A house deeper than this gets a lower wing at its back [m].
_MOST_DEPTH_M = 10.5
# A house narrower than this can have a gable to the street [m].
_NARROW_M = 9.5
# Depth of the stoop in front of the house [m].
_STOOP_M = 1.3
# Strip between the house and the back of the site, for eaves [m].
_BACK_M = 0.35
# Least depth of a lower wing [m].
_LEAST_ANNEX_M = 1.5


class RowHouse(HouseInRow):
    """The row house: one narrow house between its neighbours, with a stoop."""

    def draw(self) -> None:
        width = self.site.width
        self.draw_house(width, _NARROW_ROOFS if width < _NARROW_M else _ROOFS)
        self.stoop = _STOOP_M
        self.floor = self.plinth
        # Height and side of the lower wing behind the house, and its width as a
        # share of the width of the house.
        self.annex_height = self.uniform(2.8, 3.6, digits=2)
        self.annex_share = self.uniform(0.45, 0.65)
        self.annex_left = self.chance(0.5)

    def build(self) -> None:
        _, y0, _, y1 = self.site.bounds
        left, right, blind = front_of_site(self)
        front, back = y0 + self.stoop, y1 - _BACK_M
        deep = min(back - front, _MOST_DEPTH_M)
        if back - front - deep < _LEAST_ANNEX_M:
            deep = back - front
        main = add_house(self, (left, front, right, front + deep), blind)
        if back - main.y1 > 1.0:
            _add_annex(self, main, back)


def _add_annex(house: RowHouse, main: Wing, back: float) -> None:
    """Adds a low wing behind the house, on one side."""
    width = house.annex_share * main.width
    x0 = main.x0 if house.annex_left else main.x1 - width
    blind = main.blind & {3 if house.annex_left else 1}
    top = min(house.annex_height + 0.9, main.wall_top)
    wall_top = min(house.annex_height, top - 0.4)
    area = (x0, main.y1 - 0.06, x0 + width, back)
    roof = Roof("shed", along_y=True, eaves=0.0, verge=0.2, thickness=0.18)
    openings = Openings(
        house,
        Wing.at(area, wall_top=wall_top, top=top, roof=roof, blind=blind),
        (main,),
    )
    openings.add_bays(
        (1, 2, 3),
        z=0.9,
        pitch=2.6,
        choices=[wing_openings.sash(width=1.1, z=0.1, sill=0.9, head=2.1)],
    )
    openings.enclose((wing_openings.GLASS_M,))
