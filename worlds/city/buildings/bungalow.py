"""The bungalow: one long low storey."""

import numpy as np

from worlds.city.buildings.family_house import (
    FamilyHouse,
    add_walls_and_roof,
    window_rows,
)
from worlds.city.buildings.house_heights import ROOF_M
from worlds.city.facades import (
    Openings,
    Roof,
    Wing,
    around,
    porches,
    solids,
    wing_openings,
)
from worlds.shapes import add_chimney, outlines

# Width of the free strip around the walls, for wide eaves [m].
_MARGIN_M = 0.75
# Number of front wings of each plan.
_FRONT_WINGS = {"long": 0, "ell": 1, "court": 2}
# Length of front that a bungalow needs for each front wing [m].
_WING_ROOM_M = 6.5
# Greatest depth of the main wing [m].
_MOST_DEPTH_M = 8.5
# Least width of a front wing [m].
_LEAST_WING_M = 3.4
# Height of the walls above the floor [m].
_WALL_M = 2.75
# Shorter bungalows have no carport [m].
_CARPORT_FRONT_M = 13.0
# Width of a carport [m].
_CARPORT_M = 3.4
# Length of front that a carport takes from the house [m].
_CARPORT_ROOM_M = 3.6
# Greatest depth of a carport [m].
_CARPORT_DEPTH_M = 6.0
# Height of a carport [m].
_CARPORT_TOP_M = 2.65
# Overlap of the walls of adjoining wings [m].
_JOINT_M = 0.02
# Width of the windows beside the door [m].
_SIDE_LIGHT_M = 0.3


