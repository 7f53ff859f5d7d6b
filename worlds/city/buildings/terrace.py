"""The terrace: a row of narrow houses."""

import copy

import numpy as np

from worlds.city.buildings.house_in_row import HouseInRow, add_house

# Materials of the doors in a terrace.
_DOORS = ("accent", "trim", "roof")
# Depth of the stoops in front of the houses [m].
_STOOP_M = 1.6
# Greatest height of the ground floors [m].
_MOST_FLOOR_M = 0.5
# Roofs of a terrace are lower by this factor than roofs of row houses.
_LOWER_ROOF = 0.8
# Greatest depth of a house [m].
_MOST_DEPTH_M = 10.5
# Strip between the houses and the back of the site, for eaves [m].
_BACK_M = 0.35
# Houses of less than this depth do not stand back [m].
_LEAST_DEPTH_M = 6.0


class Terrace(HouseInRow):
    """The terrace: a row of narrow houses, similar but not the same."""

    def draw(self) -> None:
        # Wanted width of a house.
        self.unit_width = self.uniform(5.0, 6.6)
        self.draw_house(
            self.unit_width,
            ("gable", "gable", "gambrel"),
            ("sill", "sill", "sill", "shutters"),
        )
        self.rise *= _LOWER_ROOF
        self.stoop = _STOOP_M
        self.floor = min(self.plinth, _MOST_FLOOR_M)
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
        """Adds all parts of the houses, side by side along the front."""
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + self.stoop
        back = min(y1 - _BACK_M, front + _MOST_DEPTH_M)
        count = max(1, round((x1 - x0) / self.unit_width))
        bounds = np.round(np.linspace(x0, x1, count + 1), 2).tolist()
        can_stand_back = back - front - self.setback > _LEAST_DEPTH_M
        for k in range(count):
            is_lower = (k // 2) % 2 == 1
            y = front + self.setback if is_lower and can_stand_back else front
            area = (bounds[k], round(y, 2), bounds[k + 1], round(back, 2))
            house = self._varied(k)
            house.height = self.height - self.step if is_lower else self.height
            add_house(
                house,
                area,
                self.site.blind_edges_of_unit(k, count),
                part=f"house_{k:02d}_",
                door_material=self.pick(_DOORS),
            )

    def _varied(self, k: int) -> HouseInRow:
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
