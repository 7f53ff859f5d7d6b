"""The pair of semi-detached houses."""

from functools import partial

import numpy as np

from worlds.city.buildings.family_house import (
    MARGIN_M,
    FamilyHouse,
    add_garage,
    add_walls_and_roof,
    garage_wing,
    window_rows,
)
from worlds.city.buildings.house_heights import (
    ROOF_M,
    STOREY_M,
    storeys_for,
    wall_top_for,
)
from worlds.city.facades import (
    Openings,
    Roof,
    Wing,
    around,
    bay_windows,
    porches,
    wing_openings,
)
from worlds.shapes import add_chimney

# Greatest depth of the houses [m].
_MOST_DEPTH_M = 10.0
# Least width of a pair of houses with garages [m].
_GARAGES_WIDTH_M = 17.0
# Overlap of the walls of garages and houses [m].
_JOINT_M = 0.06
# Least width of a gabled bay [m].
_LEAST_BAY_M = 1.8
# Greatest width of a canted bay [m].
_CANTED_BAY_M = 2.4
# Distance of doors in the middle from each other's middle, halved [m].
_INNER_DOOR_M = 0.75
# Distance of doors at the ends from the ends of the front [m].
_OUTER_DOOR_M = 0.95
# Height of a porch above the floor [m].
_PORCH_M = 2.35


class SemiDetached(FamilyHouse):
    """The pair of semi-detached houses: mirrored halves under one roof."""

    def draw(self) -> None:
        self.roof = self.pick(("gable", "hip"))
        # Wanted pitch of the roof.
        self.pitch_deg = self.uniform(30.0, 45.0)
        self.floor = self.uniform(0.15, 0.45, digits=2)
        self.window_pitch = self.uniform(2.4, 3.2)
        self.window_width = self.uniform(1.0, 1.4, digits=2)
        self.casing = self.pick(("frame", "sill", "sill", "shutters"))
        # `gabled` (through all storeys, under a gable of its own), `canted`
        # or `none`.
        self.bay = self.pick(("gabled", "canted", "gabled", "none"))
        self.bay_width = self.uniform(2.6, 3.2, digits=2)
        self.bay_reach = self.uniform(0.6, 1.0, digits=2)
        self.doors_inside = self.chance(0.5)
        self.porch_reach = self.uniform(1.1, 1.5, digits=2)
        # Roof of the two garages, one on either side, or `none`.
        self.garages = self.pick(("none", "flat", "shed", "hip"))
        self.garage_width = self.uniform(2.9, 3.4, digits=2)
        self.chimneys = self.pick(("middle", "ends"))

    def build(self) -> None:
        x0, y0, x1, y1 = self.site.bounds
        left, right, back = x0 + MARGIN_M, x1 - MARGIN_M, y1 - MARGIN_M
        front = y0 + min(2.4, 0.25 * (y1 - y0))
        deep = min(back - front, _MOST_DEPTH_M)
        is_wide = right - left > _GARAGES_WIDTH_M
        has_garages = self.garages != "none" and is_wide
        side = self.garage_width if has_garages else 0.0
        storeys = storeys_for(self.height, self.floor, deep, self.pitch_deg)
        wall_top = wall_top_for(self.height, self.floor, deep, storeys)
        roof = Roof(self.roof, eaves=0.4, verge=0.3, thickness=ROOF_M)
        area = (left + side, front, right - side, front + deep)
        main = Wing.at(area, wall_top=wall_top, top=self.height, roof=roof)
        bays = _gabled_bays(self, main) if self.bay == "gabled" else ()
        garages = []
        if has_garages:
            ends = (
                (left, main.x0 + _JOINT_M),
                (main.x1 - _JOINT_M, right),
            )
            garages = [
                garage_wing(
                    self.garages,
                    x0=start,
                    x1=end,
                    y0=front + 1.5,
                    y1=main.y1 - 0.3,
                    most=self.height,
                )
                for start, end in ends
            ]
        self.boxes = (main, *bays, *garages)
        openings = window_rows(self, main, storeys)
        _add_entrances(self, main, openings, y0)
        add_walls_and_roof(self, main, openings)
        for wing in bays:
            _add_gabled_bay(self, wing, storeys)
        for garage in garages:
            add_garage(self, garage)
        _add_chimneys(self, main)