class Bungalow(FamilyHouse):
    """The bungalow: one long low storey, a carport or a garage."""

    def draw(self) -> None:
        # `long`, `ell` (a wing to the front) or `court` (two of them).
        self.plan = self.pick(("long", "ell", "ell", "court"))
        # `garage` in the front wing, `carport` beside the house or `none`.
        self.parking = self.pick(("garage", "carport", "none"))
        # Whether the front wing stands on the right.
        self.mirrored = self.chance(0.5)
        self.roof = self.pick(("gable", "hip", "hip"))
        # Width of a front wing, as a share of the width of the house.
        self.wing_share = self.uniform(0.3, 0.4)
        # How far the front wings stand out from the house.
        self.reach = self.uniform(2.0, 4.0, digits=2)
        self.floor = self.uniform(0.1, 0.35, digits=2)
        self.window_pitch = self.uniform(2.6, 3.6)
        self.window_width = self.uniform(1.2, 1.7, digits=2)
        # Width of the large window beside the door.
        self.picture = self.uniform(2.2, 3.4, digits=2)
        self.casing = self.pick(("frame", "sill", "shutters"))
        self.veranda = self.chance(0.5)
        self.chimney_at = self.uniform(0.25, 0.75)

    def build(self) -> None:
        """Adds all parts of the bungalow, which lies along the front."""
        self._lay_out()
        main, *fronts = self.boxes
        openings = window_rows(self, main, 1)
        _add_main(self, main, openings)
        for k, wing in enumerate(fronts):
            has_garage = self.parking == "garage" and k == 0
            _add_front_wing(self, wing, has_garage)
        if self.carport is not None:
            _add_carport(self, self.carport)
        x = main.x0 + self.chimney_at * main.width
        foot = (x, main.center[1], main.top - 1.3)
        brick, scale = self.colours["base"], (1.5, 1.2, 0.95)
        add_chimney(self, "chimney", foot, brick, scale=scale)

    def _lay_out(self) -> None:
        """Chooses the main wing, the wings in front of it and the carport.

        `free` is the stretch in x on which no other wing hides the main wing's
        front [m].
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + _MARGIN_M, x1 - _MARGIN_M
        back = y1 - _MARGIN_M
        width, depth = right - left, back - y0
        count = min(_FRONT_WINGS[self.plan], int(width / _WING_ROOM_M))
        ahead = min(1.9, 0.2 * depth)
        reach = min(self.reach, 0.3 * depth) if count else 0.0
        front = y0 + max(ahead, _MARGIN_M + reach)
        deep = min(back - front, _MOST_DEPTH_M)
        self.carport: outlines.Area | None = None
        if self.parking == "carport" and width > _CARPORT_FRONT_M:
            end = front + min(_CARPORT_DEPTH_M, deep)
            self.carport = (right - _CARPORT_M, front + 0.4, right, end)
            right -= _CARPORT_ROOM_M
        main = self._main_wing(left, right, front, deep)
        self.boxes = [main]
        self.free = [left, right]
        wing_width = max(_LEAST_WING_M, self.wing_share * (right - left))
        slope = 2 * (self.height - main.wall_top - ROOF_M) / deep
        starts = (left - _JOINT_M, right - wing_width)
        for k, start in enumerate(starts[:count]):
            end = start + wing_width
            area = (start, front - reach, end + _JOINT_M, front + deep / 2)
            rise = slope * wing_width / 2
            self.boxes.append(self._front_wing(area, main, rise))
            # The first front wing is on the left, the second on the right.
            self.free[k] = end if k == 0 else start
        if self.mirrored:
            self._mirror(x0 + x1)

    def _main_wing(
        self, left: float, right: float, front: float, deep: float
    ) -> Wing:
        """Returns the main wing, from x `left` to `right` [m].

        `front` is the y of its front, and `deep` its depth [m].
        """
        top = self.height
        wall_top = min(
            self.floor + _WALL_M,
            top - ROOF_M - 0.1 * deep,
            0.8 * (top - ROOF_M),
        )
        roof = Roof(self.roof, eaves=0.6, verge=0.4, thickness=ROOF_M)
        return Wing.at(
            (left, front, right, front + deep),
            wall_top=wall_top,
            top=top,
            roof=roof,
        )

    def _front_wing(self, area: outlines.Area, main: Wing, rise: float) -> Wing:
        """Returns a wing in front of the main wing.

        `area` is the ground of the wing, and `rise` the height of its roof [m].
        """
        top = min(self.height - 0.2, main.wall_top + ROOF_M + rise)
        roof = Roof(
            self.roof, along_y=True, eaves=0.5, verge=0.4, thickness=ROOF_M
        )
        return Wing.at(area, wall_top=main.wall_top, top=top, roof=roof)

    def _mirror(self, width: float) -> None:
        """Mirrors the plan left to right: x becomes `width` - x."""
        self.boxes = [box.mirrored(width) for box in self.boxes]
        self.free = [width - x for x in reversed(self.free)]
        if self.carport is not None:
            x0, y0, x1, y1 = self.carport
            self.carport = (width - x1, y0, width - x0, y1)


def _add_front_wing(bungalow: Bungalow, wing: Wing, has_garage: bool) -> None:
    """Adds a front wing, with the door of a garage if it has one."""
    openings = window_rows(bungalow, wing, 1)
    if has_garage:
        width = min(wing.width - 0.8, 4.8)
        wing_openings.add_garage_door(openings, x=wing.width / 2, width=width)
    add_walls_and_roof(bungalow, wing, openings)


def _add_main(bungalow: Bungalow, main: Wing, openings: Openings) -> None:
    """Adds the main wing with its door, a large window and the veranda."""
    wall = main.wall(0)
    start, end = (x - main.x0 for x in bungalow.free)
    floor = bungalow.floor
    door = start + 0.3 * (end - start)
    if end - door > bungalow.picture + 1.6:
        window = wing_openings.sash(
            width=bungalow.picture, z=floor, sill=0.45, head=2.15, bars=2
        )
        openings.replace_by_bay(
            0,
            x=(door + 0.6 + end) / 2,
            width=bungalow.picture + 0.7,
            bay=window,
        )
    wing_openings.add_door(openings, x=door, floor=floor, lights=_SIDE_LIGHT_M)
    add_walls_and_roof(bungalow, main, openings)
    reach = min(1.6, main.y0 - bungalow.site.bounds[1] - 0.4)
    if bungalow.veranda and end - start > 4.0 and reach > 0.9:
        eaves = min(floor + 2.25, main.wall_top - 0.35)
        porches.add_porch(
            bungalow,
            wall,
            x0=start + 0.25,
            x1=end - 0.25,
            reach=reach,
            deck=floor,
            eaves=eaves,
            top=eaves + 0.4,
            posts=max(3, round((end - start) / 2.4)),
        )
    else:
        landing = wall.standing(
            x=around(door, 1.0),
            y=(-0.05, min(1.2, reach)),
            z1=floor,
            bottom=True,
        )
        bungalow.add_to("base", landing)


def _add_carport(bungalow: Bungalow, area: outlines.Area) -> None:
    """Adds a flat roof on six posts, with a shed at its end."""
    x0, y0, x1, y1 = area
    top = _CARPORT_TOP_M
    roof = solids.box(x=(x0, x1), y=(y0, y1), z=(top - 0.25, top))
    bungalow.add_to("roof", roof)
    for x in (x0 + 0.15, x1 - 0.15):
        for y in np.linspace(y0 + 0.3, y1 - 2.0, 3).tolist():
            bungalow.add_to("trim", solids.post(x, y, half=0.08, z1=top - 0.2))
    shed = solids.standing(
        x=(x0 + 0.1, x1 - 0.1),
        y=(y1 - 1.6, y1 - 0.1),
        z1=top - 0.2,
        bottom=True,
    )
    bungalow.add_to("walls", shed)