def _add_gabled_bay(houses: SemiDetached, bay: Wing, storeys: int) -> None:
    """Adds a bay under a gable of its own, with windows in all storeys."""
    openings = Openings(houses, bay, houses.boxes)
    wing_openings.add_window_storeys(
        openings,
        [((0,), 2.4)],
        floor=houses.floor,
        storey=STOREY_M,
        count=storeys,
        width=1.5,
        margin=0.2,
    )
    add_walls_and_roof(houses, bay, openings)


def _bay_middles(houses: SemiDetached, main: Wing) -> tuple[float, float]:
    """Returns the middles of the two bays along the main wall [m]."""
    half = (main.x1 - main.x0) / 2
    # Doors take the middle or the ends; bays take the rest of each half.
    offset = 0.6 * half if houses.doors_inside else half - 0.36 * half
    return around(half, offset)


def _gabled_bays(houses: SemiDetached, main: Wing) -> tuple[Wing, ...]:
    """Returns the two bays under gables, or none if there is no room."""
    width = min(houses.bay_width, 0.45 * (main.x1 - main.x0) / 2)
    if width < _LEAST_BAY_M:
        return ()
    rise = min(0.5 * width, main.top - main.wall_top - ROOF_M - 0.2)
    top = main.wall_top + ROOF_M + rise
    roof = Roof("gable", along_y=True, eaves=0.2, verge=0.25, thickness=ROOF_M)
    front, back = main.y0 - houses.bay_reach, (main.y0 + main.y1) / 2
    areas = (
        (main.x0 + x - width / 2, front, main.x0 + x + width / 2, back)
        for x in _bay_middles(houses, main)
    )
    return tuple(
        Wing.at(area, wall_top=main.wall_top, top=top, roof=roof)
        for area in areas
    )


def _add_entrances(
    houses: SemiDetached, main: Wing, openings: Openings, y0: float
) -> None:
    """Adds the doors under one or two roofs, and bays on the ground floor.

    Args:
        openings: openings of the main wing.
        y0: least y of the site [m].
    """
    wall = main.wall(0)
    middle = wall.length / 2
    room = main.y0 - y0 - 0.1
    reach = min(houses.porch_reach, room - 0.3)
    offset = _INNER_DOOR_M if houses.doors_inside else middle - _OUTER_DOOR_M
    eaves = houses.floor + _PORCH_M
    add_porch = partial(
        porches.add_porch,
        houses,
        wall,
        reach=reach,
        deck=houses.floor,
        eaves=eaves,
        top=eaves + 0.4,
    )
    for x in around(middle, offset):
        wing_openings.add_door(openings, x=x, floor=houses.floor)
        if not houses.doors_inside:
            add_porch(x0=x - 0.85, x1=x + 0.85)
    if houses.doors_inside:
        add_porch(x0=middle - 1.6, x1=middle + 1.6, roof="flat", posts=3)
    if houses.bay == "canted":
        _add_canted_bays(houses, main, openings, min(0.7, room - 0.1))
    if houses.doors_inside:
        step = wall.standing(
            x=around(middle, 1.4),
            y=(reach, reach + 0.28),
            z1=0.12,
            bottom=True,
        )
        houses.add_to("base", step)


def _add_canted_bays(
    houses: SemiDetached, main: Wing, openings: Openings, reach: float
) -> None:
    """Adds bay windows to the ground floor, in place of the windows there.

    `reach` is how far they stand out of the wall [m].
    """
    wall = main.wall(0)
    width = min(_CANTED_BAY_M, 0.5 * (wall.length / 2))
    for x in _bay_middles(houses, main):
        openings.clear(
            0,
            x0=x - width / 2 - 0.1,
            x1=x + width / 2 + 0.1,
            z0=0.0,
            z1=houses.floor + STOREY_M - 0.2,
        )
        bay_windows.add_bay_window(
            houses,
            wall,
            x=x,
            width=width,
            reach=reach,
            z0=0.0,
            z1=round(houses.floor + 2.3, 2),
        )


def _add_chimneys(houses: SemiDetached, main: Wing) -> None:
    """Adds a chimney in the middle of the ridge, or one at either end."""
    x, y = main.center
    spots = [x]
    if houses.chimneys != "middle":
        from_end = 0.7 if houses.roof == "gable" else 0.35 * main.width
        spots = [main.x0 + from_end, main.x1 - from_end]
    for k, x in enumerate(spots):
        add_chimney(
            houses,
            f"chimney_{k}",
            (x, y, main.top - 1.1),
            houses.kind.choices["bricks"][0],
            item="chimney_row",
            yaw=np.pi / 2,
            scale=(0.8, 1.0, 1.0),
        )
